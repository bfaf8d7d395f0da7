"""Files that are too large, of hostile shape, or cut: refused or told, in bounded memory."""

import re
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from biogrip.errors import BiogripError
from biogrip.traces import tables
from biogrip.traces.reader import Recording, read_recording
from tests.helpers.columns import columns_of
from tests.helpers.places import ROOT
from tests.helpers.runs import ran

HEADER = "time_s,rotation_rad\n"
ROWS = "".join(f"{row},{row}e-7\n" for row in range(20))


def read(path: Path, text: str | bytes) -> Recording:
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_recording(path, columns_of())


def refused(path: Path, text: str | bytes) -> str:
    with pytest.raises(BiogripError) as caught:
        read(path, text)
    return str(caught.value).removeprefix(str(path))


def test_a_file_or_line_that_is_too_large_is_refused_by_its_line(tmp_path: Path) -> None:
    path, many = tmp_path / "a.csv", 5000 * "0,0\n"
    assert len(read(path, HEADER + ROWS + ",,,\n").time_s) == 20
    said = ", line 5002: found 60001 cells, and 5002 lines in all; allowed are 5000000 cells"
    assert refused(path, HEADER + many + 60_000 * ",").startswith(said)
    assert ", line 2: found 100001 characters" in refused(path, HEADER + 100_001 * "1")
    assert ": found 1200001 lines" in refused(path, HEADER + 1_200_000 * "\n")
    with path.open("wb") as stream:
        # Two billion bytes of 0 that take no room on the disk.
        stream.truncate(2_000_000_000)
    with pytest.raises(BiogripError, match="found more than 50000000 bytes"):
        read_recording(path, columns_of())


def test_the_documentation_says_the_limits() -> None:
    text = (ROOT / "docs" / "scale.md").read_text()
    said = f"{tables._LARGEST_BYTES / 1e6:g} MB, {tables._MOST_LINES / 1e6:g} million lines of at"
    assert said in text
    assert f"most {tables._LONGEST_LINE:,} characters, and {tables._MOST_CELLS / 1e6:g} m" in text


@pytest.mark.parametrize(
    ("end", "said"),
    [
        ("aborted by user\n", "below the last row, where it may be cut: 'aborted by user'."),
        ("\0" * 4096, r"below the last row, where it may be cut: '\x00\x00"),
        ("\x1b[31mred\n", r"'\x1b[31mred'"),
        ("20,2", "The last row has no line end"),
        ("aborted,by user\n", ", line 22, column 'time_s': found 'aborted'"),
        ("20\n", ", line 22: found 1 cell in the row"),
        ("20,2e-6" + "\0" * 9, ", line 22, column 'rotation_rad': found '2e-6\0"),
    ],
)
def test_a_trace_that_was_cut_is_told_or_refused(tmp_path: Path, end: str, said: str) -> None:
    path, text = tmp_path / "a.csv", HEADER + ROWS + end
    if said.startswith(","):
        assert refused(path, text).startswith(said)
    else:
        assert said in " ".join(read(path, text).remarks())


def test_cells_that_the_last_row_lacks_are_told(tmp_path: Path) -> None:
    rows = HEADER.replace("\n", ",x\n") + ROWS.replace("\n", ",5\n")
    assert read(tmp_path / "a.csv", rows).remarks() == []
    (said,) = read(tmp_path / "a.csv", rows + "20,2e-6\n").remarks()
    assert said == "The last row has fewer cells than the row before, as where a file was cut."


# Reads files of hostile shape, and prints the most memory that it took, in kB.
READ = """
import resource, sys
from pathlib import Path
from biogrip.errors import BiogripError
from biogrip.traces.reader import read_recording
from tests.traces.test_limits import hostile
from tests.helpers.columns import columns_of
for number, content in enumerate(hostile(int(sys.argv[1]))):
    Path("a.csv").write_bytes(content)
    try:
        read_recording(Path("a.csv"), columns_of())
    except BiogripError:
        pass
print(number + 1, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
"""


def hostile(count: int) -> Iterator[bytes]:
    """Yield files of lines, cells and marks of any number, the first four of the largest size."""
    for seed in range(count):
        rng = np.random.default_rng([88, seed])
        size = int(10 ** rng.uniform(3, 5.5)) if seed >= 4 else tables._LARGEST_BYTES
        mark = rng.choice([",", ";", "\t", " ", '"', "\0", "#", "\n", "a", "é", "€", "😀", ", "])
        cell = rng.choice(["", "1", "12", "1.5e-7", "a", '"', "-", "1,5", "12:00:00", "'"])
        cells, length = (10 ** rng.uniform(0, [5, 6])).astype(int).tolist()
        line = ((cell + mark) * cells).encode()[:length]
        line += rng.choice([b"\n", b"\r\n", b"\r", b""])
        lines = (line or b"\n") * (size // max(len(line), 1) + 1)
        header = rng.choice([HEADER, "", "time_s rotation_rad\n", "# time_s,rotation_rad\n"])
        yield (header.encode() + lines)[:size]


@pytest.mark.nightly
def test_files_of_hostile_shape_take_less_than_a_gigabyte(tmp_path: Path) -> None:
    said = ran(tmp_path, sys.executable, "-c", READ, "1000", PYTHONPATH=str(ROOT))
    files, peak_kB = map(int, re.findall(r"\d+", said)[-2:])
    assert files == 1000
    assert peak_kB < 1e6
