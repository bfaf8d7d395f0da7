"""`biogrip identify --posterior`: what it writes and says, and what it refuses."""

import json
from pathlib import Path

import numpy as np
import pytest

from biogrip.cli import main
from biogrip.identifiability.convergence import FEWEST, MOST_R_HAT
from biogrip.identifiability.prior_sensitivity import NOTABLE
from biogrip.own_traces.words import POSTERIOR_OF_REJECTED, evidence_in_words
from biogrip.products.files.parquet import column_names, read_columns
from tests.helpers.places import EXAMPLE
from tests.helpers.problems import clean
from tests.test_one_trace import written

PRIOR = """
posterior:
  prior: {k: {median: 1.0, spread: 0.02}}
  evidence: true
model_selection: {models: [maxwell, liquid_drop]}
identifiability: {confidence: 0.9}
"""
SHORT = """
posterior: {walkers: 20, most_steps: 1000}
model_selection: {models: [maxwell]}
"""


@pytest.fixture(scope="module")
def trace(tmp_path_factory: pytest.TempPathFactory) -> Path:
    times, response = clean("liquid_drop_2")
    noise = 0.05 * response.max() * np.random.default_rng(0).standard_normal(len(times))
    return written(tmp_path_factory.mktemp("own") / "drop.csv", times, response + noise)


def test_a_prior_and_the_evidence(trace: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """k is told to 2 %, far better than by the trace; two models, of which the simpler will do."""
    config, page = trace.with_name("mine.yaml"), trace.with_name("page.html")
    config.write_text(PRIOR)
    arguments = ["identify", str(trace), "--model", "liquid_drop", "--config", str(config)]
    assert main([*arguments, "--report", str(page)]) == 0
    said = capsys.readouterr().out
    found = json.loads(trace.with_name("drop.identified.json").read_text())["posterior"]
    assert found["converged"]
    assert found["r_hat"] <= MOST_R_HAT
    assert min(found["bulk"], found["tail"]) >= FEWEST
    told = {item["quantity"]: item for item in found["quantities"]}
    assert set(told) == {"k", "k_p", "c"}
    # Five hundredths of its standard deviation, of some thousand samples.
    assert np.log(told["k"]["median"]) == pytest.approx(0, abs=0.02)
    width = np.log(told["k"]["high"] / told["k"]["low"])
    assert 0.7 * 2 * 1.645 * 0.02 < width < 1.1 * 2 * 1.645 * 0.02
    assert told["k"]["against_profile"] == "differs"
    assert told["k_p"]["against_profile"] == "prior"
    assert [row["model"] for row in found["evidence"]] == ["maxwell", "liquid_drop"]
    assert all(row["reliable"] for row in found["evidence"])
    for item in told.values():
        assert item["in_words"] in said
    # What is told outweighs the trace.
    assert told["k"]["prior_sensitivity"] > NOTABLE > told["k"]["likelihood_sensitivity"]
    assert "The prior shapes k (" in found["prior_in_words"]
    for words in (
        found["in_words"],
        found["prior_in_words"],
        "prior: k as given, else log-uniform",
        "The evidence is high",
    ):
        assert words in said
    text = page.read_text()
    assert "k log-normal, median 1, spread 0.02" in text
    assert found["prior_in_words"] in text
    assert "Posterior: marginals and pairs of parameters" in text
    samples = trace.with_name("drop.identified.parquet")
    assert f"{samples}" in said
    names = ["k_N_per_m", "k_p_N_per_m", "c_Ns_per_m"]
    assert column_names(samples)[:3] == names
    columns = read_columns(samples, names)
    for name, label in zip(names, told, strict=True):
        assert 4000 < len(columns[name]) <= 10_000
        assert np.median(columns[name]) == pytest.approx(told[label]["median"], rel=0.1)
    # Ours is replaced, and others' samples are not.
    before = samples.read_bytes()
    config.write_text(SHORT)
    assert main(arguments) == 0
    assert samples.read_bytes() != before
    samples.write_bytes(b"mine")
    assert main(arguments) == 1
    assert "drop.identified.parquet: is there, and biogrip did not write it" in (
        capsys.readouterr().err
    )
    assert samples.read_bytes() == b"mine"


def test_without_being_asked_nothing_is_sampled(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    output = tmp_path / "found.json"
    assert main(["identify", str(EXAMPLE), "--output", str(output)]) == 0
    assert "posterior" not in json.loads(output.read_text())
    assert "Posterior" not in capsys.readouterr().out
    assert [file.name for file in tmp_path.iterdir()] == ["found.json"]


@pytest.mark.parametrize(
    ("block", "message"),
    [
        ("{prior: {kp: {median: 1, spread: 1}}}", "posterior.prior.kp: found kp, allowed is what"),
        ("{prior: {k: {median: 0, spread: 1}}}", "posterior.prior.k.median: found 0, allowed is"),
        ("{prior: {k: {median: 1}}}", "posterior.prior.k.spread: is missing"),
        ("{walkers: 3}", "posterior.walkers: found 3, allowed is"),
        ("{}\nmodels: {identification: nonlinear}", "allowed with it is models.identification: l"),
    ],
)
def test_what_cannot_be_sampled_is_refused_with_file_and_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], block: str, message: str
) -> None:
    config = tmp_path / "mine.yaml"
    config.write_text(f"# mine\nposterior: {block}\n")
    output = tmp_path / "found.json"
    arguments = ["identify", str(EXAMPLE), "--config", str(config), "--output", str(output)]
    assert main(arguments) == 1
    said = capsys.readouterr().err
    assert message in said
    assert "mine.yaml, line 2: " in said
    assert not output.exists()


def test_evidence_is_told_with_what_is_near_and_what_is_not_to_be_relied_on() -> None:
    rows = [
        {"title": "Burgers fluid", "delta_log_evidence": 0.0, "reliable": True},
        {"title": "Maxwell liquid", "delta_log_evidence": 2.9, "reliable": False},
        {"title": "bare damper", "delta_log_evidence": 300.0, "reliable": True},
    ]
    assert evidence_in_words([]) == []
    assert evidence_in_words(rows) == [
        "The evidence is highest for the Burgers fluid; less than 20 times lower is that of "
        "Maxwell liquid. Not to be relied on: Maxwell liquid."
    ]


def test_the_posterior_of_a_rejected_fit_is_not_shown(
    trace: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    times, response = np.loadtxt(trace, delimiter=",", skiprows=1).T
    # A jump of the instrument.
    jumped = written(
        tmp_path / "jumped.csv", times, response + 0.5 * response.max() * (times > 300)
    )
    config, page = tmp_path / "short.yaml", tmp_path / "page.html"
    config.write_text(SHORT)
    options = ["--config", str(config), "--posterior", "--report", str(page)]
    assert main(["identify", str(jumped), "--model", "liquid_drop", *options]) == 0
    said = capsys.readouterr().out
    assert "fit rejected" in said
    for text in (said, page.read_text()):
        assert POSTERIOR_OF_REJECTED in text
        assert "Posterior, median" not in text
        assert "Posterior: median" not in text
