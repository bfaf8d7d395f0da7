"""The study's figures, each as PNG, and as PDF if asked."""
