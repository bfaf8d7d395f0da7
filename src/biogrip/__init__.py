"""Identify the viscoelastic parameters of samples in recorded traces, and say what each determines.

`biogrip.library` has the functions for notebooks, which can also be imported from here::

    import biogrip

    result = biogrip.identify_trace(time_s, strain, reads="strain", hold=1.3)
"""

__version__ = "1.0.0"


def __getattr__(name: str) -> object:
    # Imported lazily, for jobs import this package hundreds of times without the library, and after
    # the handlers of signals are installed.
    if not name.startswith("_"):
        from importlib import import_module

        library = import_module("biogrip.library")
        if name in library.__all__:
            return getattr(library, name)
    raise AttributeError(f"module 'biogrip' has no attribute '{name}'")
