"""What a trace tells about a sample, and what it does not."""
