"""Finding the sample's parameters in a trace."""
