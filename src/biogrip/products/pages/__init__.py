"""HTML pages of single cases."""
