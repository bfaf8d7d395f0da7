"""What the repository says of itself to those who cite and archive it."""

import json
from typing import Any

import jsonschema
import pytest
import yaml

from tests.helpers.places import ROOT

TEXT = {"type": "string", "minLength": 1}
KEYWORDS = {"type": "array", "items": TEXT, "uniqueItems": True}
# Written from "Deposit metadata" of https://developers.zenodo.org; of the keys only those of
# software. A licence is its identifier there, and an object with that in an archived release.
ZENODO = {
    "type": "object",
    "additionalProperties": False,
    "required": ["title", "creators", "description", "license"],
    "properties": {
        "title": TEXT,
        "description": TEXT,
        "version": TEXT,
        "keywords": KEYWORDS,
        "creators": {
            "type": "array",
            "minItems": 1,
            "items": {
                "type": "object",
                "additionalProperties": False,
                "required": ["name"],
                "properties": {
                    "name": TEXT,
                    "affiliation": TEXT,
                    "orcid": {"type": "string", "pattern": r"^(\d{4}-){3}\d{3}[\dX]$"},
                },
            },
        },
        "license": {
            "anyOf": [
                TEXT,
                {
                    "type": "object",
                    "additionalProperties": False,
                    "required": ["id"],
                    "properties": {"id": TEXT},
                },
            ]
        },
        "upload_type": {"const": "software"},
        "publication_date": {"type": "string", "pattern": r"^\d{4}-\d{2}-\d{2}$"},
        "related_identifiers": {
            "type": "array",
            "items": {
                "type": "object",
                "required": ["identifier", "relation"],
                "properties": {"identifier": TEXT, "relation": TEXT},
            },
        },
    },
}
# Written from the terms of CodeMeta 2.0, https://codemeta.github.io/terms.
CODEMETA = {
    "type": "object",
    "additionalProperties": False,
    "required": ["@context", "@type", "name", "author", "license", "version"],
    "properties": {
        "@context": {"const": "https://doi.org/10.5063/schema/codemeta-2.0"},
        "@type": {"enum": ["SoftwareSourceCode", "SoftwareApplication"]},
        "name": TEXT,
        "description": TEXT,
        "version": TEXT,
        "keywords": KEYWORDS,
        "license": {"type": "string", "pattern": "^https://spdx.org/licenses/"},
        "author": {
            "type": "array",
            "minItems": 1,
            "items": {
                "type": "object",
                "required": ["@type", "name"],
                "properties": {"@type": {"enum": ["Person", "Organization"]}, "name": TEXT},
            },
        },
    },
}
SCHEMAS = {".zenodo.json": ZENODO, "codemeta.json": CODEMETA}


def read(name: str) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((ROOT / name).read_text(encoding="utf-8"))
    return found


@pytest.mark.parametrize("name", SCHEMAS)
def test_what_archives_read_is_as_they_specify(name: str) -> None:
    jsonschema.validate(read(name), SCHEMAS[name])


@pytest.mark.parametrize(
    ("name", "key", "wrong"),
    [
        (".zenodo.json", "creators", []),
        (".zenodo.json", "licence", "MIT"),
        (".zenodo.json", "license", {"name": "MIT"}),
        ("codemeta.json", "licence", "MIT"),
        ("codemeta.json", "license", "MIT"),
        ("codemeta.json", "author", ["somebody"]),
    ],
)
def test_what_is_not_as_specified_is_seen(name: str, key: str, wrong: object) -> None:
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate({**read(name), key: wrong}, SCHEMAS[name])


def test_all_say_the_same() -> None:
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    zenodo, codemeta = read(".zenodo.json"), read("codemeta.json")
    said = (citation["title"], citation["abstract"], citation["keywords"], citation["version"])
    assert said == tuple(zenodo[key] for key in ("title", "description", "keywords", "version"))
    assert said == tuple(codemeta[key] for key in ("name", "description", "keywords", "version"))
    names = [author["name"] for author in citation["authors"]]
    assert names == [each["name"] for each in zenodo["creators"]]
    assert names == [each["name"] for each in codemeta["author"]]
    assert codemeta["license"].endswith(f"/{zenodo['license']['id']}")
    assert zenodo["license"]["id"] == citation["license"]
