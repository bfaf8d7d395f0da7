"""How fast the hot path is, against peers in the same run."""
