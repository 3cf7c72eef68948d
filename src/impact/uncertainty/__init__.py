"""What uncertain inputs do to an output: Sobol indices and their convergence."""
