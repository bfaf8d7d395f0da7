"""The default study's config, wherever the package is installed."""

from pathlib import Path


def default_config() -> Path:
    """Return the config file of the default study.

    An installed package carries a copy; in the repository it stands in config/.
    """
    packaged = Path(__file__).with_name("config.yaml")
    return packaged if packaged.is_file() else Path(__file__).parents[3] / "config" / "config.yaml"
