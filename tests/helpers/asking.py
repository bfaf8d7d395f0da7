"""Asks the process of `loaded.py` for a call of a program, and is itself loaded in no time."""

import json
import os
import socket
import sys
from collections.abc import Mapping, Sequence

_LENGTH, _FILES = 8, 3


def ask(
    place: str,
    command: Sequence[str],
    folder: str,
    environment: Mapping[str, str],
    files: Sequence[int],
    seconds: float | None = None,
) -> int:
    """Have a command run with three open files in the place of its own; its exit status.

    Raises
    ------
    TimeoutError
        If it takes longer.
    """
    told = json.dumps([command, folder, dict(environment)]).encode()
    with socket.socket(socket.AF_UNIX) as connection:
        connection.settimeout(seconds)
        connection.connect(place)
        socket.send_fds(connection, [len(told).to_bytes(_LENGTH, "big")], files)
        connection.sendall(told)
        return int(connection.makefile().read())


def asked(connection: socket.socket) -> tuple[list[str], str, dict[str, str], list[int]]:
    """Command, folder, environment and open files that `ask` has sent."""
    length, files, _, _ = socket.recv_fds(connection, _LENGTH, _FILES)
    with connection.makefile("rb") as told:
        command, folder, environment = json.loads(told.read(int.from_bytes(length, "big")))
    return command, folder, environment, files


def answer(connection: socket.socket, status: int) -> None:
    """Tell who asked how the command ended."""
    connection.sendall(str(status).encode())


if __name__ == "__main__":
    status = ask(sys.argv[1], sys.argv[2:], os.getcwd(), os.environ, range(_FILES))
    sys.exit(status if status >= 0 else 128 - status)
