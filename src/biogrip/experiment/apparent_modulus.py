"""What a force and a shortening say of a sample's material, if it is a sphere.

Biologists compare moduli, in Pa; springs and dampers, in N/m and N s/m, belong to one
sample and its size. Between them stands a contact model. Here it is Hertz's: a sphere
of an incompressible elastic material between two flat rigid jaws that do not stick,
each of which indents it by half the shortening,

    F = 4/3 E/(1 - nu^2) R^(1/2) (delta/2)^(3/2)

(K. L. Johnson, Contact Mechanics, 1985, section 4.2). A cell in suspension and a drop
are round, and the jaws are flat and far stiffer; a cylinder's E = F L/(A delta) would
need an area that nobody measures. The force grows faster than the shortening, so a
spring has another modulus at every shortening: it is called apparent, and told with
the shortening at which it holds. Hertz's theory is one of small strains.
"""

import math

INCOMPRESSIBLE = 0.5


def apparent_modulus(
    force_N: float, shortening_m: float, size_m: float, poisson: float = INCOMPRESSIBLE
) -> float:
    """Return the modulus in Pa of the sphere that a force shortens by so much.

    Parameters
    ----------
    force_N
        Force between the jaws.
    shortening_m
        How much nearer they are than when they first touched.
    size_m
        Diameter of the sphere.
    poisson
        Poisson's ratio of the material.
    """
    indentation, radius = 0.5 * shortening_m, 0.5 * size_m
    return 0.75 * (1 - poisson**2) * force_N / math.sqrt(radius * indentation**3)
