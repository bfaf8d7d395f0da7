"""How well a MEMS microgripper identifies the viscoelastic parameters of a cell.

What a notebook needs stands in `biogrip.library`, and can be had from here::

    import biogrip

    experiment = biogrip.set_up(gripper, protocol, biogrip.Sample("liquid_drop"))
"""

from importlib import import_module

__version__ = "0.1.0"


def __getattr__(name: str) -> object:
    # Jobs import this package hundreds of times, and the library hardly ever.
    if not name.startswith("_"):
        library = import_module("biogrip.library")
        if name in library.__all__:
            return getattr(library, name)
    raise AttributeError(f"module 'biogrip' has no attribute '{name}'")
