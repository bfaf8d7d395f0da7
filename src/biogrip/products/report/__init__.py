"""The page of the study: what came out, and what it means, to read and to explore."""
