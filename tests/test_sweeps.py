"""Frequency sweeps from files to verdicts: moduli, columns and units, limits, and what is refused.

Samples are written down here, or in `tests.helpers.laplace`, as impedances.
"""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from biogrip.arrays import Array
from biogrip.cli import _parser
from biogrip.command.settings import Asked, read_trace
from biogrip.command.words import set_up_in_words
from biogrip.errors import BiogripError
from biogrip.fit.share_noise import estimate_swept_noise
from biogrip.fit.trace_noise import PairWhitening
from biogrip.judging.whiteness import find_inertia
from biogrip.library import INSTRUMENTS, Sample, hold, set_up, simulate
from biogrip.physics.models import MODELS
from biogrip.physics.noise import moduli_of, places_of
from biogrip.physics.protocol import joined
from tests.helpers.default import seen
from tests.helpers.identified import by_quantity, identified, identify, told, write_trace
from tests.helpers.laplace import IMPEDANCES
from tests.helpers.places import ROOT

OMEGA: Array = np.geomspace(0.1, 100.0, 25)
SOLID = {"k": 3000.0, "k_p": 500.0, "c": 2000.0}
GIVEN = {"reads": "storage", "model": "zener_maxwell"}


def moduli(model: str, omega: Array, *parameters: float) -> Array:
    whole = np.asarray(IMPEDANCES[model](1j * omega, *parameters))
    return np.stack((whole.real, whole.imag))


def noisy(clean: Array, share: float = 0.02, seed: int = 0) -> Array:
    return clean * (1 + share * np.random.default_rng(seed).standard_normal(clean.shape))


def swept(values: Array, omega: Array = OMEGA, **given: Any) -> Any:
    return told(omega, values[0], loss=values[1], **(GIVEN | given))


def solid(**given: Any) -> Array:
    return noisy(moduli("zener_maxwell", OMEGA, *(SOLID | given).values()), seed=1)


@pytest.mark.parametrize("name", MODELS)
def test_every_model_has_the_moduli_of_its_impedance_and_their_slopes(name: str) -> None:
    """A springpot is a ladder to 1e-6 (`biogrip.physics.fractional`)."""
    model = MODELS[name]
    experiment = set_up(INSTRUMENTS["storage"], (hold(1.0, 1.0),), Sample(name, stiffness="Pa"))
    values = dict(zip(model.names, model.example, strict=True))
    places = np.append(-OMEGA[::-1], OMEGA)
    loss, storage = np.split(simulate(experiment, values, places), 2)
    expected = moduli(name, OMEGA, *model.example)
    size = np.abs(expected[0] + 1j * expected[1])
    assert np.max(np.abs([storage, loss[::-1]] - expected) / size) < 2e-6
    residuals = experiment.of(places, np.append(loss, storage)).residuals
    x, step = np.log(model.example), 1e-5
    for index, slope in enumerate(residuals(x)[1]):
        ahead, behind = (residuals.response(x + s * step * np.eye(len(x))[index]) for s in (1, -1))
        # Central differences of step h err by h^2, and by rounding over h.
        assert np.max(np.abs((ahead - behind) / (2 * step) - slope)) < 1e-7 * size.max()


def test_a_loss_modulus_alone_tells_what_relaxes(tmp_path: Path) -> None:
    """Of a Zener solid with 3 % noise: limits of 95 %, of all but the spring that does not relax.

    That 20 sweeps have 16 or fewer within them is a chance of 3 in 1000; seeds are the first.
    """
    clean, within = moduli("zener_maxwell", OMEGA, *SOLID.values())[1], dict.fromkeys("kc", 0)
    for seed in range(20):
        found = told(OMEGA, noisy(clean, 0.03, seed), reads="loss", model="sls").to_frame()
        for name in within:
            within[name] += found.loc[name, "low"] <= SOLID[name] <= found.loc[name, "high"]
        assert found.loc["k_p", "verdict"] == "not determined"
    assert min(within.values()) > 16
    rows = OMEGA[::-1], noisy(clean, 0.03)[::-1], np.full(25, 2.0)
    path = write_trace(tmp_path / "t.csv", *rows, header="w in rad/s,lost in Pa,sd")
    given = ["--frequency", "w in rad/s", "--reading", "loss=lost in Pa"]
    code, _, message = identify(path, *given)
    assert (code, "--model zener_maxwell" in message) == (1, True)
    figure = tmp_path / "t.png"
    given += ["--model", "zener_maxwell", "--sd", "sd", "--plot", str(figure)]
    data = identified(tmp_path, path, *given, config="")
    assert figure.exists()
    assert "without storage moduli" in set_up_in_words(data)[0]
    assert by_quantity(data)["k"]["value"] == pytest.approx(3000, rel=0.03)
    for more in ("phase_sd_rad=0.1", "loss_sd=sd"):
        _, _, message = identify(path, *given, "--set", f"measurement.{more}")
        assert "only the loss modulus is read" in message


