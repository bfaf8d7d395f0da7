"""The stages of the study, each from files of the stage before to files of its own.

A stage is handed exactly the settings that it uses; the workflow tracks them.
"""
