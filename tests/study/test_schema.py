from typing import Any

from biogrip.study.validation import OVERRIDABLE, schema


def keys(node: Any, path: str = "") -> list[tuple[str, dict[str, Any]]]:
    """Every key that a config may have, with its schema."""
    found: list[tuple[str, dict[str, Any]]] = []
    if isinstance(node, dict):
        for name, inner in node.items():
            if name == "properties":
                found += [(f"{path}.{key}", leaf) for key, leaf in inner.items()]
            found += keys(inner, f"{path}.{name}")
    return found


def test_every_key_says_what_it_means() -> None:
    known = keys(schema())
    assert len(known) > 80
    bare = [path for path, leaf in known if "$ref" not in leaf and "description" not in leaf]
    assert bare == []


def test_every_block_refuses_unknown_keys() -> None:
    """All but the sample, whose parameters depend on its model and are checked by name."""
    blocks = {"": schema(), **schema()["$defs"]}
    with_keys = {name: block for name, block in blocks.items() if "properties" in block}
    assert [n for n, b in with_keys.items() if b.get("additionalProperties") is not False] == [
        "sample"
    ]


def test_a_case_may_override_what_the_library_says() -> None:
    case = schema()["$defs"]["case"]["properties"]
    assert all(case[name] == {"$ref": f"#/$defs/{name}"} for name in OVERRIDABLE)