def test_a_table_of_traces_names_both_moduli_by_keys(tmp_path: Path) -> None:
    write_trace(tmp_path / "sweep.csv", OMEGA, *solid(), header="w in rad/s,S in Pa,L in Pa")
    sheet, first = tmp_path / "sheet.csv", "sweep.csv,w in rad/s,S in Pa,L in Pa"
    sheet.write_text(f"file,frequency,measurement.storage,loss\n{first}\n")
    _, _, message = identify(sheet, "--model", "sls")
    key = message.split()[-1].rstrip(".")
    sheet.write_text(f"file,frequency,measurement.storage,{key}\n{first}\n")
    code, _, _ = identify(sheet, "--model", "sls", "--no-compare")
    assert (code, key) == (0, "measurement.loss")


def measured(sweep: str) -> Array:
    """Frequencies, storage and loss moduli, by row."""
    return np.loadtxt(Path(__file__).parent / "sweeps" / f"{sweep}.csv", delimiter=",").T


def from_file(folder: Path, omega: Array, values: Array, sd: Array, model: str) -> dict[str, Any]:
    """What is found, by quantity, in moduli that have standard deviations."""
    header = "w in rad/s,stored in Pa,lost in Pa,a in Pa,b in Pa"
    trace = write_trace(folder / "sweep.csv", omega, *values, *sd, header=header)
    options = ["--frequency", "w in rad/s", "--reading", "storage=stored in Pa", "--model", model]
    options += ["--reading", "loss=lost in Pa", "--sd", "a in Pa"]
    return by_quantity(identified(folder, trace, *options, "--set", "measurement.loss_sd=b in Pa"))


def of_zener() -> Array:
    """Those that RheoJAX's notebook on Zener's model simulates (github.com/imewei/rheojax)."""
    omega, rng = np.logspace(-2, 3, 40), np.random.RandomState(42)
    clean = moduli("zener_maxwell", omega, 5e4, 1e4, 1e3)
    return np.stack((omega, *(part + rng.normal(0, 0.015 * part) for part in clean)))


@pytest.mark.parametrize(
    ("sweep", "model", "published", "least"),
    [
        (
            measured("chia"),
            "springpots_in_parallel",
            (5.058804241414604, 0.7952219412109002, 65.25716756871952, 0.1278221383939005),
            0.32976417668768987,
        ),
        (of_zener(), "zener_maxwell", (49888, 9968, 998.79), 2 * 8.197498e-3),
    ],
    ids=["pyRheo", "RheoJAX"],
)
def test_a_published_fit_has_its_misfit_and_lies_within_limits_about_a_lower_one(
    tmp_path: Path, sweep: Array, model: str, published: tuple[float, ...], least: float
) -> None:
    """Standard deviations are a share of each modulus as it was read, as in these programs."""
    omega, *values = sweep

    def square_sum(*parameters: float) -> float:
        return float(np.sum((moduli(model, omega, *parameters) / values - 1) ** 2))

    assert square_sum(*published) == pytest.approx(least, rel=1e-6)
    sd = np.sqrt(least / (2 * len(omega))) * np.array(values)
    found = from_file(tmp_path, omega, np.array(values), sd, model)
    names = MODELS[model].names
    # A share of each reading is taken as one of the smooth course, whose optimum is near theirs.
    assert square_sum(*(found[name]["value"] for name in names)) < least * (1 + 2e-3)
    for name, value in zip(names, published, strict=True):
        assert found[name]["low"] < value < found[name]["high"]


@pytest.mark.nightly
def test_the_fit_that_rheos_publishes_has_its_misfit_and_lies_within_the_limits() -> None:
    """That is of logarithms, ours of relative deviations."""
    sweep, published = measured("rheos"), (0.00921903, 0.770062, 0.913296, 0.100392)
    omega, values = sweep[0], sweep[1:]
    logs = np.log(moduli("springpots_in_parallel", omega, *published) / values)
    assert np.sum(logs**2) == pytest.approx(0.34215629, rel=2e-5)
    found = swept(values, omega, model="springpots_in_parallel", noise_share=0.14).to_frame()
    for name, value in zip(MODELS["springpots_in_parallel"].names, published, strict=True):
        assert found.loc[name, "low"] < value
        assert not found.loc[name, "high"] < value


