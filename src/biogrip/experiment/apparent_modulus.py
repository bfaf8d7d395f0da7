"""Apparent Young's modulus of a spherical sample from force and shortening (Hertz).

Biologists compare moduli, in Pa; springs and dampers, in N/m and N s/m, belong to one
sample and its size. A contact model relates them. Here it is Hertz's: a sphere of an
incompressible elastic material between two flat rigid jaws that do not stick, each of
which indents it by half the shortening,

    F = 4/3 E/(1 - nu^2) R^(1/2) (delta/2)^(3/2)

(K. L. Johnson, Contact Mechanics, 1985, section 4.2). A cell in suspension and a drop
are round, and the jaws are flat and far stiffer; a cylinder's E = F L/(A delta) would
need an area that is rarely measured. The force grows faster than the shortening, so a
spring has another modulus at every shortening: the modulus is called apparent, and is
given with its shortening. Hertz's theory is one of small strains.
"""

import math

INCOMPRESSIBLE = 0.5


def apparent_modulus(
    force_N: float, shortening_m: float, size_m: float, poisson: float = INCOMPRESSIBLE
) -> float:
    """Return Young's modulus in Pa of a sphere from a force and the shortening it causes.

    The shortening is counted from first contact, the size is the sphere's diameter, and `poisson`
    is Poisson's ratio of the material.
    """
    indentation, radius = 0.5 * shortening_m, 0.5 * size_m
    return 0.75 * (1 - poisson**2) * force_N / math.sqrt(radius * indentation**3)
