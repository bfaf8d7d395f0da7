"""What stands between force and modulus: tips, pipettes, cylinders, by simulations of their own."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from biogrip.arrays import Array
from biogrip.command.words import given_in_words, set_up_in_words
from biogrip.physics.instruments import INSTRUMENTS, KNOWN_SHAPES, under_shape
from biogrip.traces.columns import shape_and_sizes
from biogrip.traces.reader import recording_of_arrays
from tests.helpers.columns import columns_of
from tests.helpers.identified import by_quantity, identified, identify, write_trace

RADIUS_M = 2.5e-6
STIFF_PA, SOFT_PA, TIME_S = 1200.0, 800.0, 3.0
SPHERE = ("--shape", "sphere 2.5 um", "--no-compare")
APPROACH = ["--reading", "force=force_nN", "--load", "indentation_nm", *SPHERE]
APPROACH += ["--model", "zener_maxwell"]


def _approach(time_s: Array) -> Array:
    """Return the force of Hertz's hereditary integral, d(t) a ramp of half a second, then held."""
    forces = []
    for now in time_s:
        s = np.linspace(0, min(max(now, 0), 0.5), 2001)
        rate = 1.5 * (5e-7 / 0.5) ** 1.5 * np.sqrt(s)
        modulus = SOFT_PA + STIFF_PA * np.exp(-(now - s) / TIME_S)
        forces.append(16 / 9 * np.sqrt(RADIUS_M) * np.trapezoid(modulus * rate, s))
    return np.array(forces)


