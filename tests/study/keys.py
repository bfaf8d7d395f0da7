"""The keys that a config may have, as the classes define them."""

from biogrip.study.typed import Shape, keys


def leaves(block: type, path: str = "") -> dict[str, Shape]:
    """Every key of a block and below, with what its value may look like."""
    found: dict[str, Shape] = {}
    for name, entry in keys(block).items():
        shape = entry.shape
        parts = (shape, shape.items, shape.values, *shape.options)
        inner = next((part.block for part in parts if part and part.block), None)
        found[f"{path}{name}"] = shape
        if inner:
            found |= leaves(inner, f"{path}{name}.")
    return found
