"""What the command does."""

from collections.abc import Sequence
from pathlib import Path

from biogrip.errors import BiogripError, nearest
from biogrip.files import refuse_inputs, write_text
from biogrip.own_design.as_config import as_config
from biogrip.own_design.designed import designed, in_words
from biogrip.own_design.earlier import told_by
from biogrip.own_traces.outputs import check_output
from biogrip.progress import Progress
from biogrip.study.defaults import default_config
from biogrip.study.load import load_study, read_configs
from biogrip.study.study import Case


def design(
    configs: Sequence[Path],
    names: Sequence[str],
    output: Path,
    *,
    after: Path | None = None,
    force: bool = False,
) -> None:
    """Design the experiments of cases, write them as a config and as a page, and print them.

    Parameters
    ----------
    configs
        YAML files laid over the default study, with a block `design`.
    names
        Cases; by default all that have such a block.
    output
        YAML file; the page stands beside it.
    after
        CSV file of a trace of one case, recorded as the config says: what it told is used.
    force
        Whether to replace files that this program did not write.

    Raises
    ------
    BiogripError
        If nothing can be designed as asked.
    """
    files = [default_config(), *configs]
    study = load_study(read_configs(files), files, for_workflow=False)
    chosen = _chosen(study.cases, names)
    page = output.with_suffix(".html")
    if page == output:
        raise BiogripError(f"{output}: allowed is the name of a YAML file; the page is beside it.")
    if after is not None and len(chosen) > 1:
        raise BiogripError("--after: is of one case; choose it with --case.")
    refuse_inputs([output, page], [*configs, *([after] if after else [])])
    for path in (output, page):
        check_output(path, force=force)
    found = []
    with Progress("designs", len(chosen), live=True) as progress:
        for case in chosen:
            told = None if after is None else told_by(case, after, study.study_seed)

            def tried(count: int, bound: float, title: str = case.title) -> None:
                progress.doing(f"{title}: {count} torques tried, bound {100 * bound:.3g} %")

            found.append(designed(case, study.study_seed, tried, told))
            progress.done()
    # Drawing takes a second to begin with.
    from biogrip.own_design.page import write_page

    write_text(output, as_config(found))
    write_page(found, page)
    print("\n".join(map(in_words, found)))
    print(f"Written to {output}, {page}.")


def _chosen(cases: dict[str, Case], names: Sequence[str]) -> list[Case]:
    for name in names:
        if name not in cases:
            text = f"design: found no case '{name}', allowed are {', '.join(cases)}."
            raise BiogripError(text + nearest(name, cases))
        if cases[name].block.design is None:
            raise BiogripError(f"design: case '{name}' has no block `design`, which is needed.")
    chosen = [
        case for name, case in cases.items() if case.block.design and name in (names or cases)
    ]
    if not chosen:
        raise BiogripError("design: no case has a block `design`; see docs/design.md.")
    return chosen
