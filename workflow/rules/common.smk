"""The config, checked, and what the rules are told of it."""

from snakemake.exceptions import WorkflowError

from biogrip.errors import BiogripError
from biogrip.fit.methods import METHODS
from biogrip.study.batches import batch_names
from biogrip.study.defaults import default_config
from biogrip.study.load import load_study, read_configs
from biogrip.study.settings import settings, software
from biogrip.study.source import overlaid

try:
    # What is given is laid over the default study, in a run of its own and in a module alike.
    STUDY = load_study(
        overlaid(read_configs([default_config()]), config),
        [default_config(), *workflow.overwrite_configfiles],
        command_line=workflow.config_settings.config,
    )
except BiogripError as error:
    raise WorkflowError(str(error))

# A job runs again if the config keys that its rule names change, or the software.
SOFTWARE = {"software": software()}
# What a fit assumes of the instrument and of the sample.
PROBLEM = (
    *("instrument", "gripper", "actuator", "assumed_gripper", "protocol", "measurement"),
    *("sample", "fixed", "search_range", "models"),
)


def settings_of(*keys):
    """Params by key of the config, the case's laid over the study's; `method` is that of the job."""

    def of(key):
        def value(wildcards):
            return settings(STUDY, [key], wildcards.get("case", ""))

        return value

    return {key: of(key) for key in keys}


def method_settings(wildcards):
    """The blocks of the config that the method of a job reads."""
    return settings(STUDY, METHODS[wildcards.method].blocks, wildcards.case)


def of_batches(pattern):
    """The files of all batches of seeds of a case."""
    return lambda wildcards: expand(
        pattern, batch=batch_names(STUDY.case(wildcards.case).seeds), allow_missing=True
    )


def first_batch(pattern):
    """The file of the batch that has the first seed of a case, which is judged."""
    return lambda wildcards: expand(
        pattern, batch=batch_names(STUDY.case(wildcards.case).seeds)[0], allow_missing=True
    )


def calibration_of(wildcards):
    """The calibration of the gripper, for a case that uses one."""
    used = STUDY.case(wildcards.case).is_calibrated
    return "results/calibrations/{case}.yaml" if used else []


def names(cases):
    """Cases as a regular expression; one that nothing matches if there are none."""
    return "|".join(cases) or "(?!)"


SIMULATED = [*STUDY.simulated, *STUDY.points]


wildcard_constraints:
    batch=r"seeds_\d+-\d+",
    method="|".join(METHODS),
