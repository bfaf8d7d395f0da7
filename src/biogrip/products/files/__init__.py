"""File formats of the results: path, columns, reader and writer of each."""
