"""What a page shows of one trace: its numbers and sentences, as plain data.

A study keeps this beside the fit, so that `biogrip.identify.page` can change without new fits.
"""

import json
from typing import Any

import yaml

from biogrip.identify.curves import curves_of
from biogrip.identify.one_trace import Identified
from biogrip.identify.words import (
    for_a_paper,
    further_notes,
    limits_in_short,
    noise_in_words,
    one_sided_in_words,
    taken_for_granted,
)
from biogrip.terminal import visible


def for_page(identified: Identified) -> dict[str, Any]:
    """Return the numbers and sentences of a trace on a page, as plain data."""
    data = identified.data
    assumed = dict(data["assumed"])
    # The page names the trace, and says once what several assume alike.
    assumed["measurement"] = {**assumed["measurement"]}
    assumed["measurement"].pop("file", None)
    dumper: Any = getattr(yaml, "CSafeDumper", yaml.SafeDumper)
    curves = curves_of(identified)
    return {
        **data,
        "trace": visible(data["trace"]),
        "curves": json_in_page(curves),
        "drawn_quantiles": len(curves["quantiles"]),
        "noise_in_words": noise_in_words(data),
        "further_notes": further_notes(data),
        "for_a_paper": for_a_paper(data),
        "in_short": {q["quantity"]: limits_in_short(q) for q in data["quantities"]},
        "setup": yaml.dump(assumed, Dumper=dumper, sort_keys=False, allow_unicode=True),
        "one_sided": " ".join(one_sided_in_words([data])),
        "granted": taken_for_granted(data) if data["by_default"] else None,
    }


def json_in_page(data: Any) -> str:
    """Return plain data as JSON that cannot close the script element around it."""
    text = json.dumps(data, separators=(",", ":"), ensure_ascii=False, allow_nan=False)
    return text.replace("<", "\\u003c")
