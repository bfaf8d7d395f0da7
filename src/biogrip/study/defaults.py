"""Paths of the default config, the Snakefile and other files, installed or in the repository."""

from pathlib import Path

# The wheel contains a copy of these files of the repository.
_PACKAGED = Path(__file__).parents[1] / "workflow"
_TOP = _PACKAGED if _PACKAGED.is_dir() else Path(__file__).parents[3]


def default_config() -> Path:
    """Return the config file of the default study."""
    return _TOP / "config" / "config.yaml"


def snakefile() -> Path:
    """Return the Snakefile that runs a study."""
    return _TOP / "Snakefile"


def shipped(name: str) -> Path:
    """Return another file that comes with the code, by its path in the repository."""
    return _TOP / name
