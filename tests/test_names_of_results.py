"""Names of results: two traces never have one, whatever the files are called."""

import json
import re
from pathlib import Path

import pytest

from biogrip.command.outputs import check_outputs
from biogrip.command.settings import Asked
from biogrip.errors import BiogripError
from tests.helpers.identified import identify, write_drop

ODD = ["a\nb.csv", "q'u\"o.csv", "{x}<b>.csv", "\x1b[31mred.csv", "%41.csv", "z\udce9.csv"]


def test_names_keep_what_tells_traces_apart() -> None:
    files = ["cell.001", "cell.002", "cell.csv", "cell.txt", "cell.csv.csv", "sub/cell.csv"]
    asked = [Asked(Path(file)) for file in files]
    parts = ["A 1", "A_1", "A/1", "A%1", "A:1", "A\n1", "A\udce91", "strain=A 1"]
    asked += [Asked(Path("cell.csv"), part=part) for part in parts]
    names = [str(one.output) for one in asked]
    assert names[:3] == [
        "cell.001.identified.json",
        "cell.002.identified.json",
        "cell.identified.json",
    ]
    assert len({*names}) == len(asked)
    assert all(str(one.output.parent) in (".", "sub") for one in asked)
    assert not any(re.search(r'[<>:"|?*\\\n]', name) for name in names)


def test_a_result_of_another_trace_is_not_replaced(tmp_path: Path, few: Path) -> None:
    """With and without a folder before the name; of the trace itself it is."""
    for name in ("cell.001", "cell.002"):
        write_drop(tmp_path / name, 0)
    result, options = tmp_path / "one.json", ("--config", few, "--output", tmp_path / "one.json")
    assert identify(tmp_path / "cell.001", *options)[0] == 0
    before = result.read_bytes()
    assert identify(tmp_path / "cell.001", *options)[0] == 0
    status, _, said = identify(tmp_path / "cell.002", *options)
    assert (status, result.read_bytes()) == (1, before)
    assert f"{result}: is the result of '{tmp_path}/cell.001', and would be replaced for" in said
    assert "cell.002'; allowed is another name, or to delete it first." in said
    check_outputs([("cell.001", result)], [])
    for other in ("cell.002", "--csv"):
        with pytest.raises(BiogripError, match=f"would be replaced for '{other}'"):
            check_outputs([(other, result)], [])


def test_what_is_to_be_written_twice_is_named(
    tmp_path: Path, few: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("a", "a.csv"):
        write_drop(Path(name), 0)
    status, _, said = identify("a", "a.csv", "--config", few)
    assert status == 1
    assert "a.identified.json: would be written for 'a' and for 'a.csv'; allowed is a" in said
    assert not Path("a.identified.json").exists()
    Path("x").mkdir()
    status, _, said = identify("a.csv", "--config", few, "--csv", "f", "--report", "x/../f")
    assert (status, "would be written for '--report' and for '--csv'" in said) == (1, True)


@pytest.mark.nightly
def test_a_file_of_any_name_has_its_row(
    tmp_path: Path, few: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for number, name in enumerate(ODD):
        write_drop(Path(name), number)
    options = ("--config", few, "--csv", "found.csv", "--report", "page.html")
    status, said, complained = identify(*ODD, *options)
    assert (status, "Traceback" in complained) == (0, False)
    for text in (said, complained, Path("page.html").read_text()):
        assert "\x1b" not in text
    for name in ODD:
        result = json.loads(Asked(Path(name)).output.read_text())
        assert (result["trace"], result["fit"]) == (name, "ok")


def test_an_option_that_is_no_text_is_a_column_that_is_not_there(tmp_path: Path) -> None:
    write_drop(tmp_path / "a.csv", 0)
    for option in ("--time", "--sd", "--frequency"):
        status, _, said = identify(tmp_path / "a.csv", option, "Zeit \udcb5s")
        assert (status, "Traceback" in said) == (1, False)
