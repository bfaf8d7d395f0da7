"""Every claim of the paper that results can speak to, with a verdict and the evidence."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from biogrip.study.study import Study
from biogrip.tables import claims_on_algorithm as algorithm
from biogrip.tables import claims_on_instrument as instrument
from biogrip.tables import claims_on_values as values
from biogrip.tables.claim_rules import RULES, UNDECIDED, Judged, LackingError, Results, read_results
from biogrip.tables.layout import Column, Table


@dataclass(frozen=True)
class Claim:
    """A claim of the paper."""

    place: str
    """Section, table or figure."""
    words: str
    """The claim as the paper has it, shortened."""
    judge: Callable[[Results], Judged]


CLAIMS = (
    Claim(
        "section 2",
        "1.6e-3 µNm … corresponds to … about 17 V",
        instrument.judge_voltage,
    ),
    Claim(
        "section 2",
        "in order to maintain the grip with the sample",
        instrument.judge_grip,
    ),
    Claim(
        "section 2",
        "samples … belonging to the range [30, 120] µm",
        instrument.judge_sizes,
    ),
    Claim(
        "section 2",
        "[distance of the jaws] can be easily set-up … without affecting the results",
        instrument.judge_jaw_gap,
    ),
    Claim(
        "section 2",
        "capability … depends on the elastic properties of the device and on the implemented "
        "algorithm",
        instrument.judge_capability,
    ),
    Claim(
        "section 2",
        "determined considering a standard impulse or a step response",
        instrument.judge_free_arm,
    ),
    Claim(
        "section 3, (1)-(6)",
        "can be described by means of the following equations",
        instrument.judge_equations,
    ),
    Claim(
        "section 3, (4)-(6)",
        "an approximate linear set of equations can be obtained",
        instrument.judge_linear_model,
    ),
    Claim(
        "section 3",
        "1.6 µNm is about 17 V, whereas … 0.32 µNm is about 7 V",
        instrument.judge_voltages,
    ),
    Claim(
        "section 4",
        "three independent genes allows a faster convergence",
        algorithm.judge_splitting,
    ),
    Claim("section 4", "each one … few possible values (either 9 or 12)", algorithm.judge_genes),
    Claim(
        "section 4, Table 4",
        "range as reported in Table 4, with two significant digits",
        algorithm.judge_digits,
    ),
    Claim(
        "sections 4, 6",
        "does not require to assume a priori the order of magnitude",
        algorithm.judge_orders_found,
    ),
    Claim("section 5", "reaching a stationary value", algorithm.judge_stationary),
    Claim(
        "section 5, Figure 8",
        "Generally, convergence is reached around the 60th generation",
        algorithm.judge_convergence,
    ),
    Claim(
        "section 5, Figure 8",
        "20 generations … verify if mutation can move the optimum from a local minimum",
        algorithm.judge_further_generations,
    ),
    Claim("section 5", "for the case of endothelial cells", instrument.judge_endothelial),
    Claim(
        "Figure 9",
        "the best fit solution, obtained at the 70th generation",
        partial(algorithm.judge_generation_of_the_fit, number=5),
    ),
    Claim(
        "Figure 9",
        "target response … and the best fit",
        partial(values.judge_fits_response, number=5),
    ),
    Claim(
        "Figure 10",
        "except c_p, the order of magnitude … is obtained around the 20th generation",
        algorithm.judge_early_orders,
    ),
    Claim("Table 5", "identified values", partial(values.judge_values_of_table, number=5)),
    Claim("Table 5", "k_p and c have a negligible error", values.judge_negligible),
    Claim("Table 5", "the error on k is lower than the noise level", values.judge_below_noise),
    Claim(
        "Table 5",
        "c_p … has a very low value that does not affect the response",
        values.judge_low_damper,
    ),
    Claim(
        "section 5",
        "generally able … also in case of simpler models",
        algorithm.judge_simpler_models,
    ),
    Claim("Table 6", "identified values", partial(values.judge_values_of_table, number=6)),
    Claim(
        "Table 6",
        "response … is dominated basically by the damping value",
        algorithm.judge_damper_dominates,
    ),
    Claim(
        "Figure 11", "fits correctly the response", partial(values.judge_fits_response, number=6)
    ),
    Claim("Table 6", "identify with small error the key parameter c", values.judge_key_damper),
    Claim("Table 6", "catch k_p and k orders of magnitude", algorithm.judge_orders_of_drop),
    Claim("Table 7", "identified values", partial(values.judge_values_of_table, number=7)),
    Claim(
        "Table 7",
        "becomes affected by the k value, thus the identification improves",
        algorithm.judge_spring_shows,
    ),
    Claim(
        "Table 7",
        "good identification for k and c (error below 3%)",
        values.judge_good_identification,
    ),
    Claim("Figure 12", "axis from -0.6 to 4.2 mrad", instrument.judge_rotation),
    Claim(
        "Figure 12",
        "fit at generation 61",
        partial(algorithm.judge_generation_of_the_fit, number=7),
    ),
    Claim("section 6", "confirm the feasibility of the approach", algorithm.judge_feasible),
    Claim(
        "section 6",
        "highly robust with respect to measurement noise",
        algorithm.judge_robust,
    ),
    Claim("section 6", "nor the specific cell model", algorithm.judge_cell_model),
)

_COLUMNS = (
    Column("place", "Place"),
    Column("claim", "Claim of the paper"),
    Column("verdict", "Verdict"),
    Column("evidence", "Evidence"),
)


def claims(
    study: Study,
    identifications: list[Path],
    histories: list[Path],
    tables: list[Path],
    sweeps: list[Path],
) -> Table:
    """Judge every claim."""
    results = read_results(study, identifications, histories, tables, sweeps)
    rows = []
    for claim in CLAIMS:
        try:
            found = claim.judge(results)
        except LackingError as lacking:
            found = Judged(UNDECIDED, f"Not here: {lacking}.")
        rows.append((claim.place, claim.words, found.verdict, found.evidence))
    caption = (
        "Claims of the paper on its method and results, and what this study says of each. Claims "
        f"of novelty and on related work are left out. {RULES} Sweeps are the published ones."
    )
    return Table(caption, _COLUMNS, rows)
