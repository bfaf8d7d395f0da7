"""Hints of the program, typed as it prints them: each has to help.

Every sentence of the source that has an option stands in `KINDS`: typed by a case here or by
another test, or it names what only its reader knows, or refuses options that do not go together.
"""

import ast
import re
import shlex
from pathlib import Path

import numpy as np
import pytest

from biogrip.arrays import Array
from tests.helpers.identified import by_quantity, identified, identify, write_trace
from tests.helpers.places import ROOT

# An option with what it takes, as a message has it.
OPTION = re.compile(r"(--[a-z-]+ (?:'[^']*'|[^\s']+?))(?=[.,;)]?(?:\s|$))")
TIME_S: Array = np.arange(0.5, 30, 0.25)
STRAIN = 5 / 500 + 5 / 400 * (1 - np.exp(-TIME_S / 5))
CREEP = ["--hold", "5 Pa", "--model", "zener_kelvin", "--no-compare"]


def noisy(values: Array, seed: int = 1) -> Array:
    return values * (1 + 0.003 * np.random.default_rng(seed).standard_normal(len(values)))


def blocks(path: Path) -> list[str]:
    """Two blocks, of which the second goes on."""
    rows = [f"{t},{x}" for t, x in zip(TIME_S, noisy(STRAIN), strict=True)]
    path.write_text("\n".join(["time_s,strain", *rows[:60], "time_s,strain", *rows[60:]]))
    return ["--reading", "strain=strain", *CREEP]


def samples(path: Path) -> list[str]:
    """Two samples below each other."""
    path.write_text(
        "\n".join(
            [
                "time_s,cell,strain",
                *(f"{t},A,{x}" for t, x in zip(TIME_S, noisy(STRAIN), strict=True)),
                *(f"{t},B,{3 * x}" for t, x in zip(TIME_S, noisy(STRAIN, 2), strict=True)),
            ]
        )
    )
    return ["--reading", "strain=strain", *CREEP]


def repeats(path: Path) -> list[str]:
    """A clock that is rounded to whole seconds, of a sample that is at rest, and then creeps."""
    times = np.repeat(TIME_S, 2)
    values = np.repeat(STRAIN, 2) * np.random.default_rng(1).normal(1, 0.003, len(times))
    write_trace(path, times, values, header="time_s,strain")
    return ["--reading", "strain=strain", *CREEP]


def turned(path: Path) -> list[str]:
    write_trace(path, TIME_S, -noisy(STRAIN), header="time_s,strain")
    return ["--reading", "strain=strain", *CREEP]


def another_quantity(path: Path) -> list[str]:
    write_trace(path, TIME_S, 100 * noisy(STRAIN), header="time_s,Strain (%)")
    return ["--reading", "Strain (%)", "--model", "zener_kelvin", "--no-compare"]


def separation(path: Path) -> list[str]:
    """Of a punch, which is negative in contact: 2 R E/(1 - nu^2) d of 500 nm, 400 and 500 Pa."""
    time_s = np.r_[np.arange(-2, 0, 0.1), TIME_S]
    depth = np.where(time_s > 0, 500.0, np.minimum(500 * time_s, 0))
    relaxed = 400 + 500 * np.exp(-time_s / 5)
    force_nN = np.where(time_s > 0, noisy(2 * 2e-6 / 0.75 * relaxed * 5e-7 * 1e9), 0.0)
    write_trace(path, time_s, force_nN, -depth, header="time_s,F_nN,d_nm")
    given = ["--reading", "force=F_nN", "--load", "d_nm", "--shape", "punch 2 um", "--start", "0"]
    return [*given, "--model", "zener_maxwell", "--no-compare"]


HINTS = {
    blocks: (["--block 1", "--block 1,2"], "k_s", 500),
    samples: (["--rows cell=A"], "k_s", 500),
    repeats: (["--set measurement.average_repeated=true"], "k_s", 500),
    turned: (["--set measurement.scale=-1"], "k_s", 500),
    another_quantity: (["--reading 'strain=Strain (%)'"], "k_s", 500),
    separation: (["--set measurement.load_scale=-1"], "k_p", 400),
}


@pytest.mark.parametrize("make", HINTS, ids=lambda make: make.__name__)
def test_a_hint_helps(tmp_path: Path, make: object) -> None:
    hints, name, true = HINTS[make]  # type: ignore[index]
    path = tmp_path / "t.csv"
    given = make(path)  # type: ignore[operator]
    status, _, message = identify(path, *given)
    assert status == 1
    printed = [hint.rstrip(".,;)") for hint in OPTION.findall(message)]
    assert [hint for hint in hints if hint in printed] == hints, message
    typed = shlex.split(hints[-1])
    held = ["--hold", "5 Pa"] if make is another_quantity else []
    found = by_quantity(identified(tmp_path, path, *given, *held, *typed, config=""))
    assert found[name]["value"] == pytest.approx(true, rel=0.03)


