"""YAML files as users write them: each is read, or refused in one message with its line."""

import re
from pathlib import Path

import pytest

from biogrip.errors import BiogripError
from biogrip.study.load import load_study
from biogrip.study.source import LARGEST_BYTES, overlaid, read_config, read_source
from tests.helpers.places import CONFIG, ROOT
from tests.study.test_config import load

BOMB = "\n".join(f"a{i}: &a{i} [{f'*a{i - 1}, ' * 10 if i else 'x'}]" for i in range(30))

UNREADABLE: dict[str, tuple[str | bytes, str]] = {
    "latin 1": (b"seeds: 1\n# \xe9\n", r"line 2: found the byte 0xe9, allowed is text in UTF-8"),
    "a program": (b"\x7fELF\x02\x01\x01" + bytes(99), r"not valid YAML: .*not allowed"),
    "aliases of aliases": (BOMB, r"line \d+: found more than 50 levels or 100000 values, those of"),
    "large": ("# " + "x" * LARGEST_BYTES, r"my.yaml: found more than 1000000 bytes; allowed are"),
    "tag": ("a: !!python/object/apply:os.system [x]", r"line 1: not valid YAML: could not"),
    "sexagesimal": (
        "study_seed: 2\nseeds: 1:30",
        r"line 2: seeds: found 1:30, which YAML reads in base 60; allowed is a number without col",
    ),
    "octal": ("seeds: 010", r"line 1: seeds: found 010, which YAML reads in base 8; allowed is a"),
    "date": ("cases: {x: {title: 2020-01-01}}", r"cases.x.title: found 2020-01-01, which YAML re"),
    "number as a key": ("cases: {1: {}}", r"line 1: cases.1: is no text: YAML reads on, off, yes"),
    "list as a key": ("? [a, b]\n: c", r"line 1: .* is no text"),
    "two documents": ("seeds: 1\n---\nseeds: 2", r"line 2: not valid YAML: but found another docu"),
    "list of all": ("[1, 2]", r"line 1: found no keys, allowed is a config"),
    "given twice": ("seeds: 1\nseeds: 2", r"line 2: seeds: is given twice, first in line 1"),
    "code": ("__use_yte__: true\nseeds: ?1+1", r"line 1: __use_yte__ makes Snakemake run code"),
    "open": ("seeds: [1\n", r"line 2: not valid YAML"),
}


@pytest.mark.parametrize("name", UNREADABLE)
def test_what_cannot_be_read_is_refused_with_its_line(tmp_path: Path, name: str) -> None:
    content, message = UNREADABLE[name]
    file = tmp_path / "my.yaml"
    file.write_bytes(content if isinstance(content, bytes) else content.encode())
    for read in (read_config, read_source):
        with pytest.raises(BiogripError, match=r"my\.yaml") as caught:
            read(file)
        assert re.search(message, str(caught.value)), caught.value


def test_a_config_that_is_not_there_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BiogripError, match=r"nowhere.yaml: cannot be read: No such file"):
        load_study({}, [tmp_path / "nowhere.yaml"])


@pytest.mark.parametrize(
    "text",
    [
        *("\ufeffseeds: 90", "seeds: 0x5a", "seeds: 9_0", "seeds: '9e1'", "seeds: 9e1"),
        *("seeds: '90'", "seeds: &a 90\nbatch_size: *a", '{"seeds": 90}', "---\nseeds: 90\n...\n"),
        "seeds: 90\ngripper: {<<: {arm_length_m: 1e-3}, jaw_gap_m: 1e-4}",
        "seeds: 90\nmeasurement: {offset: null}",
    ],
)
def test_what_is_unusual_but_clear_works(tmp_path: Path, text: str) -> None:
    assert {case.seeds for case in load(tmp_path, text).cases.values()} == {90}


@pytest.mark.parametrize("file", sorted((ROOT / "config").glob("*.yaml")), ids=lambda it: it.stem)
def test_the_shipped_studies_load(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    assert load_study(overlaid(read_config(CONFIG), read_config(file)), [CONFIG, file]).cases
