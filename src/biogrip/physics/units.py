"""Names of units that follow from that of a stiffness: of dampings, compliances and columns.

A stiffness is a load over a deformation, as N/m, Pa or N m/rad, or a pure number, without a name.
"""


def per_second_of(unit: str) -> str:
    """Return the unit of a damping, a load over a rate: ``N s/m`` of ``N/m``, ``s`` of none."""
    above, slash, below = unit.partition("/")
    return f"{above} s".lstrip() + slash + below


def inverse_of(unit: str) -> str:
    """Return the unit of a compliance, or of a rate: ``1/(Pa s)`` of ``Pa s``, none of none."""
    above, _, below = unit.partition("/")
    return f"{below or 1}/({above})" if " " in above else f"{below or 1}/{above}" * bool(unit)


def suffix_of(unit: str) -> str:
    """Return the end of names of columns: ``_Ns_per_m`` of ``N s/m``, ``_Pa_s`` of ``Pa s``."""
    above, slash, below = unit.partition("/")
    if slash:
        return f"_{above.replace(' ', '')}_per_{below}"
    return f"_{above.replace(' ', '_')}" * bool(unit)
