"""Numbers of all cells from which a page draws the distribution of each quantity."""

from collections.abc import Mapping, Sequence
from typing import Any

from biogrip.own_traces.words import labels_of
from biogrip.terminal import visible

_FACTORS_FIRST = ("dish", "group")


def strips_of(
    traces: Sequence[Mapping[str, Any]], groups: Mapping[str, Any] | None
) -> dict[str, Any]:
    """Return value and limits of every quantity of each trace, and medians of groups.

    Parameters
    ----------
    traces
        Traces as on the page, in its order.
    groups
        Result of `compare_groups`, if groups were compared.
    """
    factor, group_of = _groups_of(traces, groups)
    factors = [
        {**({factor: own} if own else {}), **(each.get("factors") or {})}
        for each, own in zip(traces, group_of, strict=True)
    ]
    names = list(dict.fromkeys(name for own in factors for name in own))
    first = next((name for name in (factor, *_FACTORS_FIRST) if name in names), None)
    names.sort(key=lambda name: name != first)
    labels = labels_of(traces)
    units = {q["quantity"]: q["unit"] for each in traces for q in each["quantities"]}
    return {
        "quantities": [{"name": label, "unit": units[label]} for label in labels],
        "factors": names,
        "cells": [
            {
                "name": each.get("cell") or each["trace"],
                "fit": each["fit"],
                "levels": [str(own.get(name, "")) for name in names],
                "found": [_numbers(each, label) for label in labels],
            }
            for each, own in zip(traces, factors, strict=True)
        ],
        "by": factor,
        "medians": [
            [row["group"], row["quantity"], *map(_short, (row["median"], row["low"], row["high"]))]
            for row in (groups or {"groups": []})["groups"]
            if "median" in row
        ],
    }


def _groups_of(
    traces: Sequence[Mapping[str, Any]], groups: Mapping[str, Any] | None
) -> tuple[str, list[str]]:
    """Return the factor that makes the groups that were compared, and the group of each trace."""
    if groups is None:
        return "", [""] * len(traces)
    of_file = {
        visible(trace["file"]): cell["group"]
        for cell in groups["cells"]
        for trace in cell["traces"]
    }
    return groups.get("by", "group"), [of_file.get(each["trace"], "") for each in traces]


def _numbers(each: Mapping[str, Any], label: str) -> list[float | None] | None:
    """Return value and limits; None of a quantity that the trace does not have."""
    for item in each["quantities"]:
        if item["quantity"] == label:
            return [_short(item[name]) for name in ("value", "low", "high")]
    return None


def _short(value: float | None) -> float | None:
    return None if value is None else float(f"{value:.4g}")
