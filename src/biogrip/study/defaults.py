"""Paths of the default config, the Snakefile and published results, installed or not."""

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


def published(name: str) -> Path:
    """Return a published table, by its path from ``results/published`` on."""
    return _TOP / "results" / "published" / name
