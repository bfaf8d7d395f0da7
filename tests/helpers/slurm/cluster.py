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
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

# The Debian package that brings each program.
PACKAGES = {"slurmctld": "slurmctld", "slurmd": "slurmd", "srun": "slurm-client"}
CONFIGURATION = Path(__file__).with_name("slurm.conf")
# Daemons are in /usr/sbin, which is not on every user's path.
PATH = os.pathsep.join([os.environ["PATH"], "/usr/sbin"])
PATIENCE_S = 30.0


def missing_packages() -> list[str]:
    """Debian packages that the cluster needs and this machine has not got."""
    return [package for name, package in PACKAGES.items() if not shutil.which(name, path=PATH)]


@contextmanager
def one_node_slurm() -> Iterator[dict[str, str]]:
    """Run a Slurm with this machine as its one node; gives the environment to reach it."""
    with tempfile.TemporaryDirectory(prefix="biogrip-slurm-") as scratch, ExitStack() as running:
        folder = Path(scratch)
        environment = _configure(folder)
        for daemon in ("slurmctld", "slurmd"):
            running.enter_context(_daemon(daemon, environment, folder))
        if not _in_time("sinfo --noheader --format=%T | grep -q idle", environment):
            logs = [f"{log.name}:\n{log.read_text()}" for log in sorted(folder.glob("*.out"))]
            raise TimeoutError("\n".join([f"no idle node in {PATIENCE_S:.0f} s", *logs]))
        try:
            yield environment
        finally:
            # Leave no job behind, whose processes would outlive slurmd.
            _in_time(f"scancel --full --user {getpass.getuser()}", environment)
            assert _in_time('test -z "$(squeue --noheader)"', environment)


def _configure(folder: Path) -> dict[str, str]:
    """Write the configuration; gives the environment in which Slurm finds it."""
    configuration = folder / "slurm.conf"
    programs = folder / "bin"
    programs.mkdir()
    # Jobs are deprived of SLURM_CONF by Snakemake's executor before they call srun.
    srun = f'SLURM_CONF={configuration} exec {shutil.which("srun", path=PATH)} "$@"'
    (programs / "srun").write_text(f"#!/bin/sh\n{srun}\n")
    (programs / "srun").chmod(0o755)
    environment = {
        **os.environ,
        "PATH": os.pathsep.join([str(programs), PATH]),
        "SLURM_CONF": str(configuration),
    }
    node = subprocess.check_output(["slurmd", "-C"], env=environment, text=True).splitlines()[0]
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
    return environment


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port


@contextmanager
def _daemon(name: str, environment: dict[str, str], folder: Path) -> Iterator[None]:
    """Run a daemon that does not outlive this process, however that ends."""
    with (folder / f"{name}.out").open("w") as log:
        process = subprocess.Popen(
            ["setpriv", "--pdeathsig", "TERM", name, "-D"],
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


def _in_time(command: str, environment: dict[str, str]) -> bool:
    give_up = time.monotonic() + PATIENCE_S
    while subprocess.run(command, shell=True, env=environment, capture_output=True).returncode:
        if time.monotonic() > give_up:
            return False
        time.sleep(0.1)
    return True