@pytest.fixture(scope="module")
def afm(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Write an approach that begins before the contact, a dwell, and the way back."""
    time_s = np.r_[np.arange(-0.2, 0.5, 0.02), np.arange(0.5, 30, 0.1)]
    force = _approach(time_s)
    force += np.random.default_rng(5).normal(0, 0.004 * force.max(), len(time_s))
    depth = np.minimum(time_s / 0.5, 1) * 5e-7
    back = 29.95 + np.arange(1, 10) * 0.05
    time_s, force = np.r_[time_s, back], np.r_[force, np.linspace(force[-1], 0, 9)]
    depth = np.r_[depth, np.linspace(5e-7, 0, 10)[1:]]
    path, header = tmp_path_factory.mktemp("afm") / "afm.csv", "time_s,force_nN,indentation_nm"
    return write_trace(path, time_s, 1e9 * force, 1e9 * depth, header=header)


def test_an_approach_and_its_dwell_tell_the_modulus_of_young(afm: Path) -> None:
    found = identified(afm.parent, afm, *APPROACH, "--until", "29.9", "--start", "0")
    limits = by_quantity(found)
    for name, true in (("k", STIFF_PA), ("k_p", SOFT_PA), ("tau", TIME_S)):
        # Limits of this noise are 0.2 to 1 % wide.
        assert limits[name]["value"] == pytest.approx(true, rel=0.015), name
        assert limits[name]["high"] < 1.02 * limits[name]["low"], name
    assert (found["fit"], found["models"]) == ("ok", [])
    assert any("by the shape: sphere 2.5 um (Hertz 1882)" in said for said in given_in_words(found))
    assert any("with Poisson's ratio 0.5" in said for said in set_up_in_words(found))
    assert "0 to 500 nm" in found["load"]


def test_a_tip_that_is_drawn_back_is_noted(afm: Path) -> None:
    _, said, _ = identify(afm, *APPROACH)
    assert "The contact shrinks from 30 s on" in said
    assert "--until 29.9.\n" in said


def test_a_force_that_is_held_tells_compliances(tmp_path: Path) -> None:
    """d^1.5 = 9 F J(t)/(16 sqrt(R)), J of 500 Pa before a Kelvin element of 400 Pa and 2 s."""
    time_s = np.arange(0.1, 20, 0.1)
    compliance = 1 / 500 + (1 - np.exp(-time_s / 2)) / 400
    depth = (9 * 1e-9 * compliance / (16 * np.sqrt(RADIUS_M))) ** (2 / 3)
    depth += np.random.default_rng(6).normal(0, 0.002 * depth.max(), len(time_s))
    trace = write_trace(tmp_path / "held.csv", time_s, 1e6 * depth, header="time_s,depth_um")
    given = ("--reading", "displacement=depth_um", "--hold", "1 nN", *SPHERE)
    limits = by_quantity(identified(tmp_path, trace, *given, "--model", "zener_kelvin", config=""))
    for name, true in (("k_s", 500), ("k_v", 400), ("tau_v", 2)):
        assert limits[name]["low"] < true < limits[name]["high"], name


def test_a_number_counts_by_its_power_and_back() -> None:
    sphere = KNOWN_SHAPES["sphere"]
    depth = under_shape(INSTRUMENTS["strain"], sphere, [2e-6], 0.5).read
    assert depth.in_si(np.array([8.0, -8.0, 0.0]), "um").tolist() == [8.0, -8.0, 0.0]
    assert depth.in_unit(np.array([8.0, 0.0]), "um") == pytest.approx([8.0, 0.0])
    # 1.5 sqrt(d/R) for each radius.
    assert depth.slope(4.0) == 3.0
    # A column of half micrometres: 16 of them are 4 radii of 2 um, and one is 0.25.
    columns = columns_of("time_s", "d_um", "strain", sd="sd", scale=0.5, shape="sphere 2 um")
    number, sd = np.full(9, 16.0), np.full(9, 0.1)
    found = recording_of_arrays(columns, np.arange(9.0), number, sd)
    assert found.readings == pytest.approx(8.0)
    assert found.sd == pytest.approx(0.1 * 0.25 * 3.0)


# Force over modulus in N/Pa by a calculator, 0.5 um deep, with Poisson's ratios 0.5 and 0.3.
FORCES = {
    "sphere 2.5 um": (9.93808e-13, 8.19073e-13),
    "cone 35 deg": (1.485887e-13, 1.224632e-13),
    "pyramid 17.5 deg": (7.833073e-14, 6.455829e-14),
    "punch 2 um": (2.66667e-12, 2.19780e-12),
}


@pytest.mark.parametrize("text", FORCES)
def test_a_tip_has_its_force_and_its_depth(text: str) -> None:
    """1 Pa of stress and 1 of strain are 1 Pa of modulus, whatever the unit of length."""
    for poisson, force in zip((0.5, 0.3), FORCES[text], strict=True):
        made = under_shape(INSTRUMENTS["stress"], *shape_and_sizes(text), poisson)
        modulus = made.read.in_si(force, "N") / made.controlled.in_si(0.5, "um")
        assert modulus == pytest.approx(1.0, rel=1e-5)


def test_a_pipette_and_a_cylinder_have_no_ratio_of_poisson() -> None:
    """400 Pa on 3 um and 500 Pa: L = 3 * 2.1 R p/(2 pi E); 2 N on 50.27 mm2, 10 % of 4 mm."""
    pipette = under_shape(INSTRUMENTS["strain"], *shape_and_sizes("pipette 3 um"), 0.3)
    length_um = 3 * 2.1 * 3.0 * 400 / (2 * np.pi * 500)
    ratio = pipette.controlled.in_si(400, "Pa") / pipette.read.in_si(length_um, "um")
    assert ratio == pytest.approx(500)
    cylinder = under_shape(INSTRUMENTS["stress"], *shape_and_sizes("cylinder 8mm x 4mm"), 0.3)
    ratio = cylinder.read.in_si(2.0, "N") / cylinder.controlled.in_si(0.4, "mm")
    assert ratio == pytest.approx(2.0 / 50.2654825e-6 / 0.1)


TIPS = {"cone 35 deg": (2, 0.4457660), "pyramid 17.5deg": (2, 0.2349922), "punch 2 um": (1, 4e-6)}


@pytest.mark.parametrize(
    "text",
    [pytest.param(tip, marks=pytest.mark.nightly) if tip[:2] != "pu" else tip for tip in TIPS],
)
def test_a_ramp_and_a_dwell_of_other_tips_tell_the_modulus(tmp_path: Path, text: str) -> None:
    """F = 4/3 C int E(t - s) d(d^n)/ds ds, d(t) a ramp of half a second to 0.5 um, then held."""
    power, size = TIPS[text]
    time_s = np.r_[np.arange(-0.1, 0.5, 0.02), np.arange(0.5, 20, 0.1)]
    forces = []
    for now in time_s:
        s = np.linspace(0, min(max(now, 0), 0.5), 4001)
        rate = power * (5e-7 / 0.5) ** power * s ** (power - 1)
        modulus = SOFT_PA + STIFF_PA * np.exp(-(now - s) / TIME_S)
        forces.append(4 / 3 * size * np.trapezoid(modulus * rate, s))
    force = np.array(forces)
    force += np.random.default_rng(7).normal(0, 0.004 * force.max(), len(time_s))
    depth = np.clip(time_s / 0.5, 0, 1) * 5e-7
    columns = time_s, 1e9 * force, -1e9 * depth
    trace = write_trace(tmp_path / "tip.csv", *columns, header="time_s,force_nN,separation_nm")
    given = ["--reading", "force=force_nN", "--load", "separation_nm", "--shape", text]
    given += ["--model", "sls", "--no-compare", "--start", "0"]
    _, _, message = identify(trace, *given)
    assert "turn it by --set measurement.load_scale=-1." in message
    # So turned, depths of its negative are heights without a zero.
    write_trace(
        trace, time_s, 1e9 * force, 1e9 * depth + 100, header="time_s,force_nN,separation_nm"
    )
    _, _, message = identify(trace, *given, "--set", "measurement.load_scale=-1")
    assert "its zero is where the tip touches" in message
    write_trace(trace, *columns, header="time_s,force_nN,separation_nm")
    turned = identified(tmp_path, trace, *given, "--set", "measurement.load_scale=-1", config="")
    for name, true in (("k", STIFF_PA), ("k_p", SOFT_PA), ("tau", TIME_S)):
        assert by_quantity(turned)[name]["value"] == pytest.approx(true, rel=0.015), name


def test_a_sheet_has_a_pipette_for_each_cell(tmp_path: Path) -> None:
    time_s = np.arange(0.25, 60, 0.25)
    rng, rows = np.random.default_rng(8), ["file,hold,shape,dish"]
    for number, radius_um in enumerate((2.0, 3.0)):
        compliance = 1 / 500 + (1 - np.exp(-time_s / 5)) / 400
        length_um = 3 * 2.1 * radius_um * 300 / (2 * np.pi) * compliance
        length_um *= rng.normal(1, 0.005, len(time_s))
        write_trace(tmp_path / f"{number}.csv", time_s, length_um, header="time_s,L_um")
        rows.append(f"{number}.csv,300 Pa,pipette {radius_um:g} um,a")
    sheet, table = tmp_path / "cells.csv", tmp_path / "found.csv"
    sheet.write_text("\n".join(rows))
    given = ("--reading", "displacement=L_um", "--model", "zener_kelvin", "--no-compare")
    status, _, message = identify(sheet, *given, "--csv", table)
    assert status == 0, message
    found = pd.read_csv(table)
    assert found["k_s value (Pa)"].tolist() == pytest.approx([500, 500], rel=0.02)
    assert found["k_v value (Pa)"].tolist() == pytest.approx([400, 400], rel=0.02)


def test_what_no_shape_is_told_by_is_refused(afm: Path) -> None:
    for shape, given, said in (
        ("sphere 2.5", "", "found 'sphere 2.5', allowed is as in 'sphere 2.5 um'."),
        *((f"sphere {size}", "", "allowed is as in 'sphere 2.5 um'") for size in ("2Pa", "0um")),
        ("cone 95 deg", "", "allowed is as in 'cone 35 deg'"),
        ("cylinder 8 mm", "", "allowed is as in 'cylinder 8 mm x 4 mm'"),
        ("2.5 um", "", "allowed are, as examples, 'sphere 2.5 um', 'cone 35 deg', 'pyramid"),
        ("sphere 2um", "--hold 500", "--hold: found no unit, allowed are m, cm, mm, um"),
        ("sphere 2um", "--hold 1nN", "the unit 'nN' of a"),
        ("sphere 2um", "--reading modulus=x", "goes with a force or a displacement, not with mod"),
        ("sphere 2um", "--reading strain=x", "a shape and a reading of strain; allowed are force"),
        ("pipette 2um", "--reading strain=x", "allowed are stress and displacement, as by"),
        (
            *("pipette 2um", "--reading displacement=x --set measurement.poisson=0.3"),
            "goes with the shape of a tip, not with 'pipette 2um'",
        ),
        ("pipette 2um", "", "goes with a pressure or a displacement, not with force"),
        ("sphere 2um", "--set measurement.load_scale=-1", "goes with load; give both"),
    ):
        reading = () if "--reading" in given else ("--reading", "force=force_nN")
        held = () if "--hold" in given else ("--hold", "1 Pa" if "pipette" in shape else "1 nm")
        status, _, message = identify(afm, *reading, *held, "--shape", shape, *given.split())
        assert (status, said in message) == (1, True), message
    with pytest.raises(SystemExit):
        identify(afm, "--reading", "force=force_nN", "--sphere", "2.5 um")
