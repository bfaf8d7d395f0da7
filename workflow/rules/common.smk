"""The config, checked, and what the rules are told of it."""

import sys
from dataclasses import fields
from functools import cache
from pathlib import Path
from shlex import quote

import yaml
from snakemake.exceptions import WorkflowError

import biogrip_study

# Snakemake puts it into shell commands as it is, and a folder may have a blank in its name. A
# workflow that has this one as a module, too, may read this twice.
if not sys.executable.startswith("'"):
    sys.executable = quote(sys.executable)
# Rules of one clone and code of another give what neither does.
TOP = Path(workflow.current_basedir.get_path_or_uri(secret_free=True)).parents[1]
for package in (TOP / "src" / "biogrip_study", TOP.parent):
    imported = Path(biogrip_study.__file__).parent
    if (package / "config" / "study.py").is_file() and not package.samefile(imported):
        raise WorkflowError(
            f"The rules are those of {TOP}, but the code and the default config are those of "
            f"{imported}, from which biogrip is installed. Use the environment of this clone "
            f"(make study), or install it: python -m pip install -e {TOP}."
        )

from biogrip.errors import BiogripError
from biogrip.files import digest_of, software
from biogrip.physics.instruments import INSTRUMENTS
from biogrip.traces.measurement_block import MeasurementBlock
from biogrip_study.config.shipped import shipped
from biogrip_study.config.study import load_given_study
from biogrip_study.methods.registry import METHODS
from biogrip_study.stages.job import CASE_KEYS, STUDY_KEYS, batch_names, keys_of_cases, settings


def usable(read, *given):
    """What is read of something given, or, if it cannot be used, the message alone."""
    try:
        return read(*given)
    except BiogripError as error:
        raise WorkflowError(str(error))


# What is given is laid over the default study, in a run of its own and in a module alike. A file
# of which nothing is in the config is that of a workflow which has this one as a module, unless
# Snakemake has made other keys of it by `__use_yte__`.
CONFIGS = [Path(file) for file in workflow.configfiles]
KNOWN = {*config, "__use_yte__"}
CONFIGS = [it for it in CONFIGS if KNOWN & {*yaml.safe_load(it.read_text("utf-8"))}]
STUDY = usable(load_given_study, config, CONFIGS)
SOFTWARE = software(Path(biogrip_study.__file__).parent)
# Config keys, of which each rule names those that its jobs use: what is controlled and read, and
# of which sample; what a fit assumes besides; when a simulated trace is sampled; its noise; and
# columns of a recorded trace.
SAMPLE = ["instrument", "protocol", "sample", "fixed", "measurement.file"]
SAMPLE += [f"measurement.{name}" for name in INSTRUMENTS]
FIT = [*SAMPLE, "gripper", "assumed_gripper", "search_range"]
FIT += "measurement.noise_rad measurement.noise_share measurement.noise_model".split()
FIT += "measurement.offset measurement.drift measurement.fit_start measurement.fit_contact".split()
FIT += "measurement.shape measurement.poisson measurement.load".split()
SAMPLING = ["measurement.rate_Hz"]
NOISE = "measurement.noise"
OF_FILE = [f"measurement.{field.name}" for field in fields(MeasurementBlock)]
OF_FILE = [key for key in OF_FILE if key not in (*FIT, *SAMPLING, NOISE)]


def settings_of(*keys):
    """Params of keys of the config, the case's before the study's, and of the software."""

    def of(key):
        return lambda wildcards: settings(STUDY, [key], wildcards.get("case", ""))

    return {"software": {"software": SOFTWARE}} | {key: of(key) for key in keys}


@cache
def batches(case, stage):
    """The batches of the traces of a case, or of those that its intervals are tested with."""
    chosen = STUDY.case(case)
    seeds = chosen.coverage_seeds if stage == "coverage" else chosen.seeds
    return batch_names(seeds, STUDY.config.batch_size)


def files(pattern, cases):
    """The files of some cases, of every method and batch if the pattern has them."""
    stage = "coverage" if "coverage" in pattern else "measurements"
    return [
        pattern.format(case=case, method=method, batch=batch)
        for case in cases
        for method in (STUDY.config.methods if "{method}" in pattern else [""])
        for batch in (batches(case, stage) if "{batch}" in pattern else [""])
    ]


def of_case(pattern, cases=STUDY.cases):
    """The files of the case of a job, if it is one of some cases."""
    return lambda wildcards: files(pattern, [case for case in [wildcards.case] if case in cases])


def first_traces(cases):
    """The files of measurements with the traces that are judged."""
    return [files("results/measurements/{case}/{batch}.npz", [case])[0] for case in cases]


def names(cases):
    """Cases as a regular expression; one that nothing matches if there are none."""
    return "|".join(cases) or "(?!)"


