"""How fast and how good the study's methods are, against peers in the same run."""
