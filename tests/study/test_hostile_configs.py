"""Configs that stall, mislead or overflow: each is used or refused in one message, at once."""

import random
import re
import time
from pathlib import Path

import pytest
import yaml
from biogrip.products.catalogue import products
from biogrip.products.plan import Plan
from biogrip.running.rules import make_rules

from biogrip.errors import BiogripError
from biogrip.study.load import load_study
from biogrip.study.source import overlaid, read_config, read_places
from biogrip.study.study import Study
from biogrip.study.yaml_text import LARGEST_BYTES
from tests.workflow.conftest import ROOT

DEFAULT = ROOT / "config" / "config.yaml"
DEFAULTS = read_config(DEFAULT)
DROP = "sample: {model: liquid_drop, k: 1.0, k_p: 1.0, c: 1.0}"
LONGEST_S = 10.0
# libyaml is ten times faster, but not part of every PyYAML.
DUMPER = getattr(yaml, "CSafeDumper", yaml.SafeDumper)


def load(file: Path) -> Study:
    """Load a study, the default one under a file, as `biogrip identify` does."""
    merged = overlaid(DEFAULTS, read_config(file))
    return load_study(merged, [DEFAULT, file])


def written(folder: Path, content: str | bytes) -> Path:
    file = folder / "my.yaml"
    file.write_bytes(content if isinstance(content, bytes) else content.encode())
    return file


def refusal(file: Path) -> str:
    """What is said of a file, at once."""
    start = time.process_time()
    with pytest.raises(BiogripError) as error:
        load(file)
    assert time.process_time() - start < LONGEST_S
    said = str(error.value)
    assert len(said) < 4000
    assert said.count("\n") <= 7
    return said


def bomb(levels: int, each: int) -> str:
    """Lists of aliases of lists of aliases."""
    lines = ["a0: &a0 [x, x]"]
    lines += [f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * each)}]" for i in range(1, levels)]
    return "\n".join(lines)


def chain(levels: int) -> str:
    """A nesting that only aliases make deep."""
    return "\n".join(["a0: &a0 [x]", *(f"a{i}: &a{i} [*a{i - 1}]" for i in range(1, levels))])


