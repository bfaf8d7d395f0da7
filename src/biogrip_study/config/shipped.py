"""Files that come with the study's code: the default config, and the workflow."""

from collections.abc import Mapping
from pathlib import Path

from biogrip.files import software

# The wheel contains a copy of these files of the repository.
_PACKAGE = Path(__file__).parents[1]
_PACKAGED = _PACKAGE / "workflow"
_TOP = _PACKAGED if _PACKAGED.is_dir() else _PACKAGE.parents[1]


def default_config() -> Path:
    """Return the config file of the default study."""
    return shipped("config/config.yaml")


def shipped(name: str) -> Path:
    """Return a file that comes with the code, by its path in the repository."""
    return _TOP / name


def snakefile() -> Path:
    """Return the workflow that comes with the code, for a workflow of one's own."""
    return shipped("Snakefile")


def study_software() -> Mapping[str, str]:
    """Return versions of what computes the study, and a digest of its source."""
    return software(_PACKAGE)
