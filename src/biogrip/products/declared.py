"""Declaration of what the report shows."""

from collections.abc import Callable, Iterable, Mapping

from biogrip.products.plan import Plan, Wildcards
from biogrip.products.product import LIGHT, Product, Reads, Weight, wildcards_of
from biogrip.products.uses import NOTHING, Uses
from biogrip.study.study import Study

_DOES = {"Tables": "Writing the table", "Figures": "Drawing"}


def shown(
    make: Callable[..., None],
    category: str,
    kinds: Iterable[str],
    path: str,
    *,
    name: str,
    item: str,
    caption: str,
    uses: Uses = NOTHING,
    reads: Mapping[str, Reads] | None = None,
    cases: Callable[[Study], Iterable[str]] | None = None,
    sweeps: bool = False,
    rule: str = "",
    when: Callable[[Study], object] = lambda _: True,
    weight: Weight = LIGHT,
) -> Product:
    """Declare a product that the report shows: one of the study, or of each case or sweep.

    Arguments are those of `Product`, but for its files: they have the suffixes `kinds` after a
    path, to which the case or sweep is appended. Without `cases` and `sweeps` there is one for the
    study, in any case only where a study meets the condition `when`.
    """
    what = name.removesuffix("_of_case").removesuffix("_figure")
    whose = "{case}" if cases else "{sweep}" if sweeps else ""
    path += f"_{whose}" if whose else ""

    def jobs(plan: Plan) -> list[Wildcards]:
        if not when(plan.study):
            return []
        if sweeps:
            return [{"sweep": sweep} for sweep in plan.study.sweeps]
        return wildcards_of(cases(plan.study)) if cases else [{}]

    return Product(
        name,
        {kind[1:]: path + kind for kind in kinds},
        make,
        uses,
        jobs,
        message=f"{_DOES[category]} {what}" + (f" of {whose}" if whose else ""),
        reads=reads or {},
        weight=weight,
        rule=rule,
        category=category,
        item=item,
        caption=caption,
    )
