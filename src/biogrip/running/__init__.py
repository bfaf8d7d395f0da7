"""Running a study: what the workflow needs, and no physicist has to read."""
