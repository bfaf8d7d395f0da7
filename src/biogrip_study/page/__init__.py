"""The interactive report of a study."""
