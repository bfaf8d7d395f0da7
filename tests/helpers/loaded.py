"""Snakemake called as often as need be and loaded once.

Loading it and the study's code takes longer than most of what tests call it for. So a
process loads both, and forks for each call: folder, environment and output of a call
are its own, as those of a program that is started.
"""

import json
import os
import subprocess
import sys
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from select import select

_SECONDS = 600


def call(arguments: Sequence[str], folder: Path, environment: Mapping[str, str], said: Path) -> int:
    """Call Snakemake in a folder; its exit status.

    Parameters
    ----------
    arguments
        Of the command line.
    folder
        Where.
    environment
        All of it.
    said
        File for both of its outputs.
    """
    process = _process()
    assert process.stdin is not None
    assert process.stdout is not None
    process.stdin.write(json.dumps([arguments, str(folder), dict(environment), str(said)]) + "\n")
    process.stdin.flush()
    if not select([process.stdout], [], [], _SECONDS)[0]:
        process.kill()
        _process.cache_clear()
        raise TimeoutError(said.read_text())
    return int(process.stdout.readline())


@cache
def _process() -> "subprocess.Popen[str]":
    # It ends when nobody can ask any more.
    return subprocess.Popen(
        [sys.executable, "-m", __name__],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )


def _serve() -> None:
    from snakemake.cli import main

    from biogrip.products.catalogue import products

    products()
    for line in sys.stdin:
        arguments, folder, environment, said = json.loads(line)
        child = os.fork()
        if not child:
            output = os.open(said, os.O_WRONLY)
            for number, file in enumerate((os.open(os.devnull, os.O_RDONLY), output, output)):
                os.dup2(file, number)
            os.chdir(folder)
            os.environ.clear()
            os.environ.update(environment)
            sys.argv = ["snakemake", *arguments]
            sys.exit(main())
        print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)


if __name__ == "__main__":
    _serve()
