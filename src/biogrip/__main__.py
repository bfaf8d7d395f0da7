"""The ``biogrip`` command as a process, stoppable while it loads."""

import sys

from biogrip.terminal import collect_less, end_when_stopped, open_closed_streams


def main() -> int:
    """Run the command line of this process, and return its exit status."""
    open_closed_streams()
    end_when_stopped()
    collect_less()
    from biogrip.cli import main as command

    return command()


if __name__ == "__main__":
    sys.exit(main())
