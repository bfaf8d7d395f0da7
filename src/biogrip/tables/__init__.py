"""The study's tables, each as CSV, Markdown, LaTeX and HTML."""
