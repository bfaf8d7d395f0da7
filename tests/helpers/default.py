"""The default study, and such as differ from it."""

from pathlib import Path
from typing import Any

import yaml

from biogrip.products.plan import Plan
from biogrip.products.uses import Used
from biogrip.study.load import load_study
from biogrip.study.source import overlaid, read_config
from biogrip.study.study import Study
from tests.helpers.places import CONFIG


def study_of(overlay: str = "") -> Study:
    """The default study under a config that is given as YAML."""
    over: dict[str, Any] = yaml.safe_load(overlay) or {}
    return load_study(overlaid(read_config(CONFIG), over), [CONFIG])


def plan_of(overlay: str = "") -> Plan:
    """Its jobs where nothing is done yet."""
    return Plan(study_of(overlay), Path("nowhere"))


def seen(**values: object) -> Any:
    """What a product sees of a study or a case, made up."""
    return Used(values)


STUDY = study_of()