FILES: dict[str, tuple[str, str, Any, list[str]]] = {
    "Anton Paar, from high to low frequencies": (
        "Projekt:;Zellen\n\nIntervall-Daten:;Punktnr.;Kreisfrequenz;Speichermodul;Verlustmodul\n"
        ";;;;\n;;[1/s];[kPa];[kPa]",
        ";",
        lambda w, *moduli: (w, w[::-1], *(it[::-1] / 1e3 for it in moduli)),
        ["Kreisfrequenz", "storage=Speichermodul", "loss=Verlustmodul"],
    ),
    "size and phase": (
        "f (Hz),|G*| (Pa),phase (deg)",
        ",",
        lambda w, a, b: (w / (2 * np.pi), np.hypot(a, b), np.degrees(np.arctan2(b, a))),
        ["f (Hz)", "complex_modulus=|G*| (Pa)", "phase=phase (deg)"],
    ),
    "size and loss modulus": (
        "Filename\tgel.tri\n\n[step]\nw\t|G*|\tLoss modulus\nrad/s\tPa\tkPa",
        "\t",
        lambda w, a, b: (w, np.hypot(a, b), b / 1e3),
        ["w", "complex_modulus=|G*|", "loss=Loss modulus"],
    ),
    "complex viscosity and phase": (
        "w (rad/s);eta* (mPa.s);delta (deg)",
        ";",
        lambda w, a, b: (w, 1e3 * np.hypot(a, b) / w, np.degrees(np.arctan2(b, a))),
        ["w (rad/s)", "complex_viscosity=eta* (mPa.s)", "phase=delta (deg)"],
    ),
    "complex viscosity in hertz and tan delta": (
        "f (Hz),eta (Pa s),tan delta",
        ",",
        lambda w, a, b: (w / (2 * np.pi), np.hypot(a, b) / w, b / a),
        ["f (Hz)", "complex_viscosity=eta (Pa s)", "loss_factor=tan delta"],
    ),
    "complex viscosity and loss modulus": (
        "w (rad/s),eta (Pa s),lost (Pa)",
        ",",
        lambda w, a, b: (w, np.hypot(a, b) / w, b),
        ["w (rad/s)", "complex_viscosity=eta (Pa s)", "loss=lost (Pa)"],
    ),
    "loss factor": (
        "w in rad/s,E' in MPa,tan(delta)",
        ",",
        lambda w, stored, lost: (w, stored / 1e6, lost / stored),
        ["w in rad/s", "storage=E\u2032 in MPa", "loss_factor=tan(delta)"],
    ),
}


@pytest.mark.parametrize("name", FILES)
def test_files_of_instruments_tell_the_same(tmp_path: Path, name: str) -> None:
    trace, values = tmp_path / "sweep.txt", solid()
    head, separator, columns, (frequency, *readings) = FILES[name]
    rows = np.transpose(columns(OMEGA, *values))
    text = "\n".join(separator.join(f"{it:.9g}" for it in row) for row in rows)
    if "Projekt" in head:
        text = f";{text}".replace("\n", "\n;").replace(".", ",")
    trace.write_text(f"{head}\n{text}\n", encoding="utf-8")
    options = [option for each in readings for option in ("--reading", each)]
    given = _parser().parse_args(["identify", "a", "--frequency", frequency, *options]).settings
    recording, _ = read_trace(Asked(trace, None, tuple(given)))
    loss, storage = np.split(recording.readings, 2)
    np.testing.assert_allclose(recording.time_s, np.append(-OMEGA[::-1], OMEGA), rtol=1e-8)
    np.testing.assert_allclose([storage, loss[::-1]], values, rtol=3e-8)


def test_what_a_sweep_cannot_have_is_refused(tmp_path: Path) -> None:
    for header, options, said in (
        ("w,G' (Pa),G'' (Pa)", [], "column 'w': found no unit"),
        ("frequency (1/s),G' (Pa),G'' (Pa)", [], "found the unit 1/s; allowed are rad/s or Hz"),
        ("w (rad/s),G' (Pa),G'' (Pa)", ["--hold", "1"], "is of a trace in time, not of a sweep"),
        ("w (rad/s),G' (Pa),G'' (Pa)", ["--drift"], "this is a frequency sweep; leave it out"),
        ("w (rad/s),G' (Pa),G'' (Pa)", ["--reading", "phase=x"], "found loss and phase"),
        ("w (rad/s),G' (Pa),G'' (Pa)", ["--sd", "x"], "both moduli need deviations"),
    ):
        trace = write_trace(tmp_path / "sweep.csv", OMEGA, *solid(), header=header)
        names = header.split(",")
        given = ["--frequency", names[0], "--reading", f"storage={names[1]}"]
        status, _, complained = identify(trace, *given, "--reading", f"loss={names[2]}", *options)
        assert (status, said in complained) == (1, True), complained


