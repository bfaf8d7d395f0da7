"""A Slurm of the test's own: in a scratch folder, on free ports, as the user who runs the test.

Nothing of it is outside the folder, so that a Slurm of the machine, running or
not, is neither needed nor touched.
"""

import getpass
import os
import shutil
import socket
import subprocess
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path

# The Debian package that brings each program.
PACKAGES = {
    "munged": "munge",
    "slurmctld": "slurmctld",
    "slurmd": "slurmd",
    "srun": "slurm-client",
}
CONFIGURATION = Path(__file__).with_name("slurm.conf")
# Daemons are in /usr/sbin, which is not on every user's path.
PATH = os.pathsep.join([os.environ["PATH"], "/usr/sbin"])
PATIENCE_S = 30.0
# Snakemake's executor asks how all jobs are at ever longer intervals while none ends. It is
# answered when one has; after a minute in any case.
SQUEUE = """
case "$*" in *--states=all*) ;; *) exec {program} "$@" ;; esac
before=$(cat {ended} 2> /dev/null || echo 0)
for _ in $(seq 240); do
  answer=$({program} "$@") || exit
  now=$(echo "$answer" | grep -cE "CANCELLED|COMPLETED|FAILED|OUT_OF_MEMORY|TIMEOUT")
  test "$now" -gt "$before" && break
  sleep 0.25
done
echo "$now" > {ended}
echo "$answer"
""".strip()


class SlurmError(Exception):
    """The cluster did not start."""


def missing_packages() -> list[str]:
    """Debian packages that the cluster needs and this machine has not got."""
    return [package for name, package in PACKAGES.items() if not shutil.which(name, path=PATH)]


@contextmanager
def one_node_slurm() -> Iterator[dict[str, str]]:
    """Run a Slurm with this machine as its one node; gives the environment to reach it.

    Raises
    ------
    SlurmError
        If it does not start, with what its daemons say.
    """
    with tempfile.TemporaryDirectory(prefix="biogrip-slurm-") as scratch, ExitStack() as running:
        folder = Path(scratch)
        environment = _configure(folder)
        munge = f"-S {folder}/munge.socket"

        def start(*command: str) -> None:
            running.enter_context(_daemon(command, environment, folder))

        start("munged", "--foreground", *_munge_files(folder))
        _wait_until(f"munge -n {munge} | unmunge {munge}", environment, folder)
        start("slurmctld", "-D")
        start("slurmd", "-D")
        _wait_until("sinfo --noheader --format=%T | grep -q idle", environment, folder)
        running.callback(_cancel_jobs, environment)
        yield environment


def _configure(folder: Path) -> dict[str, str]:
    """Write keys and configuration; gives the environment in which Slurm finds them."""
    configuration = folder / "slurm.conf"
    folder.chmod(0o711)  # munged insists on a socket that everyone can reach
    (folder / "munge.key").write_bytes(os.urandom(128))
    (folder / "munge.key").chmod(0o600)
    programs = folder / "bin"
    programs.mkdir()
    # Jobs are deprived of SLURM_CONF by Snakemake's executor before they call srun.
    srun = f'SLURM_CONF={configuration} exec {_path_of("srun")} "$@"'
    squeue = SQUEUE.format(program=_path_of("squeue"), ended=folder / "ended")
    for name, script in (("srun", srun), ("squeue", squeue)):
        (programs / name).write_text(f"#!/bin/sh\n{script}\n")
        (programs / name).chmod(0o755)
    node = subprocess.check_output([_path_of("slurmd"), "-C"], text=True).splitlines()[0]
    configuration.write_text(
        CONFIGURATION.read_text().format(
            folder=folder,
            user=getpass.getuser(),
            node=node,
            host=node.split()[0].removeprefix("NodeName="),
            controller_port=_free_port(),
            node_port=_free_port(),
        )
    )
    # slurmd sets up cgroups even if nothing uses them: of the second version at once, which takes
    # root, and outside the folder; of the first when they are used.
    (folder / "cgroup.conf").write_text("CgroupPlugin=cgroup/v1\n")
    return {
        **os.environ,
        "PATH": os.pathsep.join([str(programs), PATH]),
        "SLURM_CONF": str(configuration),
    }


def _munge_files(folder: Path) -> list[str]:
    options = [f"--{name}-file={folder}/munge.{name}" for name in ("key", "log", "pid", "seed")]
    return [*options, f"--socket={folder}/munge.socket"]


def _path_of(program: str) -> str:
    found = shutil.which(program, path=PATH)
    assert found
    return found


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port


@contextmanager
def _daemon(command: Sequence[str], environment: dict[str, str], folder: Path) -> Iterator[None]:
    """Run a daemon that does not outlive this process, however that ends."""
    with (folder / f"{command[0]}.out").open("w") as log:
        process = subprocess.Popen(
            ["setpriv", "--pdeathsig", "TERM", *command],
            env=environment,
            stdout=log,
            stderr=subprocess.STDOUT,
        )
    try:
        yield
    finally:
        process.terminate()
        try:
            process.wait(PATIENCE_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def _wait_until(command: str, environment: dict[str, str], folder: Path) -> None:
    give_up = time.monotonic() + PATIENCE_S
    while _fails(command, environment):
        if time.monotonic() > give_up:
            logs = [f"{log.name}:\n{log.read_text()}" for log in sorted(folder.glob("*.out"))]
            raise SlurmError("\n".join([f"no success in {PATIENCE_S:.0f} s: {command}", *logs]))
        time.sleep(0.1)


def _cancel_jobs(environment: dict[str, str]) -> None:
    """Leave no job behind, whose processes would outlive slurmd."""
    subprocess.run(["scancel", "--full", "--user", getpass.getuser()], env=environment, check=True)
    subprocess.run(
        "while squeue --noheader | grep -q .; do sleep 0.1; done",
        shell=True,
        env=environment,
        timeout=PATIENCE_S,
        check=True,
    )


def _fails(command: str, environment: dict[str, str]) -> bool:
    return subprocess.run(command, shell=True, env=environment, capture_output=True).returncode != 0
