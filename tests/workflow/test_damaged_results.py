import random
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import yaml

from biogrip.errors import BiogripError
from biogrip_study.records import identifications as found
from biogrip_study.records.traces import read_measurements, read_target
from biogrip_study.tables.study import read_fits, read_intervals
from tests.helpers.default import study_of
from tests.helpers.runs import TINY, results_of, snakemake

CASE = "liquid_drop_2"
READERS: dict[str, Callable[[Path, Any], Any]] = {
    f"targets/{CASE}.csv": lambda file, case: read_target(file, case.times_s),
    f"identifications/{CASE}/genetic/seeds_0-1.csv": found.read_batch,
    f"identifications/{CASE}.csv": found.read_identifications,
    "identifications/mine.csv": lambda it, case: found.read_identifications(it, case, "genetic"),
    f"selection/{CASE}/seeds_0-1.csv": lambda file, case: read_fits(case.study, file),
    f"coverage/{CASE}/seeds_0-1.csv": lambda file, case: read_intervals(case.study, file),
    f"identifiability/{CASE}.json": lambda file, _: found.read_verdicts(file),
    f"histories/{CASE}.npz": lambda it, _: found.read_histories(it, "genetic", ["best_misfit"]),
    f"measurements/{CASE}/seeds_0-1.npz": lambda it, _: vars(read_measurements(it, [0, 1])),
}


KINDS = [name for name in READERS if name != "identifications/mine.csv"]


@pytest.mark.nightly
@pytest.mark.parametrize("name", KINDS)
def test_the_advice_on_a_damaged_result_brings_all_back(
    tiny: Path, tiny_copy: Path, name: str
) -> None:
    """Followed as the message says, whatever Snakemake has removed when it was refused."""
    file = tiny_copy / "results" / name
    content = file.read_bytes()
    file.write_bytes(content[: len(content) // 2])
    said = snakemake(tiny_copy, "--keep-going", config=TINY, status=1)
    advised = {*re.findall(r"^biogrip: (results/[^:,\n]*)[:,].* with --forcerun and", said, re.M)}
    assert advised == {f"results/{name}"}
    snakemake(tiny_copy, "--forcerun", *advised, config=TINY)
    ours, theirs = results_of(tiny_copy), results_of(tiny)
    assert ours.keys() == theirs.keys()
    assert [file for file in ours if ours[file] != theirs[file]] == []


def damaged(content: bytes, rng: random.Random) -> dict[str, bytes]:
    at, length = rng.randrange(len(content)), rng.randrange(1, 600)
    lines, before, after = content.splitlines(True), content[:at], content[at + length :]
    line, bit = rng.randrange(len(lines)), content[at] ^ 1 << rng.randrange(8)
    return {
        "cut": before,
        "lines lost at the end": b"".join(lines[:line]),
        "a line lost": b"".join(lines[:line] + lines[line + 1 :]),
        "bytes lost": before + after,
        "zeros": before + bytes(len(content[at : at + length])) + after,
        "a bit": before + bytes([bit]) + content[at + 1 :],
    }


def same(one: Any, other: Any) -> bool:
    if isinstance(one, pd.DataFrame):
        return bool(one.equals(other))
    try:
        np.testing.assert_equal(one, other)
    except AssertionError:
        return False
    return True


@pytest.mark.nightly
@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("name", READERS)
def test_a_result_that_is_damaged_is_refused_or_was_not_changed(
    tiny: Path, tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """But for a digit of a CSV file that has become another digit, in 250 damages."""
    monkeypatch.chdir(tiny)
    case = study_of(yaml.safe_dump(TINY)).cases["mine" if "mine" in name else CASE]
    whole, read, file = (tiny / "results" / name).read_bytes(), READERS[name], tmp_path / name
    file.parent.mkdir(parents=True)
    file.write_bytes(whole)
    first = read(file, case)
    for seed in range(250):
        rng = random.Random(f"{name} {seed}")
        way, content = rng.choice([*damaged(whole, rng).items()])
        file.write_bytes(content)
        said = str(file)
        try:
            may_change = name.endswith(".csv") and way in ("a bit", "bytes lost")
            assert same(read(file, case), first) or may_change, (way, seed)
        except BiogripError as error:
            said = str(error)
        assert str(file) in said
