"""The study's figures, each as PNG and PDF."""
