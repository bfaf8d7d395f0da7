"""Registry of all products, collected from the packages that declare them."""

from collections.abc import Iterable
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from pkgutil import walk_packages

from biogrip.errors import BiogripError, nearest
from biogrip.products.product import Product

_PACKAGES = ("biogrip.stages", "biogrip.tables", "biogrip.figures", "biogrip.page")


@cache
def products() -> dict[str, Product]:
    """Return every product by its name."""
    found: dict[str, Product] = {}
    for module in _modules():
        for product in _declared(import_module(module)):
            if found.setdefault(product.name, product) is not product:
                raise BiogripError(f"{module}: declares {product.name} a second time.")
    return found


def chosen(names: Iterable[str]) -> list[Product]:
    """Return products by name, importing as few other modules as possible.

    Raises
    ------
    BiogripError
        If there is no product of that name.
    """
    return [_product(name) for name in names]


def _product(name: str) -> Product:
    called_so = [module for module in _modules() if module.endswith(f".{name}")]
    # Without a module of that name, search the sources for the declaration.
    for module in (*called_so, *_modules()):
        if module in called_so or f'"{name}"' in _source(module):
            for product in _declared(import_module(module)):
                if product.name == name:
                    return product
    if name not in products():
        raise BiogripError(
            f"no product '{name}'.{nearest(name, products())} Allowed: {', '.join(products())}."
        )
    return products()[name]


@cache
def _modules() -> tuple[str, ...]:
    return tuple(
        module.name
        for package in _PACKAGES
        for module in walk_packages(import_module(package).__path__, f"{package}.")
    )


@cache
def _source(module: str) -> str:
    spec = find_spec(module)
    return Path(spec.origin).read_text(encoding="utf-8") if spec and spec.origin else ""


def _declared(module: object) -> list[Product]:
    values = vars(module).values()
    items = [item for v in values for item in (v if isinstance(v, tuple) else (v,))]
    own = getattr(module, "__name__", "")
    return [item for item in items if isinstance(item, Product) and item.module == own]
