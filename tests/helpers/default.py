"""The default study, and such as differ from it."""

from types import SimpleNamespace
from typing import Any

import yaml

from biogrip.config.loading import read_configs
from biogrip.config.source import overlaid
from biogrip_study.config.study import DEFAULTS, Study, load_study


def study_of(overlay: str = "") -> Study:
    """The default study under a config that is given as YAML."""
    over: dict[str, Any] = yaml.safe_load(overlay) or {}
    return load_study(overlaid(read_configs(DEFAULTS), over), DEFAULTS)


def seen(**values: object) -> Any:
    """What is read of a study or a case, made up."""
    return SimpleNamespace(**values)


STUDY = study_of()
