"""Parameters that a fit leaves at an end of their search range, though chi^2 falls beyond it."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from biogrip.experiment.sample import SampleModel
from biogrip.fit.multi_start import descend_from
from biogrip.judging.fit_status import REJECTION, Note
from biogrip.judging.likelihood import Likelihood

# Decrease of chi^2 beyond an end that is more than chance: three standard deviations squared.
_NOTICEABLE = 9.0
# Widening of a range, and the start beyond its end, in e-folds; and rounding.
_WIDER, _BEYOND, _AT_END = np.log(1e3), 1.0, 1e-9


def note_range_ends(likelihood: Likelihood, model: SampleModel) -> Iterator[Note]:
    """Yield a note for each parameter that the data push beyond an end of its search range.

    The fit is repeated from beyond the end, with a wider range for this parameter. If the element
    may as well vanish, chi^2 does not fall, and no note is due.

    Parameters
    ----------
    likelihood
        Best fit and noise.
    model
        The model that was searched.
    """
    problem, x = likelihood.problem, likelihood.best
    for index, parameter in enumerate(model.parameters):
        for end, outward, word in ((problem.low, -1.0, "lower"), (problem.high, 1.0, "upper")):
            # An exponent at its upper end is that of a damper: there is nothing beyond.
            bounded = outward > 0 and np.isfinite(parameter.below)
            if bounded or abs(x[index] - end[index]) > _AT_END:
                continue
            start, low, high = x.copy(), problem.low.copy(), problem.high.copy()
            start[index] += outward * _BEYOND
            (low if outward < 0 else high)[index] += outward * _WIDER
            wider = descend_from([replace(problem, low=low, high=high)], start)
            if likelihood.increase(float(wider.misfit_rad[0])) < -_NOTICEABLE:
                unit = f" {parameter.unit}" if parameter.unit else ""
                yield Note(
                    REJECTION,
                    f"{parameter.name} is at the {word} end of its search range, "
                    f"{np.exp(end[index]):.3g}{unit}, and beyond it the trace fits better: widen "
                    f"search_range.{parameter.name} in the config, or check the set-up. Until "
                    "then nothing is determined.",
                )
