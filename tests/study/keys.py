"""The keys that a config may have, as its schema says."""

from biogrip.study.messages import Schema
from tests.helpers.key_reference import documented

STUDY = Schema(documented(), documented()["$defs"])


def leaves(block: Schema, path: str = "") -> dict[str, Schema]:
    """Every key of a block and below, with what its value may look like."""
    found: dict[str, Schema] = {}
    for name, schema in block.keys.items():
        found[f"{path}{name}"] = schema
        for part in (schema, schema.inside(0), schema.values, *schema.inside(0).options):
            found |= leaves(part, f"{path}{name}.")
    return found
