"""The help of each command has examples that can be typed."""

import shlex

import pytest

from biogrip.cli import _parser, main


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
