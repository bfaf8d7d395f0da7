"""Numbers of all traces from which a page draws the distribution of each quantity."""

from collections.abc import Mapping, Sequence
from typing import Any

from biogrip.identify.words import labels_of


def strips_of(traces: Sequence[Mapping[str, Any]], columns: Sequence[str]) -> dict[str, Any]:
    """Return value and limits of every quantity of each trace.

    Parameters
    ----------
    traces
        Traces as on the page, in its order.
    columns
        Names of the columns that are copied from a table, by any of which points are sorted.
    """
    labels = labels_of(traces)
    units = {q["quantity"]: q["unit"] for each in traces for q in each["quantities"]}
    return {
        "quantities": [{"name": label, "unit": units[label]} for label in labels],
        "columns": list(columns),
        "cells": [
            {
                "name": each["trace"],
                "fit": each["fit"],
                "levels": [each["copied"].get(name, "") for name in columns],
                "found": [_numbers(each, label) for label in labels],
            }
            for each in traces
        ],
    }


def _numbers(each: Mapping[str, Any], label: str) -> list[float | None] | None:
    """Return value and limits; None of a quantity that the trace does not have."""
    for item in each["quantities"]:
        if item["quantity"] == label:
            return [_short(item[name]) for name in ("value", "low", "high")]
    return None


def _short(value: float | None) -> float | None:
    return None if value is None else float(f"{value:.4g}")
