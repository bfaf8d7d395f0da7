"""What is said of every key, and the JSON Schema that follows from it."""

import json
from pathlib import Path
from typing import Any

import pytest
import yaml
from jsonschema import Draft202012Validator

from biogrip.fit.methods import METHODS
from biogrip.study.case_blocks import OVERRIDABLE
from biogrip.study.source import read_config
from tests.helpers.key_reference import STUDY, file_schema, leaves

CONFIG = Path(__file__).parents[2] / "config"
SCHEMA: dict[str, Any] = json.loads(file_schema())


def test_every_key_says_what_it_means() -> None:
    known = leaves(STUDY)
    assert len(known) > 80
    assert [path for path, shape in known.items() if not shape.get("description")] == []


def test_every_number_has_bounds() -> None:
    kinds = ("integer", "number")
    numbers = {path: key.node for path, key in leaves(STUDY).items() if key.get("type") in kinds}
    assert len(numbers) > 40
    assert [path for path, node in numbers.items() if "maximum" not in node] == []
    assert [p for p, node in numbers.items() if not {*node} & {"minimum", "exclusiveMinimum"}] == []


def test_every_block_refuses_unknown_keys() -> None:
    """All but those that take names of the user's or of a model's."""
    blocks = {"": SCHEMA, **SCHEMA["$defs"]}
    with_keys = {name: block for name, block in blocks.items() if "properties" in block}
    open_ = [n for n, b in with_keys.items() if b.get("additionalProperties") is not False]
    assert sorted(open_) == ["SampleBlock", "ValueBlock"]


def test_a_case_may_override_the_blocks_of_the_study_and_of_every_method() -> None:
    methods = {block for method in METHODS.values() for block in method.blocks}
    assert methods < set(OVERRIDABLE)
    assert set(OVERRIDABLE) == set(STUDY.keys["cases"].values.keys) & set(STUDY.keys)


@pytest.mark.parametrize("file", sorted(CONFIG.glob("*.yaml")), ids=lambda file: file.stem)
def test_the_schema_knows_the_files_that_there_are(file: Path) -> None:
    Draft202012Validator.check_schema(SCHEMA)
    assert [e.message for e in Draft202012Validator(SCHEMA).iter_errors(read_config(file))] == []


@pytest.mark.parametrize(
    "text",
    [
        "seedz: 3",
        "gripper: {left: {mass_kg: 1}}",
        "measurement: {noise: {kind: pink}}",
        "least_squares: {starts: many}",
        "cases: {x: {sample: {model: jelly}}}",
        "protocol: {phases: []}",
    ],
)
def test_the_schema_marks_what_the_study_refuses(text: str) -> None:
    assert list(Draft202012Validator(SCHEMA).iter_errors(yaml.safe_load(text)))
