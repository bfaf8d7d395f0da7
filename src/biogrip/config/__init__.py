"""The config of a trace, checked and turned into an experiment."""
