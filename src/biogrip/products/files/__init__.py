"""The files of the results: each kind has one place with its path, columns, reader and writer."""
