"""What no schema of single keys can see: how the keys of a study go together."""

from collections.abc import Iterator, Mapping
from itertools import pairwise
from typing import Any

from biogrip.errors import BiogripError, nearest
from biogrip.experiment.sample import Parameter, SampleModel
from biogrip.study import build
from biogrip.study.source import KeyPath
from biogrip.study.trace_file import trace_file_problem

Problem = tuple[KeyPath, str]

_LONGEST_S = 1e9
_LEAST_PARAMETER = 1e-18
_LARGEST_QUALITY = 1e6
_MOST_SAMPLES = 10_000_000
_MOST_PERIODS = 10_000
_DRIVING = (
    *("torque_Nm", "to_torque_Nm", "torque_right_Nm"),
    *("voltage_V", "to_voltage_V", "voltage_right_V"),
)
_OF_A_FILE = ("time", "rotation", "time_unit", "rotation_unit", "noise_rad")
_NO_PARAMETERS = ("model", "branches", "size_m")


def meaning_problems(config: Mapping[str, Any]) -> Iterator[Problem]:
    """Find what is wrong with a config that fits the schema.

    Parameters
    ----------
    config
        Complete: every case has its blocks filled in.

    Yields
    ------
    tuple
        The path of the key, and what was found and what is allowed.
    """
    for name, case in config["cases"].items():
        path = ("cases", name)
        found = list(_recording_problems((*path, "measurement"), case["measurement"]))
        found += _noise_problems((*path, "measurement", "noise"), case["measurement"]["noise"])
        found += _contact_problems((*path, "contact"), case)
        found += _sample_problems((*path, "sample"), case)
        found += _phase_problems((*path, "protocol", "phases"), case["protocol"]["phases"])
        found += _genetic_problems((*path, "genetic_algorithm"), case["genetic_algorithm"])
        found += _range_problems((*path, "search_range"), case["search_range"])
        yield from found
        if not found:
            yield from _fixed_problems((*path, "fixed"), case)
            yield from _cut_problems((*path, "genetic_algorithm"), case)
            yield from _sampling_problems(path, case)
            if case.get("assumed_gripper") == "calibrated":
                yield from _calibration_problems((*path, "calibration"), case)
            yield from _gripper_problems(path, case, config["actuator"])
    for index, key in enumerate(config["reconstructed"]):
        if not _exists(config, key):
            yield ("reconstructed", index), f"found '{key}', allowed is a key of this study."


def workflow_problems(config: Mapping[str, Any]) -> Iterator[Problem]:
    """Find names that Snakemake would read as patterns.

    Yields
    ------
    tuple
        The path of the key, and what was found and what is allowed.
    """
    for name, case in config["cases"].items():
        file = case["measurement"].get("file", "")
        if any(bracket in file for bracket in "{}<>"):
            text = f"found '{file}', allowed is a name without {{ }} < >: Snakemake fills them in."
            yield ("cases", name, "measurement", "file"), text


def _model(case: Mapping[str, Any]) -> SampleModel:
    return build.sample_model(case["sample"])


def _recording_problems(path: KeyPath, measurement: Mapping[str, Any]) -> Iterator[Problem]:
    """A recorded trace needs a file that is there, and the names of its columns."""
    if "file" not in measurement:
        for key in _OF_A_FILE:
            if key in measurement:
                yield (*path, key), "is only for a recorded trace, whose measurement has a file."
        return
    for key in ("time", "rotation"):
        if key not in measurement:
            yield (*path, key), f"is missing: a recorded trace needs the name of its {key} column."
    if problem := trace_file_problem(measurement["file"]):
        yield (*path, "file"), problem


def _noise_problems(path: KeyPath, noise: Mapping[str, Any]) -> Iterator[Problem]:
    given = [key for key in ("level", "level_rad") if noise.get(key) is not None]
    if len(given) != 1:
        found = " and ".join(given) or "neither"
        yield path, f"found {found}, allowed is one of level and level_rad; null takes one away."


def _contact_problems(path: KeyPath, case: Mapping[str, Any]) -> Iterator[Problem]:
    if "contact" in case and "file" in case["measurement"]:
        yield path, "is only for a simulated case; of a recorded trace leave out what follows."
    elif case.get("contact") == "unilateral" and case["models"]["target"] != "linear":
        text = "found unilateral and a nonlinear target, allowed is models.target: linear with it."
        yield path, text


