"""All products there are: every module below this package is asked what it declares."""

from collections.abc import Iterable
from functools import cache
from importlib import import_module
from pkgutil import walk_packages

import biogrip.products
from biogrip.errors import BiogripError, nearest
from biogrip.products.product import Product


@cache
def products() -> dict[str, Product]:
    """Return every product by its name."""
    found: dict[str, Product] = {}
    for module in walk_packages(biogrip.products.__path__, "biogrip.products."):
        for product in _declared(import_module(module.name)):
            if found.setdefault(product.name, product) is not product:
                raise BiogripError(f"{module.name}: declares {product.name} a second time.")
    return found


def chosen(names: Iterable[str]) -> list[Product]:
    """Return some products, without loading the others where a module is named like one.

    Raises
    ------
    BiogripError
        If there is no such product.
    """
    return [_product(name) for name in names]


def _product(name: str) -> Product:
    for folder in ("tables", "figures", "stages", "pages"):
        try:
            module = import_module(f"biogrip.products.{folder}.{name}")
        except ModuleNotFoundError as error:
            if error.name != f"biogrip.products.{folder}.{name}":
                raise
            continue
        for product in _declared(module):
            if product.name == name:
                return product
    if name not in products():
        raise BiogripError(
            f"no product '{name}'.{nearest(name, products())} Allowed: {', '.join(products())}."
        )
    return products()[name]


def _declared(module: object) -> list[Product]:
    values = vars(module).values()
    items = [item for v in values for item in (v if isinstance(v, tuple) else (v,))]
    own = getattr(module, "__name__", "")
    return [item for item in items if isinstance(item, Product) and item.module == own]
