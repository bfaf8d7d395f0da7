"""The help of each command: examples that can be typed, and models by their names."""

import shlex

import pytest

from biogrip.cli import _parser, main
from biogrip.physics.models import MODELS


@pytest.mark.parametrize("command", ["identify", "groups", "design"])
def test_examples_are_commands_that_can_be_typed(
    command: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit):
        main([command, "--help"])
    _, _, examples = capsys.readouterr().out.partition("\nexamples:\n")
    lines = [line for line in examples.splitlines() if line.startswith("  ")]
    assert len(lines) == 2
    for line in lines:
        program, *arguments = shlex.split(line)
        assert (program, arguments[0]) == ("biogrip", command)
        _parser().parse_args(arguments)


def test_models_are_listed_as_they_are_typed_and_printed(
    capsys: pytest.CaptureFixture[str],
) -> None:
    with pytest.raises(SystemExit):
        main(["identify", "--help"])
    _, _, listed = capsys.readouterr().out.partition("\nsample models:\n")
    rows = [line.split(maxsplit=1) for line in listed.partition("\n\n")[0].splitlines()]
    assert rows == [[name, model.title] for name, model in MODELS.items()]