def _sample_problems(path: KeyPath, case: Mapping[str, Any]) -> Iterator[Problem]:
    sample, recorded = case["sample"], "file" in case["measurement"]
    if "branches" in sample and sample["model"] != "generalized_maxwell":
        yield (*path, "branches"), "only generalized_maxwell has a number of branches."
        return
    model = _model({"sample": sample})
    names = ", ".join(model.names)
    for name in sample:
        if name not in (*_NO_PARAMETERS, *model.names):
            hint = nearest(name, model.names)
            yield (*path, name), f"is no parameter of {model.name}, which has {names}.{hint}"
    for parameter in model.parameters:
        if recorded:
            if parameter.name in sample:
                yield (*path, parameter.name), "is what a recorded trace is to tell; leave it out."
            continue
        if parameter.name not in sample:
            yield (*path, parameter.name), f"is missing: {model.name} needs {names}."
            continue
        yield from _parameter_problems((*path, parameter.name), sample[parameter.name], parameter)


def _parameter_problems(path: KeyPath, value: float, parameter: Parameter) -> Iterator[Problem]:
    if value < _LEAST_PARAMETER and not (value == 0 and parameter.may_vanish):
        zero = "0 or " if parameter.may_vanish else ""
        text = f"found {value}, allowed is {zero}at least {_LEAST_PARAMETER:g} {parameter.unit}."
        yield path, text


def _fixed_problems(path: KeyPath, case: Mapping[str, Any]) -> Iterator[Problem]:
    fixed, names = case.get("fixed", {}), _model(case).names
    for name in fixed:
        if name not in names:
            text = f"is no parameter of the sample, which has {', '.join(names)}."
            yield (*path, name), text + nearest(name, names)
    for parameter in _model(case).parameters:
        if parameter.name in fixed:
            here = (*path, parameter.name)
            yield from _parameter_problems(here, fixed[parameter.name], parameter)
    if set(names) <= set(fixed):
        yield path, "leaves nothing to identify; allowed are fewer parameters."


def _phase_problems(path: KeyPath, phases: list[Mapping[str, Any]]) -> Iterator[Problem]:
    whole = sum(phase["duration_s"] for phase in phases)
    if whole > _LONGEST_S:
        text = f"found {whole:g} s in all phases together, allowed is at most {_LONGEST_S:g} s."
        yield path, text
    for index, phase in enumerate(phases):
        here = (*path, index)
        given = [key for key in ("torque_Nm", "voltage_V") if key in phase]
        if len(given) != 1:
            found = " and ".join(given) or "neither"
            yield here, f"found {found}, allowed is one of torque_Nm and voltage_V."
            continue
        by = given[0]
        quantity, unit = by.split("_")
        swing, right, ramp = f"amplitude_{unit}", f"{quantity}_right_{unit}", f"to_{by}"
        for key in phase:
            if key not in ("duration_s", by, right, ramp, swing, "frequency_Hz"):
                yield (*here, key), f"does not go with {by}."
        if (swing in phase) != ("frequency_Hz" in phase):
            yield here, f"has one of {swing} and frequency_Hz; allowed are both or neither."
        if right in phase and ramp in phase:
            yield (*here, right), "does not go with a ramp; allowed is a held torque."
        if phase.get("frequency_Hz", 0) * phase["duration_s"] > _MOST_PERIODS:
            text = f"found {phase['frequency_Hz']}, allowed are at most {_MOST_PERIODS} periods"
            yield (*here, "frequency_Hz"), f"{text} in a phase."
        if swing in phase and ramp in phase:
            yield here, "has a ramp and a sinusoid; allowed is one of them in a phase."
        if phase.get(swing, 0) > min(phase[by], phase.get(right, phase[by])):
            text = f"found {phase[swing]}, allowed is at most {by}: comb drives only pull."
            yield (*here, swing), text


def _gripper_problems(
    path: KeyPath, case: Mapping[str, Any], actuator: Mapping[str, Any]
) -> Iterator[Problem]:
    yield from arm_problems((*path, "gripper"), case["gripper"])
    assumed = case.get("assumed_gripper", {})
    if isinstance(assumed, str):
        if assumed != "calibrated":
            text = f"found '{assumed}', allowed is 'calibrated' or keys of a gripper block."
            yield (*path, "assumed_gripper"), text
    else:
        yield from _assumed_problems((*path, "assumed_gripper"), assumed, case["gripper"])
    if "size_m" in case["sample"]:
        try:
            build.contact_of(case["gripper"], actuator, case["sample"]["size_m"])
        except BiogripError as error:
            yield (*path, "sample", "size_m"), str(error)


def arm_problems(path: KeyPath, gripper: Mapping[str, Any]) -> Iterator[Problem]:
    """Find arms that ring for so long that their decay is lost in rounding."""
    built = build.gripper(gripper)
    for side, arm in (("left", built.left), ("right", built.right)):
        if arm.quality_factor > _LARGEST_QUALITY:
            text = f"makes the arm's quality factor {arm.quality_factor:.3g}, "
            allowed = f"allowed is at most {_LARGEST_QUALITY:g}."
            yield (*path, side, "damping_Nms_per_rad"), text + allowed


