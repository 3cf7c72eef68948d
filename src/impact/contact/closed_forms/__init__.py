"""Closed forms of the impact of two balls, against which the numerical results are checked."""