UNREADABLE: dict[str, tuple[str | bytes, str]] = {
    "latin 1": ("title: é".encode("latin-1"), r"line 1: found the byte 0xe9, allowed is text in U"),
    "latin 1 below": (b"seeds: 1\n# \xe9\n", r"line 2: found the byte 0xe9, allowed is text"),
    "UTF-16": (
        "seeds: 3\n".encode("utf-16"),
        r"line 1: found the byte 0xff, allowed is text in UT",
    ),
    "a program": (
        b"\x7fELF\x02\x01\x01" + bytes(99),
        r"line 1: found the character U\+007F, allow",
    ),
    "NUL": ("seeds: 3\nx: \0", r"line 2: found the character U\+0000, allowed is text"),
    "two marks": ("\ufeff\ufeffseeds: 3", r"line 1: found the character U\+FEFF"),
    "billion laughs": (bomb(30, 10), r"line \d+: found more than 100000 values, those of an alias"),
    "laughs of merges": (
        "\n".join(
            ["a0: &a0 {x: 1}"]
            + [f"a{i}: &a{i} {{<<: [{', '.join([f'*a{i - 1}'] * 9)}]}}" for i in range(1, 12)]
        ),
        r"line \d+: found more than 100000 values",
    ),
    "alias of itself": ("a: &a [*a]", r"line 1: the alias \*a contains itself"),
    "alias of its block": ("a: &a\n  b: {c: *a}", r"line 2: the alias \*a contains itself"),
    "merge of itself": ("a: &a {<<: *a}", r"line 1: the alias \*a contains itself"),
    "unknown alias": ("a: *b", r"line 1: not valid YAML: found undefined alias"),
    "deep list": ("a: " + "[" * 1000 + "]" * 1000, r"line 1: found more than 50 levels of nesting"),
    "deep list, open": ("[" * 900_000, r"line 1: found more than 50 levels of nesting"),
    "deep block": (
        "\n".join(" " * i + "a:" for i in range(900)),
        r"line 5\d: found more than 50 levels of nesting",
    ),
    "deep by aliases": (chain(3000), r"line 50: found more than 50 levels of nesting, allowed are"),
    "large": ("# " + "x" * LARGEST_BYTES, r"found more than 1000000 bytes, allowed are 1000000"),
    "many values": ("a: [" + "1," * 200_000 + "]", r"line 1: found more than 100000 values"),
    "long text": ("a: " + "x" * 5001, r"line 1: found text of 5001 characters, allowed are 5000"),
    "long key": ("x" * 900 + ": 1", r"line 1: x+\.\.\.: unknown key"),
    "long number": ("seeds: " + "9" * 4400, r"line 1: seeds: found a number of 4400 characters, a"),
    "long hexadecimal": ("seeds: 0x" + "f" * 4400, r"seeds: found a number of 4402 characters"),
    "long fraction": ("seeds: 0." + "1" * 4400, r"seeds: found a number of 4402 characters"),
    "tag of an object": ("a: !!python/object/apply:os.system [x]", r"line 1: found the tag !!pyth"),
    "tag of a number": ("seeds: !!int many", r"line 1: found the tag !!int, allowed are values wi"),
    "local tag": ("seeds: !x 3", r"line 1: found the tag !x, allowed are values without tags"),
    "sexagesimal": (
        "study_seed: 2\nseeds: 1:30",
        r"line 2: seeds: found 1:30, which YAML reads in base 60; allowed is a number without col",
    ),
    "sexagesimal fraction": ("seeds: 1:30.5", r"line 1: seeds: found 1:30.5, which YAML reads in"),
    "time of day": ("study_seed: 12:30:00", r"study_seed: found 12:30:00, which YAML reads in ba"),
    "octal": ("seeds: 010", r"line 1: seeds: found 010, which YAML reads in base 8; allowed is a"),
    "octal in a list": (
        "measurement:\n  times_s: [1, 017]",
        r"line 2: measurement.times_s\[1\]: f",
    ),
    "date": ("cases: {x: {title: 2020-01-01}}", r"cases.x.title: found 2020-01-01, which YAML re"),
    "no such date": ("cases: {x: {title: 2020-13-41}}", r"title: found 2020-13-41, which YAML rea"),
    "number as a key": (
        "cases: {1:30: {}}",
        r"cases.1:30: found 1:30, which YAML reads in base 60",
    ),
    "equals": ("seeds: =", r"seeds: found =, which YAML reads as a default"),
    "list as a key": (
        "? [a, b]\n: c",
        r"line 1: the file: has a block or list as a key, allowed i",
    ),
    "merge of a number": ("a: {<<: 3}", r"line 1: not valid YAML: expected a mapping or list"),
    "two documents": ("seeds: 1\n---\nseeds: 2", r"line 2: not valid YAML: but found another docu"),
    "list of all": ("[1, 2]", r"line 1: found no keys, allowed is a config"),
    "text of all": ("seeds", r"line 1: found no keys, allowed is a config"),
    "given twice": ("seeds: 1\nseeds: 2", r"line 2: seeds: is given twice, first in line 1"),
    "code": ("__use_yte__: true\nseeds: ?1+1", r"line 1: __use_yte__ makes Snakemake run code"),
    "tab": ("gripper:\n\tleft: 3", r"line 2: not valid YAML"),
}


@pytest.mark.parametrize("name", UNREADABLE)
def test_what_cannot_be_read_is_refused_with_its_line(tmp_path: Path, name: str) -> None:
    content, message = UNREADABLE[name]
    file = written(tmp_path, content)
    said = refusal(file)
    assert re.search(message, said), said
    assert "my.yaml" in said


@pytest.mark.parametrize("name", [name for name in UNREADABLE if name != "long key"])
def test_reading_the_places_refuses_it_too(tmp_path: Path, name: str) -> None:
    """So that one who reads them first is not left to Snakemake's reader."""
    with pytest.raises(BiogripError, match=r"my\.yaml"):
        read_places([written(tmp_path, UNREADABLE[name][0])])


@pytest.mark.parametrize("name", ["", ".", "x" * 300, "/dev/zero"])
def test_a_config_that_is_no_file_is_refused(name: str) -> None:
    with pytest.raises(BiogripError, match=r"cannot be read|is no regular file"):
        read_config(Path(name))


def phase(keys: str) -> str:
    return f"protocol: {{phases: [{{{keys}}}]}}"


def drop(keys: str = "", k: str = "1.0") -> str:
    """A case with a key changed or more keys."""
    return f"cases: {{x: {{{DROP.replace('k: 1.0', f'k: {k}')}, {keys}}}}}"