def steady(values: Array) -> Array:
    """With noise that does not grow."""
    return values + 0.003 * np.max(values) * np.random.default_rng(1).standard_normal(len(values))


RELAXATION = ["--model", "zener_maxwell", "--no-compare"]


def rise(path: Path) -> list[str]:
    """A modulus whose strain rises within 3 s: the hereditary integral over the strain."""
    time_s = np.arange(0.0, 30, 0.25)
    inside_s = np.minimum(time_s, 3.0)
    spring = 5 * (np.exp(-(time_s - inside_s) / 5) - np.exp(-time_s / 5)) / 3
    strain, stress = 0.02 * inside_s / 3, steady(0.02 * (400 * inside_s / 3 + 500 * spring))
    columns = time_s, stress, strain, stress / np.maximum(strain, 1e-9)
    write_trace(path, *columns, header="time_s,stress_Pa,strain,modulus_Pa")
    return ["--reading", "modulus=modulus_Pa", "--from", "3.1", *RELAXATION]


def unit_of_hold(path: Path) -> list[str]:
    """A displacement in um under 5 uN."""
    write_trace(path, TIME_S, steady(STRAIN) * 1e6, header="time_s,x_um")
    return ["--reading", "displacement=x_um", "--hold", "5", *CREEP[2:]]


def grows(path: Path) -> list[str]:
    """Noise of 5 % of a relaxation by a factor of ten."""
    readings = (40 + 500 * np.exp(-TIME_S / 5)) * (1 + 16 * (noisy(0 * TIME_S + 1) - 1))
    write_trace(path, TIME_S, readings, header="time_s,modulus_Pa")
    return ["--reading", "modulus", *RELAXATION, "--start", "0"]


def other_model(path: Path) -> list[str]:
    write_trace(path, TIME_S, steady(STRAIN), header="time_s,strain")
    return ["--reading", "strain", "--hold", "5 Pa", "--model", "kelvin_voigt"]


def other_zero(path: Path) -> list[str]:
    """Two steps, which tell a zero from a sample; the first comes with the first row."""
    time_s = np.arange(0.0, 30, 0.25)
    load = np.where(time_s < 15.125, 5.0, 2.0)
    compliance = [
        1 / 500 - np.expm1(-np.maximum(t, 0) / 5) / 400 for t in (time_s, time_s - 15.125)
    ]
    strain = 5 * compliance[0] - 3 * compliance[1] * (time_s >= 15.125)
    write_trace(path, time_s, steady(strain) + 2e-3, load, header="time_s,strain,load_Pa")
    return ["--reading", "strain", "--load", "load_Pa", *CREEP[2:]]


def slow_noise(path: Path) -> list[str]:
    """Noise that is correlated over five readings."""
    white = np.random.default_rng(3).standard_normal(len(TIME_S))
    slow = np.convolve(white, np.exp(-np.arange(40) / 5), "full")[: len(TIME_S)]
    write_trace(path, TIME_S, STRAIN + 2e-5 * slow, header="time_s,strain")
    return ["--reading", "strain", *CREEP]


def drawn_back(path: Path) -> list[str]:
    """A punch is as large as its contact; a sphere that is drawn back after 20 s is not."""
    depth = np.clip(500.0 - 400 * (TIME_S - 20), 0.0, 500.0)
    relaxed = 400 + 500 * np.exp(-(TIME_S - TIME_S[0]) / 5)
    force_nN = steady(16 / 9 * np.sqrt(2e-6) * relaxed * 5e-7**1.5 * 1e9)
    force_nN *= (depth / 500) ** 2
    write_trace(path, TIME_S, force_nN, depth, header="time_s,F_nN,d_nm")
    given = ["--reading", "force=F_nN", "--load", "d_nm", "--shape", "sphere 2 um"]
    return [*given, *RELAXATION, "--start", "0"]


# The hint, what a pattern takes of it, what is true, and what the first fit is not.
ADVICE = {
    rise: (r"read (stress) with --load (strain)\.", "k", 500),
    unit_of_hold: (r'as in --hold "(5 uN)"', "k_s", 500e-6),
    grows: (r"Readings are weighted by (--noise-share [\d.]+)\.", "k_p", 40),
    other_model: (r"\((--model zener_maxwell)\)", "k_p", 2000 / 9),
    other_zero: (r"identify the trace with (--offset)\.", "k_s", 500),
    slow_noise: (r"or (--noise-model coloured), gives", "k_s", 500),
    drawn_back: (r"Leave these readings out: (--until \d+\.?\d*)\.", "k_p", 400),
}


