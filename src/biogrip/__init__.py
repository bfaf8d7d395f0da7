"""Identification of viscoelastic parameters of cells with a MEMS microgripper: a study.

`biogrip.library` has the functions for notebooks, which can also be imported from here::

    import biogrip

    result = biogrip.identify_trace(time_s, strain, reads="strain", hold=1.3)
"""

__version__ = "1.0.0"


_LIBRARY = frozenset(
    (
        *("BiogripError", "INSTRUMENTS", "Arm", "CaseProblem", "Diagnosis", "GeneRange", "Gripper"),
        *("Identification", "Noise", "TraceResult", "identify_trace"),
        *("Phase", "Sample", "add_noise", "hold", "identify_sample", "judge", "plot", "set_up"),
        "simulate",
    )
)


def __getattr__(name: str) -> object:
    # Imported lazily: jobs import this package hundreds of times without the library.
    if name in _LIBRARY:
        # Imported here, after the handlers of signals are installed.
        from importlib import import_module

        return getattr(import_module("biogrip.library"), name)
    raise AttributeError(f"module 'biogrip' has no attribute '{name}'")


def __dir__() -> list[str]:
    return sorted({*globals(), *_LIBRARY})
