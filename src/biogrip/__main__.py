"""The ``biogrip`` command as a process, stoppable while it loads."""

import sys

from biogrip.processes import end_when_stopped
from biogrip.terminal import open_closed_streams


def main() -> int:
    """Run the command line of this process, and return its exit status."""
    open_closed_streams()
    end_when_stopped()
    import atexit
    import gc

    # Loading makes much and leaves little: look for garbage less often.
    gc.set_threshold(50_000)
    from biogrip.cli import main as command

    # Skip garbage collection at exit, a fifth of a short job's time.
    atexit.register(gc.freeze)
    return command()


if __name__ == "__main__":
    sys.exit(main())
