"""File formats of the results: path, columns, reader and writer of each.

A reader raises a `BiogripError` that names the file if it is missing, damaged or of another kind.
"""
