"""Results that are damaged on the disk are refused by whoever reads them, or say the same."""

import random
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import yaml

from biogrip.errors import BiogripError
from biogrip.records.identifications import (
    read_batch,
    read_histories,
    read_identifications,
    read_verdicts,
)
from biogrip.records.traces import read_measurements, read_target
from biogrip.study.study import Study
from biogrip.tables.coverage import read_intervals
from biogrip.tables.methods import read_fits
from tests.helpers.default import study_of
from tests.helpers.runs import TINY

CASE = "liquid_drop_2"
READERS: dict[str, Callable[[Study, Path], Any]] = {
    f"targets/{CASE}.csv": lambda study, file: read_target(file, study.cases[CASE].times_s),
    f"identifications/{CASE}/genetic/seeds_0-1.csv": (
        lambda study, file: read_batch(file, study.cases[CASE])
    ),
    f"identifications/{CASE}.csv": (
        lambda study, file: read_identifications(file, study.cases[CASE])
    ),
    "identifications/mine.csv": (
        lambda study, file: read_identifications(file, study.cases["mine"], "genetic")
    ),
    f"selection/{CASE}/seeds_0-1.csv": lambda study, file: read_fits(study, file),
    f"coverage/{CASE}/seeds_0-1.csv": lambda study, file: read_intervals(study, file),
    f"identifiability/{CASE}.json": lambda _, file: read_verdicts(file),
    f"histories/{CASE}.npz": lambda _, file: read_histories(file, "genetic", ["best_misfit"]),
    f"measurements/{CASE}/seeds_0-1.npz": lambda _, file: read_measurements(file, [0, 1]).__dict__,
}
WAYS = ("cut", "lines lost at the end", "a line lost", "bytes lost", "zeros", "a bit")


def damaged(content: bytes, way: str, rng: random.Random) -> bytes:
    at, length = rng.randrange(len(content)), rng.randrange(1, 600)
    lines = content.splitlines(keepends=True)
    if way == "cut":
        return content[:at]
    if way == "lines lost at the end":
        return b"".join(lines[: rng.randrange(len(lines))])
    if way == "a line lost":
        del lines[rng.randrange(len(lines))]
        return b"".join(lines)
    if way == "bytes lost":
        return content[:at] + content[at + length :]
    if way == "zeros":
        return content[:at] + bytes(len(content[at : at + length])) + content[at + length :]
    changed = bytearray(content)
    changed[at] ^= 1 << rng.randrange(8)
    return bytes(changed)


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
    """But for a digit of a CSV file that has become another digit: 250 damages of each kind."""
    # Where the recorded trace is.
    monkeypatch.chdir(tiny)
    study, read = study_of(yaml.safe_dump(TINY)), READERS[name]
    whole = (tiny / "results" / name).read_bytes()
    file = tmp_path / name
    file.parent.mkdir(parents=True)
    shutil.copy(tiny / "results" / name, file)
    first = read(study, file)
    outcomes = dict[tuple[str, str], int]()
    for seed in range(250):
        rng = random.Random(f"{name} {seed}")
        way = rng.choice(WAYS)
        file.write_bytes(now := damaged(whole, way, rng))
        try:
            outcome = "the same" if same(read(study, file), first) or now == whole else "changed"
        except BiogripError as error:
            outcome = "refused" if str(file) in str(error) else "refused without its name"
        outcomes[way, outcome] = outcomes.get((way, outcome), 0) + 1
    print(name, outcomes)
    assert {outcome for _, outcome in outcomes} <= {"refused", "the same", "changed"}
    wrong = {way: count for (way, outcome), count in outcomes.items() if outcome == "changed"}
    assert set(wrong) <= ({"a bit", "bytes lost"} if name.endswith(".csv") else set())