@pytest.mark.parametrize(
    ("row", "said"), [(0, "The phase is beyond 90 degrees"), (1, "The sample would give energy")]
)
def test_moduli_of_no_passive_sample_are_refused(row: int, said: str) -> None:
    values = solid()
    values[row, -1] *= -1
    with pytest.raises(BiogripError, match=said):
        swept(values)


def test_a_modulus_below_zero_is_read_where_the_noise_that_is_given_takes_it_there() -> None:
    """One of a million readings of zero is below 4.75 standard deviations."""
    clean = moduli("zener_maxwell", OMEGA, *SOLID.values())
    values = clean + 100 * np.random.default_rng(1).standard_normal(clean.shape)
    values[1, 0] = -50.0
    found = swept(values, noise=100.0)
    assert found.data["fit"] == "ok"
    limits = {name: (each["low"], each["high"]) for name, each in by_quantity(found.data).items()}
    assert all(low < SOLID[name] < high for name, (low, high) in limits.items() if name in SOLID)
    said = r"modulus of -50, at 0.1 rad/s \(loss\).* above -48 by the noise"
    with pytest.raises(BiogripError, match=said):
        swept(values, noise=10.0)
    # Without a noise that is given, it is as the other readings scatter.
    assert swept(values).data["samples"] == 50
    with pytest.raises(BiogripError, match="found a frequency of 0; allowed is one above 0"):
        swept(values, OMEGA - OMEGA[0])


def test_limits_are_those_of_lmfit(tmp_path: Path) -> None:
    """lmfit 1.3.4's `conf_interval` has them, by weights of 1/sd and chi-squared of known noise."""
    clean = moduli("zener_maxwell", OMEGA, *SOLID.values())
    sd = np.array([[0.02], [0.03]]) * clean
    scatter = np.random.default_rng(3).standard_normal(2 * len(OMEGA)).reshape(clean.shape)
    found = from_file(tmp_path, OMEGA, clean + sd * scatter, sd, "zener_maxwell")
    by_lmfit = {"k": (2983.907, 3034.939), "k_p": (485.820, 504.160), "c": (1983.893, 2043.440)}
    for name, ends in by_lmfit.items():
        # Limits have five digits in the file.
        assert (found[name]["low"], found[name]["high"]) == pytest.approx(ends, rel=5e-5)


def test_deviations_are_a_share_of_the_moduli_of_the_nearest_sample() -> None:
    places, readings = joined(OMEGA, *solid())
    _, exact = joined(OMEGA, *moduli("zener_maxwell", OMEGA, *SOLID.values()))
    noise = estimate_swept_noise(places, readings, (0.02,))
    np.testing.assert_allclose(noise.sd, 0.02 * exact, rtol=0.04)
    assert noise.correlation is None
    assert "as they scatter" not in str(swept(solid(), noise_share=0.02))


def test_an_amplitude_and_a_phase_have_the_covariance_of_their_moduli() -> None:
    """Of 100,000 draws the variances are within 3 %: some seven of their standard deviations."""
    a, p = 0.02, np.radians(1.0)
    clean = moduli("zener_maxwell", OMEGA, *SOLID.values())
    noise = estimate_swept_noise(*joined(OMEGA, *clean), (a, p))
    assert noise.correlation is not None
    rng = np.random.default_rng(1)
    errors = a * rng.standard_normal(100_000) + 1j * p * rng.standard_normal(100_000)
    for index in (0, 8, 12, 24):
        drawn = (clean[0, index] + 1j * clean[1, index]) * errors
        lost, stored = noise.sd[24 - index], noise.sd[25 + index]
        assert np.std(drawn.real) == pytest.approx(stored, rel=0.015)
        assert np.std(drawn.imag) == pytest.approx(lost, rel=0.015)
        both = np.corrcoef(drawn.real, drawn.imag)[0, 1]
        assert noise.correlation[index] == pytest.approx(both, abs=0.02)


