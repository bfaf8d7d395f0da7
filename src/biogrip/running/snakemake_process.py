"""Snakemake as `biogrip run` starts it: it can always be stopped, and without a stack.

While Snakemake loads and plans, an interruption would show where in its code it was.
"""

import atexit
import gc
import signal
import sys


def main() -> None:
    """Run Snakemake with the arguments of this process."""
    # As of a job, see `biogrip.cli.main`: looking for cycles at the end takes time.
    atexit.register(gc.freeze)
    # What is started by a script in the background would ignore it.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
        from snakemake.cli import main as snakemake

        sys.argv[0] = "snakemake"
        snakemake()
    except KeyboardInterrupt:
        sys.exit(128 + signal.SIGINT)


if __name__ == "__main__":
    main()