LENGTHS = ("arm_length_m", "jaw_gap_m")
ARM = ("inertia_kgm2", "damping_Nms_per_rad", "stiffness_Nm_per_rad")
COMB = ("thickness_m", "finger_width_m", "finger_gap_m", "first_radius_m")
EXTREME = [
    *((f"gripper: {{{key}: 1e200}}", rf"{key}: found 1e\+200, allowed is at l") for key in LENGTHS),
    *((f"gripper: {{left: {{{key}: 1.0e+200}}}}", rf"{key}: found 1e\+200, allowe") for key in ARM),
    *((f"gripper: {{right: {{{key}: 1e-200}}}}", rf"{key}: found 1e-200, allowed") for key in ARM),
    *(
        (f"actuator: {{{key}: 1.0e+200}}", rf"{key}: found 1e\+200, allowed is at le")
        for key in COMB
    ),
    *(
        (f"actuator: {{{key}: 1.0e-200}}", rf"{key}: found 1e-200, allowed is at lea")
        for key in COMB
    ),
    (
        phase("duration_s: 1.0e+308, torque_Nm: 1e-9"),
        r"phases\[0\].duration_s: found 1e\+308, allowed is at least 1e-06 and at most 1e\+09 s",
    ),
    (
        "gripper: {left: {damping_Nms_per_rad: 1e-20}}",
        r"gripper.left.damping_Nms_per_rad: makes the arm's quality factor 6.63e\+09, allowed is",
    ),
    (
        drop("assumed_gripper: {left: {damping_Nms_per_rad: 1e-20}}"),
        r"assumed_gripper.left.damping_Nms_per_rad: makes the arm's quality factor 6.63e\+09",
    ),
    (phase("duration_s: 1e-308, torque_Nm: 1e-9"), r"duration_s: found 1e-308, allowed is at leas"),
    (phase(f"duration_s: {'9' * 90}, torque_Nm: 1e-9"), r"duration_s: found 9+\.\.\., allowed is"),
    (
        "protocol: {phases: [&a {duration_s: 6e8, torque_Nm: 1e-9}, *a]}",
        r"protocol.phases: found 1.2e\+09 s in all phases together, allowed is at most 1e\+09 s",
    ),
    (phase("duration_s: 9, voltage_V: 1e200"), r"voltage_V: found 1e\+200, allowed is at least 0"),
    (phase("duration_s: 9, torque_Nm: 1e200"), r"torque_Nm: found 1e\+200, allowed is at least 0"),
    (
        phase("duration_s: 9, torque_Nm: 1e-9, amplitude_Nm: 1e-9, frequency_Hz: 1e99"),
        r"frequency_Hz: found 1e\+99, allowed is at least 1e-09 and at most 1e\+09 Hz",
    ),
    (
        "measurement: {rate_Hz: 1e200}",
        r"rate_Hz: found 1e\+200, allowed is at least 1e-09 and at m",
    ),
    ("measurement: {rate_Hz: 1.0e+999}", r"rate_Hz: found inf, allowed is a finite number"),
    ("measurement: {rate_Hz: '1e999'}", r"rate_Hz: found inf, allowed is a finite number"),
    ("measurement: {rate_Hz: .nan}", r"rate_Hz: found nan, allowed is a finite number"),
    (f"measurement: {{times_s: {list(range(100_000))}}}", r"line 1: found more than 100000 values"),
    (
        f"measurement: {{times_s: {list(range(20_000))}}}",
        r"line 1: measurement.times_s: found a list of 20000, allowed are at most 5000 items",
    ),
    (
        "search_range: {k: {exponent: [2, 2], digit: [3, 3]}}",
        r"search_range.k: leaves one value, and nothing to search for; .* the case's key fixed",
    ),
    (drop(k="1e-300"), r"x.sample.k: found 1e-300, allowed is at least 1e-18 N/m"),
    (drop(k="1e300"), r"x.sample.k: found 1e\+300, allowed is at most 1e\+12"),
    (drop("fixed: {k: 1e300}"), r"x.fixed.k: found 1e\+300, allowed is at least 0 and at most 1e"),
    (drop("fixed: {k: 1e-300}"), r"x.fixed.k: found 1e-300, allowed is at least 1e-18 N/m"),
    (
        drop("assumed_gripper: {arm_length_m: 1e200}"),
        r"x.assumed_gripper.arm_length_m: found 1e\+200, allowed is at least 1e-06 and at most 1 m",
    ),
    (
        drop("assumed_gripper: {left: {inertia_kgm2: true}}"),
        r"x.assumed_gripper.left.inertia_kgm2: found True, allowed is a number",
    ),
    (drop("assumed_gripper: {left: {inertia: 1}}"), r"left.inertia: unknown key. Did you mean 'in"),
    (
        drop('title: "abc\\n"'),
        r"x.title: found 'abc\\n', allowed is text of 1 to 60 letters, digits",
    ),
    (drop('title: "a|b"'), r"x.title: found 'a\|b', allowed is text of 1 to 60 letters, digits"),
    (
        drop('title: "-1+2"'),
        r"x.title: found '-1\+2', allowed is text .*not beginning with a space",
    ),
    (
        f'cases: {{"abc\\n": {{{DROP}}}}}',
        r"cases.'abc\\n': not a usable case name: a letter, then up to 63 letters, digits",
    ),
    ('sweeps: {? "a\\n" : {}}', r"sweeps.'a\\n': not a usable sweep name: a letter, then up to 31"),
    (
        "gripper: {uncertainty: {left: {'=1+1': 1}}}",
        r"gripper.uncertainty.left: found '=1\+1'. Allowed: inertia_kgm2, damping_Nms_per_rad",
    ),
    (
        f"methods: [{', '.join(['{a: 1}'] * 5000)}]",
        r"methods: found a list of 5000, allowed are at",
    ),
    ("\n".join(f"k{i}: 1" for i in range(20_000)), r"line 1: k0: unknown key\."),
]


