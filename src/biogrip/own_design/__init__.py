"""The command that designs an experiment: what is asked, and what it writes."""
