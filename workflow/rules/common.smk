"""The config, checked, and what the rules are told of it."""

from snakemake.exceptions import WorkflowError

from biogrip.errors import BiogripError
from biogrip.fit.methods import METHODS
from biogrip.study.batches import batch_names
from biogrip.study.case_blocks import METHOD_BLOCKS
from biogrip.study.config import StudyConfig
from biogrip.study.defaults import default_config, shipped
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
    case="[^/]+",
    batch=r"seeds_\d+-\d+",
    method="|".join(METHODS),


# Cases that have what only some have.
CALIBRATED = [name for name in STUDY.cases if STUDY.case(name).is_calibrated]
SELECTING = list(STUDY.cases) if STUDY.selects_models else []
# Tables of the study, of what there is in it.
TABLES = ["errors", "gene_ranges", "parameter_ranges"]
if STUDY.has_gripper:
    TABLES += ["gripper", "actuator", "contact", "left_out"]
if STUDY.gripped:
    TABLES += ["linearisation", "mechanics"]
if STUDY.simulated:
    TABLES += ["methods"]
if STUDY.covered:
    TABLES += ["coverage"]
if SELECTING:
    TABLES += ["models"]
if STUDY.published:
    TABLES += ["evidence", "printed_values", "sampling_evidence"]
# Of the whole study, what its tables and figures use.
WHOLE = (
    *("study_seed", "seeds", "methods", "cases", "gripper", "actuator", "protocol"),
    *("search_range", "model_selection", "evaluation", "reconstructed"),
)


def table(path, caption=""):
    """The files of a table, of which the last is in Snakemake's report."""
    case = "{case}" if "{case}" in path else "all"
    name = caption or path
    page = report(
        f"results/tables/{path}.html",
        caption=f"../report/{name}.rst",
        category="Tables",
        labels={"case": case, "item": name.replace("_", " "), "format": "table"},
    )
    return [f"results/tables/{path}.{kind}" for kind in ("csv", "md", "tex")] + [page]


def of_cases(pattern, cases):
    """The files of some cases."""
    return expand(pattern, case=cases)


def of_all_batches(pattern, cases):
    """The files of all batches of some cases, method by method if the pattern has it."""
    methods = STUDY.methods if "{method}" in pattern else [""]
    return [
        file
        for case in cases
        for file in expand(pattern, case=case, method=methods, batch=batches_of(case, pattern))
    ]


def batches_of(case, pattern):
    """The batches of the traces of a case, or of those that its intervals are tested with."""
    chosen = STUDY.case(case)
    return batch_names(chosen.coverage_seeds if "coverage" in pattern else chosen.seeds)


def of_methods(pattern):
    """The files of all methods and batches of a case."""
    return lambda wildcards: of_all_batches(pattern, [wildcards.case])


def expectation_of(wildcards):
    """What to expect of the traces of a case, if it is simulated."""
    expected = wildcards.case in STUDY.simulated
    return "results/identifiability/expected/{case}.json" if expected else []


# What claims of the paper are judged by; published, as sweeps take longer than the study.
JUDGED_BY = [f"results/tables/{name}.csv" for name in TABLES]
JUDGED_BY += of_cases("results/tables/verdicts_{case}.csv", STUDY.cases)
PUBLISHED_SWEEPS = [
    str(shipped(f"results/published/{name}.csv"))
    for name in (
        "robustness/tables/robustness_noise",
        "robustness/tables/robustness_gripper",
        "interpretations/tables/interpretations",
    )
]


CASE_FIGURES = ("title", "methods", "seeds", "published", "evaluation", "contact", *PROBLEM)
CASE_FIGURES += ("identifiability", "genetic_algorithm")


def figure(path, name):
    """The files of a figure, of which the first is in Snakemake's report."""
    case = "{case}" if "{case}" in path else "all"
    png = report(
        f"results/figures/{path}.png",
        caption=f"../report/{name}.rst",
        category="Figures",
        labels={"case": case, "item": name.replace("_", " "), "format": "figure"},
    )
    return [png, f"results/figures/{path}.pdf"]


def case_figure_names(simulated, valley):
    """Names of the figures of a case, by whether it is simulated, and searched for c and c_p."""
    drawn = ["convergence", "evolution", "fit", "judged_fit", "profiles"]
    drawn += ["force", "scatter", "waterfall"] if simulated else []
    return drawn + ["valley"] if valley else drawn


def figures_of(case):
    """Names of the figures of a case."""
    return case_figure_names(case in STUDY.simulated, STUDY.case(case).has_valley)


def case_figures(simulated, valley):
    """The files of the figures of a case, and its summary."""
    drawn = case_figure_names(simulated, valley)
    summary = report(
        "results/summaries/{case}.html",
        caption="../report/summary.rst",
        category="Summaries",
        labels={"case": "{case}", "item": "summary", "format": "page"},
    )
    return [*(file for name in drawn for file in figure(f"{name}_{{case}}", name)), summary]


def all_batches(pattern):
    """The files of all batches of the traces of a case."""
    return lambda wildcards: of_all_batches(pattern, [wildcards.case])


def target_of(wildcards):
    """The target of a case, if it is simulated."""
    return "results/targets/{case}.csv" if wildcards.case in STUDY.simulated else []


# Figures of the study, of what there is in it.
FIGURES = []
if STUDY.has_gripper:
    FIGURES += ["comb", "linkage", "torque"]
if STUDY.gripped:
    FIGURES += ["linearisation"]
if STUDY.simulated:
    FIGURES += ["moduli", "overview"]


def first_batches(pattern):
    """The files of all cases with the trace that is judged."""
    return [
        file
        for case in STUDY.cases
        for file in expand(pattern, case=case, batch=batch_names(STUDY.case(case).seeds)[0])
    ]


# What the page shows.
PAGE_FIGURES = [*FIGURES]
PAGE_FIGURES += [f"{name}_{case}" for case in STUDY.cases for name in figures_of(case)]
PAGE_TABLES = [*TABLES]
PAGE_TABLES += ["contact_loss"] if STUDY.gripped else []
PAGE_TABLES += ["claims"] if STUDY.published else []
PAGE_TABLES += [f"{name}_{case}" for case in STUDY.cases for name in ("errors", "verdicts")]
CAPTIONS = [*FIGURES, *TABLES, "contact_loss", "claims", "errors", "verdicts"]
CAPTIONS += sorted({name for case in STUDY.cases for name in figures_of(case)})
