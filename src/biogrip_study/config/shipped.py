"""Files that come with the study's code: the default config, and the workflow."""

from pathlib import Path

# The wheel contains a copy of these files of the repository.
_PACKAGE = Path(__file__).parents[1]
_TOP = _PACKAGE / "workflow" if (_PACKAGE / "workflow").is_dir() else _PACKAGE.parents[1]


def default_config() -> Path:
    """Return the config file of the default study."""
    return shipped("config/config.yaml")


def shipped(name: str) -> Path:
    """Return a file that comes with the code, by its path in the repository."""
    return _TOP / name


def snakefile() -> Path:
    """Return the workflow that comes with the code, for a workflow of one's own."""
    return shipped("Snakefile")
