"""The study's tables, each as CSV and HTML."""