def test_whitened_pairs_have_no_correlation_and_stay_in_their_place() -> None:
    sd, correlation = np.array([3.0, 2.0, 1.0, 4.0]), np.array([0.5, -0.9])
    places = np.array([-2.0, -1.0, 1.0, 2.0])
    whitened = PairWhitening(places, sd, correlation)
    covariance = np.diag(sd**2)
    for first, second, r in ((2, 1, 0.5), (3, 0, -0.9)):
        covariance[first, second] = covariance[second, first] = r * sd[first] * sd[second]
    to_white = whitened(np.eye(4)).T
    white = to_white @ covariance @ to_white.T
    np.testing.assert_allclose(white, np.mean(sd**2) * np.eye(4), atol=1e-12)
    # The root of the inverse is symmetric and positive.
    np.testing.assert_allclose(to_white, to_white.T, atol=1e-15)
    assert np.linalg.eigvalsh(to_white).min() > 0
    assert np.array_equal(places_of(moduli_of(sd, places), places), sd)


def test_a_relaxation_time_beyond_the_sweep_is_only_bounded() -> None:
    told_of = swept(solid(c=3e7))
    assert told_of.diagnosis.likelihood.problem.residuals.duration_s == pytest.approx(1 / OMEGA[0])
    assert "as they scatter from one frequency" in str(told_of)
    said = "In oscillation storage and loss moduli were recorded over frequency."
    words = set_up_in_words(told_of.data)
    assert said in words
    assert any("Intervals are 95 %" in each for each in words)
    found = by_quantity(told_of.data)
    assert found["tau"]["high"] is None or found["tau"]["high"] > 100 * found["tau"]["low"]


@pytest.mark.parametrize("count", [3, 4, 5, 6])
def test_few_frequencies_tell_the_noise(count: int) -> None:
    """As many lags as readings would leave none, and any sample limits of no width."""
    omega = np.geomspace(0.1, 10.0, count)
    values = noisy(moduli("springpot", omega, 600.0, 0.2), seed=5)
    found = swept(values, omega, model="springpot")
    assert 0.4 < found.diagnosis.likelihood.misfit / found.data["scatter_rad"] < 2.5
    shares = re.findall(r"([\d.]+) % of the \w+ modulus", str(found))
    assert [0.6 < float(share) < 5 for share in shares] == [True, True]
    limits = found.without_model().dropna(subset=["low", "high"])
    assert (limits["high"] > 1.01 * limits["low"]).all()


@pytest.mark.parametrize(
    ("inertia", "lost", "said"),
    [
        (1.0, 1.0, "inertia of the instrument"),
        (0.4, 1.0, "inertia of the instrument"),
        (0.0, 1.3, "both moduli (Kramers-Kronig)"),
    ],
)
def test_moduli_that_do_not_belong_to_one_sample_are_told(
    inertia: float, lost: float, said: str
) -> None:
    clean = moduli("zener_maxwell", OMEGA, 30000.0, 5000.0, 20000.0)
    wrong = clean * [[1.0], [lost]] - [[inertia], [0.0]] * OMEGA**2
    found = swept(noisy(wrong))
    assert found.status != "ok"
    (reason,) = (it for it in found.data["reasons"] if said in it)
    if inertia:
        # 1 or 0.4 Pa s^2 take 10 or 4 kPa from the 35 kPa at 100 rad/s; the fit takes up a part.
        percent = float(re.findall(r", (\S+) % at the highest", reason)[0])
        assert 0.3 < percent / (100 * inertia * 1e4 / wrong[0, -1]) < 1.5


def test_inertia_is_said_as_a_share_of_the_highest_storage_modulus() -> None:
    """Of 2 omega^2 at 3 rad/s, beside a loss that no inertia has: 18 over 357.2 is 5.04 %."""
    places = np.array([-3.0, -2.0, -1.0, 1.0, 2.0, 3.0])
    residual = np.array([0.1, 0.0, 0.0, 2.0, 8.0, 18.0])
    read = seen(time_s=places, readings=[357.2], condensed=seen(cleared=lambda rows: rows))
    given = seen(trace=read, freedom=9.0), residual, np.zeros((0, 6))
    told, said = find_inertia(*given)
    assert told
    assert said.startswith("inertia of the instrument or the sample, as")
    assert ", 5 % at" in said


def test_what_was_assumed_is_a_config_that_repeats_it(tmp_path: Path) -> None:
    """With its model, which no option says again."""
    sweep = ROOT / "data" / "sweep.csv"
    columns = ["--frequency", "frequency (Hz)", "--reading", "storage=G' (Pa)"]
    columns += ["--reading", "loss=G'' (Pa)", "--model", "springpot_beside_damper", "--no-compare"]
    first = identified(tmp_path, sweep, *columns, config="")
    again = identified(tmp_path, sweep, config=yaml.safe_dump(first["assumed"]))
    assert again["assumed"]["sample"]["model"] == "springpot_beside_damper"
    assert again["quantities"] == first["quantities"]
