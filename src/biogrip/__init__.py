"""How well a MEMS microgripper identifies the viscoelastic parameters of a cell.

What a notebook needs stands in `biogrip.library`, and can be had from here::

    import biogrip

    experiment = biogrip.set_up(gripper, protocol, biogrip.Sample("liquid_drop"))
"""

__version__ = "0.1.0"


_LIBRARY = frozenset(
    (
        *("Arm", "CaseProblem", "Diagnosis", "GeneRange", "Gripper", "Identification", "Noise"),
        *("Phase", "Sample", "add_noise", "held", "identify_sample", "judge", "plot", "set_up"),
        "simulate",
    )
)


def __getattr__(name: str) -> object:
    # Jobs import this package hundreds of times, and the library never.
    if name in _LIBRARY:
        # Nor anything else, before it can be stopped without a stack.
        from importlib import import_module

        return getattr(import_module("biogrip.library"), name)
    raise AttributeError(f"module 'biogrip' has no attribute '{name}'")
