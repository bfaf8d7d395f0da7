"""A config that is wrong is named before any job, with one message and no traceback."""

from pathlib import Path

import pytest

from tests.helpers.runs import TINY, snakemake


@pytest.mark.parametrize(
    ("config", "options", "said"),
    [
        ({"seedz": 3}, (), "overlay.yaml, line 1: seedz: unknown key. Did you mean 'seeds'?"),
        ({"seeds": "many"}, (), "overlay.yaml, line 1: seeds: found 'many', allowed is an integer"),
        (TINY, ("--config", "seeds=0"), "command line, --config: seeds: found 0, allowed is"),
        (TINY, ("--config", "onyl=x"), "onyl: unknown key. Did you mean 'only'?"),
    ],
)
def test_a_wrong_config_stops_with_one_message(
    tiny_copy: Path, config: dict[str, object], options: tuple[str, ...], said: str
) -> None:
    run = snakemake(tiny_copy, "-n", *options, config=config)
    assert run.status == 1
    assert said in run.output
    assert "Traceback" not in run.output
    assert len(run.output.splitlines()) < 12


def test_a_nested_number_on_the_command_line_is_a_number(tiny: Path) -> None:
    block = "evaluation={near_noise_tolerance: 0.03}"
    run = snakemake(tiny, "-n", "--config", block, config=TINY)
    assert run.status == 0, run.output