@pytest.mark.parametrize(
    "make",
    [pytest.param(it, marks=[pytest.mark.nightly] * (it is not rise)) for it in ADVICE],
    ids=lambda make: make.__name__,
)
def test_advice_beside_a_result_helps(tmp_path: Path, make: object) -> None:
    """It is typed, the truth is within 5 %, and it is not given again."""
    pattern, name, true = ADVICE[make]  # type: ignore[index]
    path = tmp_path / "t.csv"
    given = make(path)  # type: ignore[operator]
    status, said, message = identify(path, *given, "--output", tmp_path / "first.json")
    assert status == 0, message
    found = re.search(pattern, said)
    assert found, said
    typed = shlex.split(" ".join(found.groups()))
    if make is rise:
        given, typed = RELAXATION, ["--reading", f"{typed[0]}=stress_Pa", "--load", typed[1]]
    elif make is unit_of_hold:
        typed = ["--hold", *found.groups()]
    after = identified(tmp_path, path, *given, *typed, config="")
    assert by_quantity(after)[name]["value"] == pytest.approx(true, rel=0.05)
    again = [note["text"] for note in after["notes"] if re.search(pattern, note["text"])]
    assert not again
    assert after["fit"] == "ok", after["reasons"]


KINDS = {
    "typed here": (
        *(
            " Add to each what was zeroed, or identify",
            "is one, as by --block 1,",
            "--rows ",
            "--set measurement.",
            "--reading ",
            "--reading",
        ),
        *(", as --reading ", ", as by --reading ", " Which quantity is it? Say so, as by --read"),
        " with --load ",
        *(': say its unit, as in --hold "', " Readings are weighted by --noise-share "),
        *(" (--model ", " --offset", " --drift", "If the set-up is right, measurement.noise_model"),
        " s on: what is said holds while it grows or stays. Leave these readings out: --until ",
    ),
    "typed by tests of onsets, contacts and damaged results": (
        *(
            " times as wide. If it was moved before, leave",
            " s after the step of the protocol, as if",
        ),
        " tells the zero and the approach: read it, too, with --load",
        " s, as if nothing was held from there on: --until ",
        *("--start says when", "). If it does, say --start fit", "say --contact fit"),
        "It is damaged: the same command with",
    ),
    "names an option whose value only its reader knows": (
        *(" rad, or less with a given noise (--noise) ", ", or it is below the noise: say how"),
        *("what is before or after (--from, --until)", "; allowed with a model, as by --model"),
        *("A ramp is given by --ramp DURATION", " % at the highest: correct for it, or leave"),
        " A length is a strain by a scale or",
        *(" A pressure sucks into a pipette", "that reading (--from)"),
        *(" Or say what is read, as by --reading ", "--reading loss=COLUMN, or in a table"),
        *(
            "; give yours with --config.",
            "; allowed with a model, as by --model",
            " that was held, a column of it by --load, or a pro",
        ),
        *(" s. Is the unit of time right?", " units. If these are what was repeated, cells"),
    ),
    "refuses": (
        *("--output", "--report", "--csv", "--plot", "--unit: found", ": goes with --hold"),
        *(" For several there is --report", "takes the shape of a tip"),
        "'; allowed is a table that `biogrip identify --csv` wrote",
        *("snakemake -j2 --configfile ", "--hold", "--ramp"),
    ),
}


def test_every_hint_of_the_source_is_of_a_kind() -> None:
    """A sentence with an option that is new has to be typed by a case, or be told as no hint."""
    folder, known = ROOT / "src" / "biogrip", [kind for of in KINDS.values() for kind in of]
    unknown, seen = [], set()
    for path in sorted(folder.rglob("*.py")):
        if path.name in ("options.py", "cli.py", "library.py") or path.parent.name == "app":
            # Options themselves, their help, and how a notebook or the window says them.
            continue
        tree = ast.parse(path.read_text())
        documents = [
            ast.get_docstring(node, clean=False)
            for node in ast.walk(tree)
            if isinstance(node, ast.AsyncFunctionDef | ast.FunctionDef | ast.ClassDef | ast.Module)
        ]
        for node in ast.walk(tree):
            text = getattr(node, "value", None)
            if not isinstance(node, ast.Constant) or not isinstance(text, str):
                continue
            if text not in documents and re.search(r"(?<![\w-])--[a-z]", text):
                found = [kind for kind in known if text.startswith(kind)]
                seen |= {*found}
                unknown += [] if found else [f"{path.name}, line {node.lineno}: {text}"]
    assert not unknown
    assert {*known} == seen


def test_models_have_the_names_that_people_type(tmp_path: Path) -> None:
    """A damper before a Kelvin-Voigt solid is a Burgers fluid without its spring."""
    strain = 5 * (TIME_S / 4000 + (1 - np.exp(-TIME_S / 5)) / 400)
    path = write_trace(tmp_path / "t.csv", TIME_S, noisy(strain), header="time_s,strain")
    given = ["--reading", "strain=strain", "--hold", "5 Pa", "--no-compare", "--model"]
    found = by_quantity(identified(tmp_path, path, *given, "jeffreys", config=""))
    for name, true in (("c_s", 4000), ("k_v", 400), ("tau_v", 5)):
        assert found[name]["value"] == pytest.approx(true, rel=0.05), name
    _, _, message = identify(path, *given, "slss")
    assert "found 'slss'. Did you mean 'sls' or " in message
    assert len(message) < 150
