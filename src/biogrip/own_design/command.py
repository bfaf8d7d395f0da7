"""The command ``biogrip design``."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import chain
from pathlib import Path

from biogrip.errors import BiogripError, nearest
from biogrip.files import refuse_inputs, write_text
from biogrip.own_design.as_config import as_config, of_set, of_sets
from biogrip.own_design.at_a_price import several_of
from biogrip.own_design.designed import designed, in_words, percent
from biogrip.own_design.earlier import Recorded, estimate_from_recordings
from biogrip.own_design.export import check_export, check_limits, export_paths, write_export
from biogrip.own_traces.outputs import check_output
from biogrip.own_traces.read_as import ReadAs
from biogrip.progress import Progress
from biogrip.study.defaults import default_config
from biogrip.study.load import load_study, read_configs
from biogrip.study.study import Case
from biogrip.terminal import visible_lines


def design(
    configs: Sequence[Path],
    names: Sequence[str],
    output: Path,
    *,
    after: Sequence[Sequence[Path]],
    read_as: ReadAs,
    export: Path | None,
    force: bool,
) -> None:
    """Design the experiments of cases, write them as a config and as a page, and print them.

    Parameters
    ----------
    configs
        YAML files merged over the default study; they have a block `design`.
    names
        Names of cases; by default all that have such a block.
    output
        YAML file to write; the page is beside it, and so are `_1`, `_2` ... of the experiments of a
        chosen set.
    after
        Earlier traces of the sample in experimental order: each a CSV file and, if recorded under
        another config, YAML files to merge over that of `configs`.
    read_as
        Options for reading these files.
    export
        Folder for what a generator and a camera take, made where it is not there.
    force
        If true, replace even files that biogrip did not write.

    Raises
    ------
    BiogripError
        If an option, config or trace cannot be used, or no design is found, or one to export
        exceeds a limit of the config.
    """
    files = [default_config(), *configs]
    study = load_study(read_configs(files), files, for_workflow=False)
    chosen = _chosen(study.cases, names)
    page = output.with_suffix(".html")
    if page == output:
        raise BiogripError(f"{output}: allowed is the name of a YAML file; the page is beside it.")
    if after and len(chosen) > 1:
        raise BiogripError("--after: allowed with one case only; choose it with --case.")
    if after and any(case.block.design and case.block.design.price for case in chosen):
        text = "design.price: is for cells of which there is no trace yet; leave it out with "
        raise BiogripError(f"{text}--after.")
    for case in chosen if after else []:
        if case.block.design and case.block.design.noise and case.block.design.noise.has_memory:
            raise BiogripError(
                "--after: takes noise for white; allowed is a block `design` whose noise has no "
                "ar1 and no flicker."
            )
    if read_as != ReadAs() and not after:
        raise BiogripError("found options of a trace, allowed are these with --after only.")
    numbers = range(1, _most(chosen) + 1)
    numbered = [output.with_stem(f"{output.stem}_{number}") for number in numbers]
    exported = (
        [path for number in (0, *numbers) for path in export_paths(export, chosen, number)]
        if export
        else []
    )
    if output in exported:
        raise BiogripError(f"{output}: is a file of --export, too; allowed is another name.")
    refuse_inputs([output, page, *numbered, *exported], [*configs, *chain.from_iterable(after)])
    for path in (output, page, *numbered):
        check_output(path, force=force)
    if export:
        check_export(export, exported, force=force)
    found = []
    with Progress("designs", len(chosen), live=True) as progress:
        for case in chosen:
            traces = [_recorded(files, own, case.name) for own in after]
            earlier = (
                estimate_from_recordings(traces, read_as, study.study_seed) if traces else None
            )

            def tried(count: int, bound: float, title: str = case.title) -> None:
                progress.doing(f"{title}: {count} candidates tried, bound {percent(bound)}")

            one = designed(case, study.study_seed, tried, earlier)

            def grouped(count: int, many: int, title: str = case.title) -> None:
                progress.doing(f"{title}: {count} of {many} groups of experiments designed")

            several = several_of(case, one.inputs, study.study_seed, grouped)
            found.append(replace(one, several=several))
            for each in [found[-1], *of_set(found[-1])] if export else []:
                check_limits(each)
            progress.done()
    # Imported lazily: Matplotlib takes a second.
    from biogrip.own_design.page import write_page

    write_text(output, as_config(found))
    written = [output, page]
    for path, own in zip(numbered, of_sets(found), strict=False):
        write_text(path, as_config(own))
        written.append(path)
    write_page(found, page)
    if export:
        for each in chain(found, *map(of_set, found)):
            written += write_export(each, export)
    print(visible_lines("\n".join(map(in_words, found))))
    print(visible_lines(f"Written to {', '.join(map(str, written))}."))
    if left := [path for path in (*numbered, *exported) if path not in written and path.exists()]:
        print(visible_lines(f"Of an earlier set: {', '.join(map(str, left))}."))


def _most(chosen: Sequence[Case]) -> int:
    """Return the largest number of different experiments with a cell, if they have a price."""
    blocks = [case.block.design for case in chosen]
    return max(block.price.experiments if block and block.price else 0 for block in blocks)


def _recorded(files: Sequence[Path], own: Sequence[Path], name: str) -> Recorded:
    """Return a trace's file with the case that describes how it was recorded."""
    trace, *over = own
    laid = [*files, *over]
    return Recorded(load_study(read_configs(laid), laid, for_workflow=False).cases[name], trace)


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
