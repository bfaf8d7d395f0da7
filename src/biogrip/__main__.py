"""The ``biogrip`` command as a process of its own, which can be stopped while it loads."""

import sys

from biogrip.stopping import end_when_stopped
from biogrip.terminal import open_closed_streams


def main() -> int:
    """Run the command line of this process; return its exit status."""
    open_closed_streams()
    end_when_stopped()
    import atexit
    import gc

    from biogrip.cli import main as command

    # A fifth of a short job's time would go into looking for cycles when the process ends.
    atexit.register(gc.freeze)
    return command()


if __name__ == "__main__":
    sys.exit(main())
