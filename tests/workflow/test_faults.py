import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.helpers.places import ROOT
from tests.helpers.runs import TINY, ran, results_of, snakemake

pytestmark = pytest.mark.nightly

ERRORS = "results/tables/errors_liquid_drop_2.csv"


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_after_a_kill_the_same_command_ends_with_the_undisturbed_bytes(
    tiny: Path, tiny_copy: Path, how: signal.Signals
) -> None:
    """Of Snakemake when there is a result; after kill -9 it asks to be unlocked."""
    for stage in ("identifications", "histories"):
        shutil.rmtree(tiny_copy / "results" / stage / "liquid_drop_2")
    for file in (ERRORS, "results/identifications/liquid_drop_2.csv"):
        (tiny_copy / file).unlink()
    command: list[str | Path] = [sys.executable, "-m", "snakemake", "-j1", "-s", ROOT / "Snakefile"]
    process = subprocess.Popen(
        [*command, "--configfile", tiny_copy / "overlay.yaml", "--", ERRORS],
        cwd=tiny_copy,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        # Tests that run in the background ignore it.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    give_up = time.monotonic() + 120
    while not [*tiny_copy.glob("results/identifications/liquid_drop_2/*/*.csv")]:
        assert time.monotonic() < give_up
        assert process.poll() is None
        time.sleep(0.02)
    process.send_signal(how)
    assert process.wait() != 0
    if how == signal.SIGKILL:
        again = snakemake(tiny_copy, "--", ERRORS, config=TINY, status=1)
        assert "--unlock" in again
        snakemake(tiny_copy, "--unlock", config=TINY)
    snakemake(tiny_copy, "--", ERRORS, "results/tables/methods.csv", config=TINY)
    ours, theirs = results_of(tiny_copy), results_of(tiny)
    assert ours.keys() == theirs.keys()
    assert [name for name in ours if ours[name] != theirs[name]] == []


def test_what_is_missing_or_locked_is_said_and_made_again(tiny: Path, tiny_copy: Path) -> None:
    (tiny_copy / ERRORS).unlink()
    lock = tiny_copy / ".snakemake" / "locks" / "0.output.lock"
    lock.parent.mkdir(parents=True, exist_ok=True)
    lock.write_text(f"{ERRORS}\n")
    refused = snakemake(tiny_copy, "--", ERRORS, config=TINY, status=1)
    assert "Directory cannot be locked" in refused
    shutil.rmtree(tiny_copy / ".snakemake")
    snakemake(tiny_copy, "--", ERRORS, config=TINY)
    assert (tiny_copy / ERRORS).read_bytes() == (tiny / ERRORS).read_bytes()


def test_a_full_disk_leaves_no_part_of_a_file(tmp_path: Path) -> None:
    """Of a process that may write a kilobyte a file: EFBIG, which is reported as ENOSPC is."""
    code = (
        "import resource, signal; signal.signal(signal.SIGXFSZ, signal.SIG_IGN);"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (1024, 1024));"
        "from pathlib import Path; from biogrip.files import write_text;"
        "write_text(Path('table.csv'), 'a' * 5000)"
    )
    run = ran(tmp_path, sys.executable, "-c", code, status=1)
    assert "table.csv: cannot be written: File too large." in run
    assert list(tmp_path.iterdir()) == []
