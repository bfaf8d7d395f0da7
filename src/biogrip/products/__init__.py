"""Products of a study (intermediate files, tables, figures, pages), each declared by its module."""
