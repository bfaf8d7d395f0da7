"""Identification of several recorded traces, each by itself."""

import sys
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from biogrip.digits import rounded_numbers, with_unit
from biogrip.errors import BiogripError
from biogrip.instrument.gripper import ROTATION
from biogrip.instrument.instruments import INSTRUMENTS
from biogrip.own_traces.one_trace import Identified, IdentifyOptions, identify_trace
from biogrip.own_traces.outputs import WRITTEN_BY, name_in_units
from biogrip.products.files.rows import write_rows
from biogrip.terminal import visible

if TYPE_CHECKING:
    from biogrip.own_traces.page import Page

_OF_QUANTITY = ("verdict", "value", "low", "high")


@dataclass(frozen=True)
class Outcome:
    """Results of several traces.

    Parameters
    ----------
    found
        Result of each usable trace, as data of `identify_trace`.
    refused
        Error message of each other trace, by file.
    """

    found: list[dict[str, Any]]
    refused: dict[str, str]


def identify_traces(
    options: IdentifyOptions, outputs: Mapping[Path, Path], page: "Page | None"
) -> Outcome:
    """Identify traces one after the other, and collect the errors of those that cannot be used.

    Parameters
    ----------
    options
        Options for all traces; its own trace is ignored.
    outputs
        JSON file to write for each CSV file.
    page
        Page that every identified trace is added to, if any.
    """
    found, refused = [], {}
    for number, (trace, output) in enumerate(outputs.items(), start=1):
        try:
            identified: Identified = identify_trace(replace(options, trace=trace), output)
        except BiogripError as error:
            refused[str(trace)] = str(error)
        else:
            found.append(identified.data)
            if page is not None:
                page.add(identified)
        if len(outputs) > 1:
            print(f"{number} of {len(outputs)}: {visible(trace)}", file=sys.stderr, flush=True)
    return Outcome(found, refused)


def write_table(outcome: Outcome, table: Path) -> None:
    """Write one row per trace as CSV: numbers, their units in the header, and no sentences."""
    units = {q["quantity"]: q["unit"] for each in outcome.found for q in each["quantities"]}
    # All traces are read by the same options and config.
    names = {each["reads"]["quantity"] for each in outcome.found} or {ROTATION.name}
    read = INSTRUMENTS[names.pop()].read
    columns = ["trace", "fit", "model", "preferred_model", "samples"]
    columns += [name_in_units(name, read) for name in ("noise_rad", "misfit_rad")]
    fixed = any("fixed" in each for each in outcome.found)
    columns += ["fixed"] if fixed else []
    columns += [
        with_unit(f"{quantity} {what}", unit if what != "verdict" else "")
        for quantity, unit in units.items()
        for what in _OF_QUANTITY
    ]
    rows = [
        (
            *(each["trace"], each["fit"], each["model"], _preferred(each)),
            *(each["samples"], each["noise_rad"], each["misfit_rad"]),
            *(["; ".join(each["fixed"])] if fixed else []),
            *_of_quantities(each, units),
            each[WRITTEN_BY],
        )
        for each in map(rounded_numbers, outcome.found)
    ]
    rows += [(trace, "none", *[""] * (len(columns) - 1)) for trace in outcome.refused]
    write_rows(table, (*columns, WRITTEN_BY), rows)


def _preferred(found: Mapping[str, Any]) -> str:
    """Return the model of the lowest BIC; "" if none were compared."""
    return next((row["model"] for row in found["models"] if row["delta_bic"] == 0), "")


def _of_quantities(found: Mapping[str, Any], quantities: Iterable[str]) -> list[object]:
    by_label = {q["quantity"]: q for q in found["quantities"]}
    return [
        ""
        if quantity not in by_label or by_label[quantity][what] is None
        else by_label[quantity][what]
        for quantity in quantities
        for what in _OF_QUANTITY
    ]
