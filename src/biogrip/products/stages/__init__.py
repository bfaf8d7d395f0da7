"""The stages of the study, each from files of the stage before to files of its own."""