@pytest.mark.parametrize(("text", "message"), EXTREME, ids=[text[:50] for text, _ in EXTREME])
def test_what_no_study_can_hold_is_refused_with_what_is_allowed(
    tmp_path: Path, text: str, message: str
) -> None:
    said = refusal(written(tmp_path, text))
    assert re.search(message, said), said


@pytest.mark.parametrize(
    ("error", "works"),
    [
        *((error, True) for error in ("-0.8", ">100", "0", "6.1", "<0.001", ">+5", "+2.6")),
        *((error, False) for error in ("=1+1", "+1+1", "-1+1", "@SUM(A1)", "=cmd|'/C calc'!A0")),
        *((error, False) for error in ("a|b", "6.1\n", ">>100", "1" * 13, "", "nan", "-")),
    ],
)
def test_the_paper_s_errors_are_signed_numbers(tmp_path: Path, error: str, works: bool) -> None:
    """They are printed as they stand, in tables that spreadsheets open."""
    case = yaml.safe_load(f"{{{DROP}}}")
    case["published"] = {"table": 5, "identified": {}, "error_percent": {"k": error}}
    file = written(tmp_path, yaml.safe_dump({"cases": {"x": case}}))
    if works:
        assert load(file).cases["x"].published.error_percent["k"] == error
    else:
        said = refusal(file)
        assert "published.error_percent.k: found" in said
        assert "allowed is a number of at most 12 characters" in said


USABLE = {
    "byte order mark": "\ufeffseeds: 90",
    "hexadecimal": "seeds: 0x5a",
    "binary": "seeds: 0b1011010",
    "underscores": "seeds: 9_0",
    "text": "seeds: '9e1'",
    "exponent": "seeds: 9e1",
    "aliases": "seeds: &a 90\nbatch_size: *a",
    "merged": "seeds: 90\ngripper: {<<: {arm_length_m: 1e-3}, jaw_gap_m: 1e-4}",
    "JSON": '{"seeds": 90}',
    "empty document": "---\nseeds: 90\n...\n",
}


@pytest.mark.parametrize("name", USABLE)
def test_what_is_unusual_but_clear_works(tmp_path: Path, name: str) -> None:
    study = load(written(tmp_path, USABLE[name]))
    assert {case.seeds for case in study.cases.values()} == {90}


