"""The default study, and such as differ from it."""

from types import SimpleNamespace
from typing import Any

import yaml

from biogrip.study.source import overlaid, read_config
from biogrip.study.study import Study, load_study
from tests.helpers.places import CONFIG


def study_of(overlay: str = "") -> Study:
    """The default study under a config that is given as YAML."""
    over: dict[str, Any] = yaml.safe_load(overlay) or {}
    return load_study(overlaid(read_config(CONFIG), over), [CONFIG])


def seen(**values: object) -> Any:
    """What is read of a study or a case, made up."""
    return SimpleNamespace(**values)


STUDY = study_of()
