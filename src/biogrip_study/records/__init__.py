"""Files of the results; a reader raises an error that names one that it cannot read."""
