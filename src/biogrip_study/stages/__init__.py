"""Stages of the study; each reads files of an earlier stage and writes its own."""
