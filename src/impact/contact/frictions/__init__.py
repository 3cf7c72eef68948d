"""The catalogue of friction laws."""
