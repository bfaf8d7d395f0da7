"""The study: what the config says, checked and typed."""