@pytest.mark.parametrize("name", ["calibration", "recorded", "robustness"])
def test_the_studies_laid_over_the_paper_s_load(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    assert load(ROOT / "config" / f"{name}.yaml").cases


def test_an_empty_config_changes_nothing(tmp_path: Path) -> None:
    assert load(written(tmp_path, "# nothing\n")).config.seeds == DEFAULTS["seeds"]


def test_two_thousand_cases_are_planned(tmp_path: Path) -> None:
    cases = "\n".join(f"  case_{i}: {{{DROP}}}" for i in range(2000 - 3))
    file = written(tmp_path, f"cases:\n{cases}\n")
    start = time.process_time()
    plan = Plan(load(file), tmp_path)
    rules = {rule.name: rule for rule in make_rules(products().values(), plan)}
    jobs = [{**job, "method": "genetic"} for job in rules["target"].jobs]
    names = ("target", "identification")
    digests = [tuple(rules[name].digest(job) for name in names) for job in jobs]
    assert len(digests) == 2000
    assert time.process_time() - start < 30


def test_more_cases_are_too_many(tmp_path: Path) -> None:
    cases = "\n".join(f"  case_{i}: {{{DROP}}}" for i in range(2001 - 3))
    with pytest.raises(BiogripError, match="cases: found 2001 keys, allowed are at most 2000"):
        load(written(tmp_path, f"cases:\n{cases}\n"))


def test_the_most_times_fit_into_a_parameter_of_a_job(tmp_path: Path) -> None:
    rng = random.Random(1)
    times = sorted(rng.uniform(1e-5, 9.9e-5) for _ in range(5000))
    case = {"sample": yaml.safe_load(DROP)["sample"], "measurement": {"times_s": times}}
    plan = Plan(load(written(tmp_path, yaml.safe_dump({"cases": {"x": case}}))), tmp_path)
    (target,) = make_rules([products()["target"]], plan)
    assert len(target.digest({"case": "x"})) + len(target.command({"case": "x"})) < 128


@pytest.mark.parametrize("name", ["a{b}.csv", "a<b>.csv", "{}.csv", "<results>/a.csv"])
def test_traces_whose_names_snakemake_would_fill_in(tmp_path: Path, name: str) -> None:
    trace = tmp_path / name
    trace.parent.mkdir(exist_ok=True)
    trace.write_text("time_s,rotation_rad\n")
    case = {
        "sample": {"model": "maxwell"},
        "measurement": {"file": str(trace), "time": "time_s", "rotation": "rotation_rad"},
    }
    file = written(tmp_path, yaml.safe_dump({"cases": {"x": case}}))
    said = refusal(file)
    assert "my.yaml, line " in said
    assert "cases.x.measurement.file: found" in said
    assert "allowed is a name without { } < >" in said
    merged = overlaid(DEFAULTS, read_config(file))
    assert load_study(merged, [DEFAULT, file], for_workflow=False).cases["x"].recorded


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("''", r"found '' of 0 characters, allowed are at least 1"),
        (".", r"found the folder '\.', allowed is a file"),
        ("/", r"found the folder '/', allowed is a file"),
        ("x" * 5000, r"found 'x+\.\.\. of 5000 characters, allowed are at most 4000"),
        ("x" * 300, r"found 'x+\.\.\.', allowed is a file that exists"),
        ("y/" * 2000, r"found '(y/)+\.\.\.', allowed is a file that exists"),
        ('"a\\0b"', r"found 'a\\x00b', allowed is a file that exists"),
        ('"a\\nb"', r"found 'a\\nb', allowed is a file that exists"),
    ],
)
def test_traces_that_are_no_files(tmp_path: Path, name: str, message: str) -> None:
    measurement = f"measurement: {{file: {name}, time: t, rotation: r}}"
    said = refusal(
        written(tmp_path, f"cases: {{x: {{sample: {{model: maxwell}}, {measurement}}}}}")
    )
    assert re.search(rf"line 1: cases.x.measurement.file: {message}", said), said


SWEEP = """
sweeps:
  s:
    cases: [{cases}]
    rows: {{label: a, key: measurement.noise.level, values: {rows}}}
    columns: {{label: b, key: {key}, values: {columns}}}
"""


@pytest.mark.parametrize(
    ("key", "columns", "message"),
    [
        (
            "measurement.rate_Hz",
            "[1e200]",
            r"values\[0\]: found 1e\+200, allowed is at least -1e\+12",
        ),
        (
            "measurement.rate_Hz",
            "[1e-11]",
            r"values\[0\]: gives measurement.rate_Hz: found 1e-11, all",
        ),
        (
            "measurement.noise.kind",
            "['" + "x" * 99 + "']",
            r"of 99 characters, allowed are at most 60",
        ),
        (
            "measurement.noise.kind",
            '["=1+1"]',
            r"gives measurement.noise.kind: found '=1\+1'. Allowed",
        ),
    ],
)
def test_sweeps_over_what_no_study_can_hold(
    tmp_path: Path, key: str, columns: str, message: str
) -> None:
    text = SWEEP.format(cases="liquid_drop_1", rows="[0.1]", key=key, columns=columns)
    said = refusal(written(tmp_path, text))
    assert re.search(message, said), said