def _calibration_problems(path: KeyPath, case: Mapping[str, Any]) -> Iterator[Problem]:
    """A free arm must be seen ringing: sampled fast enough, for long enough."""
    block, gripper = case["calibration"], build.gripper(case["gripper"])
    frequency = max(arm.natural_frequency_Hz for arm in (gripper.left, gripper.right))
    if block["rate_Hz"] < 10 * frequency:
        text = f"found {block['rate_Hz']}, allowed is at least ten times the arms' natural"
        yield (*path, "rate_Hz"), f"{text} frequency, {10 * frequency:.4g} Hz."
    if not 5 / frequency <= block["duration_s"] <= _MOST_SAMPLES / block["rate_Hz"]:
        text = f"found {block['duration_s']}, allowed is from five periods of the arms' ring, "
        most = _MOST_SAMPLES / block["rate_Hz"]
        yield (*path, "duration_s"), f"{text}{5 / frequency:.3g} s, to {most:.3g} s."


def _assumed_problems(
    path: KeyPath, assumed: Mapping[str, Any], true: Mapping[str, Any]
) -> Iterator[Problem]:
    allowed = [key for key in true if key not in ("jaw_gap_m", "uncertainty")]
    for key in assumed:
        if key not in allowed:
            hint = nearest(key, allowed)
            yield (*path, key), f"unknown key.{hint} Allowed here: {', '.join(allowed)}."


def _genetic_problems(path: KeyPath, settings: Mapping[str, Any]) -> Iterator[Problem]:
    for low, high, below in (
        ("survivors", "population", True),
        ("min_generations", "max_generations", False),
    ):
        wrong = settings[low] >= settings[high] if below else settings[low] > settings[high]
        if wrong:
            word = "less than" if below else "at most"
            text = f"found {settings[low]}, allowed is {word} {high}, which is {settings[high]}."
            yield (*path, low), text


def _cut_problems(path: KeyPath, case: Mapping[str, Any]) -> Iterator[Problem]:
    settings = case["genetic_algorithm"]
    genes = 3 * (len(_model(case).names) - len(case.get("fixed", {})))
    first, last = settings["first_cut"], settings["last_cut"]
    last = last if last > 0 else genes + last
    if genes and not 1 <= first <= last:
        text = f"found {first}, allowed is 1 to last_cut, which is {last} of {genes} genes here."
        yield (*path, "first_cut"), text


def _range_problems(path: KeyPath, ranges: Mapping[str, Any]) -> Iterator[Problem]:
    for name, genes in ranges.items():
        for gene, (low, high) in genes.items():
            if low > high:
                yield (
                    (*path, name, gene),
                    f"found [{low}, {high}], allowed is [lowest, highest].",
                )
        if all(low == high for low, high in genes.values()):
            text = "leaves one value, and nothing to search for; allowed are more. What is known is"
            yield (*path, name), f"{text} given under the case's key fixed."


def _sampling_problems(path: KeyPath, case: Mapping[str, Any]) -> Iterator[Problem]:
    phases = case["protocol"]["phases"]
    if not any(phase.get(key) for phase in phases for key in _DRIVING):
        text = "no phase has a torque, so nothing would move; allowed is at least one above 0 N m."
        yield (*path, "protocol", "phases"), text
    if "file" in case["measurement"]:
        return
    here = (*path, "measurement")
    searched = len(_model(case).names) - len(case.get("fixed", {}))
    nuisance = sum(case["measurement"].get(key, False) for key in ("offset", "drift"))
    needed = searched + nuisance + 1
    end = sum(phase["duration_s"] for phase in phases)
    times = case["measurement"].get("times_s")
    if times is None:
        rate = case["measurement"]["rate_Hz"]
        samples = end * rate + 1
        if not needed <= samples <= _MOST_SAMPLES:
            text = f"found {rate}, which gives {samples:.6g} samples over the protocol; "
            yield (*here, "rate_Hz"), f"{text}allowed are {needed} to {_MOST_SAMPLES}."
        return
    if len(times) < needed:
        yield (*here, "times_s"), f"found {len(times)} times, allowed are at least {needed}."
    for index, (before, after) in enumerate(pairwise(times), start=1):
        if not before < after <= end:
            text = f"found {after}, allowed is later than {before} and at most {end} s."
            yield (*here, "times_s", index), text
            break


def _exists(config: Mapping[str, Any], key: str) -> bool:
    block: Any = config
    for part in key.split("."):
        if not isinstance(block, Mapping) or part not in block:
            return False
        block = block[part]
    return True
