"""What the study makes: stages, tables, figures and pages, each beside its declaration."""