# Cases that have what only some have, those of sweeps' points among them.
SIMULATED = [*STUDY.simulated, *STUDY.points]
EVERY = [*STUDY.cases, *STUDY.points]
CALIBRATED = [n for n in EVERY if STUDY.case(n).block.assumed_gripper == "calibrated"]
SELECTING = list(STUDY.cases) if STUDY.config.model_selection.models else []
calibration_of = of_case("results/calibrations/{case}.yaml", CALIBRATED)

# Tables and figures of the study, of what there is in it, and those of a case.
TABLES = ["errors"]
TABLES += ["methods"] if STUDY.simulated else []
TABLES += ["coverage", "verdict_counts"] if STUDY.covered else []
TABLES += ["models"] if SELECTING else []
# The search ranges of recorded traces follow from them.
INPUTS = ["gene_ranges", "parameter_ranges"] if STUDY.simulated else []
HAS_GRIPPER = any(case.instrument.has_jaws for case in STUDY.cases.values())
INPUTS += ["gripper", "actuator"] if HAS_GRIPPER else []
EVIDENCE = ["evidence", "printed_values", "sampling_evidence"]
OTHER_TABLES = [*INPUTS, *(["contact", "left_out"] if HAS_GRIPPER else [])]
OTHER_TABLES += ["linearisation", "mechanics", "contact_loss"] if STUDY.gripped else []
OTHER_TABLES += ["claims", "tables_5_to_7", *EVIDENCE] if STUDY.published else []
OTHER_TABLES += ["readings", "readings_found"] * (len(STUDY.config.readings) > 1)
# The paper's samples under other protocols, and these under its own.
KNOWN = [STUDY.case(name).parameters for name in STUDY.published]
OTHERS = [
    n for n in STUDY.gripped if n not in STUDY.published and STUDY.case(n).parameters in KNOWN
]
OTHER_TABLES += ["protocols"] * bool(OTHERS)
GRIPPER_FIGURES = ["comb", "linkage", "torque"] if HAS_GRIPPER else []
PAPER_FIGURES = ["protocols"] * bool(OTHERS) + ["referee"] * (len(STUDY.config.readings) > 1)
FIGURES = ["overview"] if STUDY.simulated else []
# Those of a case, with the functions that draw them, and the first cases, as many as a page shows.
OF_EVERY_CASE = {
    "convergence": "biogrip_study.figures.course.draw_convergence",
    "evolution": "biogrip_study.figures.course.draw_evolution",
    "fit": "biogrip_study.figures.case_fit.draw_fits",
    "judged_fit": "biogrip_study.figures.case_fit.draw_judged_fit",
    "profiles": "biogrip_study.figures.case_fit.draw_profiles",
}
OF_SIMULATED = {
    "waterfall": "biogrip_study.figures.course.draw_waterfall",
}
FIRST = STUDY.of(STUDY.simulated[:3])

# All of them with the case or the sweep that they are of.
SHOWN = {
    "tables": [
        *((name, "") for name in [*TABLES, *OTHER_TABLES]),
        *((name, case) for case in STUDY.cases for name in ("errors", "verdicts")),
        *(("robustness", sweep) for sweep in STUDY.config.sweeps),
    ],
    "figures": [
        *((name, "") for name in [*GRIPPER_FIGURES, *PAPER_FIGURES, *FIGURES]),
        *(("linearisation", "") for _ in STUDY.gripped[:1]),
        *(
            (name, name_of_case)
            for name_of_case, case in STUDY.cases.items()
            for name in [*OF_EVERY_CASE, *([] if case.recorded else OF_SIMULATED)]
        ),
    ],
}


def stem(name, whose=""):
    """The name of a table's or a figure's files, which ends with that of its case or sweep."""
    return f"{name}_{whose}" if whose else name


def made(kind, suffix):
    """The files of all tables or figures, of one format."""
    return [f"results/{kind}/{stem(*item)}{suffix}" for item in SHOWN[kind]]


def shown(path, kind, item, whose):
    """A file of Snakemake's report, with its caption."""
    caption = f"../report/{kind}/{item}.rst"
    labels = dict(case=whose or "all", item=item.replace("_", " "), format=kind[:-1])
    return report(path, caption=caption, category=kind.title(), labels=labels)


def page_of_table(name, whose=""):
    """The page of a table, in Snakemake's report."""
    return shown(f"results/tables/{stem(name, whose)}.html", "tables", name, whose)


def drawing(name, whose=""):
    """The files of a figure: the picture, in Snakemake's report, and for print if that is asked."""
    file = f"results/figures/{stem(name, whose)}"
    return [shown(f"{file}.png", "figures", name, whose), *[f"{file}.pdf"] * STUDY.config.pdf]


wildcard_constraints:
    case="[^/]+",
    batch=r"seeds_\d+-\d+",
    method="|".join(METHODS),
    sweep=names(STUDY.config.sweeps),