def test_sweeps_have_no_more_points_than_a_study_cases(tmp_path: Path) -> None:
    cases = {f"c{i}": yaml.safe_load(f"{{{DROP}}}") for i in range(8)}
    values = [round(0.01 * (i + 1), 2) for i in range(16)]
    text = SWEEP.format(
        cases=", ".join(cases), rows=values, key="measurement.rate_Hz", columns=values
    )
    said = refusal(written(tmp_path, yaml.safe_dump({"cases": cases}) + text))
    assert "sweeps: found 2048 points, allowed are 2000 together" in said


PIECES = [
    *(
        "[",
        "]",
        "{",
        "}",
        ":",
        ": ",
        ", ",
        "- ",
        "\n",
        "\n  ",
        "\t",
        "&a ",
        "*a",
        "!!int ",
        "<<",
        "? ",
    ),
    *(
        "|",
        ">",
        "'",
        '"',
        "#",
        "%",
        "@",
        "`",
        "~",
        "---",
        "...",
        "null",
        "true",
        ".nan",
        ".inf",
        "1e309",
    ),
    *(
        "-1",
        "0",
        "1",
        "1e-3",
        "1:30",
        "010",
        "0x1f",
        "1_0",
        "9" * 99,
        "9" * 4400,
        "=",
        "2020-01-01",
    ),
    *("\0", "\x7f", "\ufeff", "\u2028", "\ud7ff", "é", "µ", "\U0001f600", "x" * 500, "[" * 60),
]


def _mutated(text: str, rng: random.Random) -> bytes:
    """A config with pieces put in, taken out, repeated and, at times, bytes changed."""
    for _ in range(rng.randint(1, 6)):
        start = rng.randrange(len(text) + 1)
        stop = min(len(text), start + rng.choice((0, 0, 1, 3, 20, 200)))
        text = text[:start] + rng.choice([*PIECES, text[start:stop] * 2, ""]) + text[stop:]
    content = bytearray(text.encode())
    for _ in range(rng.choice((0, 0, 0, 1, 3))):
        content[rng.randrange(len(content))] = rng.randrange(256)
    return bytes(content)


VALUES: tuple[object, ...] = (
    *(0, 1, -1, 2, 0.5, 1e-300, 1e300, -1e300, 10**60, float("nan"), float("inf"), 1e-9, 1e9, 100),
    *(True, None, "", "x", "1e5", "1e999", [], {}, [1, 2], {"a": 1}, "a\n", "a|b", "=1+1"),
)


def _replaced(config: object, rng: random.Random) -> object:
    """A config with some of its values replaced by others, and some keys renamed."""
    if isinstance(config, dict):
        return {
            (f"{key}\n" if rng.random() < 0.003 else key): _replaced(value, rng)
            for key, value in config.items()
        }
    if isinstance(config, list):
        return [_replaced(value, rng) for value in config]
    return rng.choice(VALUES) if rng.random() < 0.02 else config


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.nightly
def test_any_config_loads_or_is_refused_at_once(tmp_path: Path, seed: int) -> None:
    rng = random.Random(seed)
    overlays = [
        (file.read_text(), read_config(file)) for file in sorted((ROOT / "config").glob("*.yaml"))
    ]
    loaded = refused = 0
    for round_ in range(100):
        text, plain = rng.choice(overlays)
        if round_ % 2:
            content = _mutated(text, rng)
        else:
            replaced = _replaced(plain, rng)
            content = yaml.dump(replaced, Dumper=DUMPER, allow_unicode=True).encode()
        file = written(tmp_path, content)
        start = time.process_time()
        said = ""
        try:
            load(file)
            loaded += 1
        except BiogripError as error:
            said = str(error)
            refused += 1
        assert time.process_time() - start < LONGEST_S, content
        assert len(said) < 4000
        assert said.count("\n") <= 7
    assert loaded > 5
    assert refused > 20
