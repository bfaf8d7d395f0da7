"""What is declared: every product once, told apart by its settings, in commands of any length."""

import os
import re
import subprocess
import sys
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import fields, is_dataclass, replace
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

import biogrip
from biogrip.errors import BiogripError
from biogrip.page import page
from biogrip.products.catalogue import chosen, products
from biogrip.products.digest import digest
from biogrip.products.product import Product
from biogrip.products.uses import Used, using
from biogrip.running.rules import ProductRule, files_of, make_rules
from biogrip.study.source import overlaid, read_config
from tests.helpers.default import STUDY, plan_of
from tests.helpers.places import ROOT

EVERYTHING = """
cases:
  sized:
    sample: {model: liquid_drop, k: 1.0, k_p: 0.1, c: 10.0, size_m: 60e-6}
  uneven:
    sample: {model: burgers, k_s: 3.0, c_s: 200.0, k_v: 2.0, c_v: 40.0}
    measurement: {times_s: [0.1, 0.3, 1, 3, 9, 20, 50, 100, 200, 201, 220, 250, 400]}
    fixed: {c_s: 200.0}
  calibrated:
    sample: {model: liquid_drop, k: 1.0, k_p: 0.1, c: 10.0}
    assumed_gripper: calibrated
  recorded:
    sample: {model: generalized_maxwell}
    measurement: {file: data/example_trace.csv, time: time_s, rotation: rotation_rad}
"""
OVERLAYS = [
    (file.name,) for file in sorted((ROOT / "config").glob("*.yaml")) if file.name != "config.yaml"
]
ROBUSTNESS = (ROOT / "config" / "robustness.yaml").read_text()


@pytest.fixture
def everything(monkeypatch: pytest.MonkeyPatch) -> list[ProductRule]:
    """Sheets of the default study, its sweeps, and a case of every kind."""
    monkeypatch.chdir(ROOT)
    return make_rules(products().values(), plan_of(ROBUSTNESS + EVERYTHING))


def test_every_module_that_declares_something_is_found() -> None:
    """Its source is the independent count."""
    (folder,) = map(Path, biogrip.__path__)
    declare = re.compile(r"(?<!\.)\b(Product|table|drawing)\(\n")
    declared = {
        ".".join((biogrip.__name__, *file.relative_to(folder).with_suffix("").parts))
        for file in folder.rglob("*.py")
        if file.name != "declared.py" and declare.search(file.read_text(encoding="utf-8"))
    }
    assert len(declared) > 25
    assert {product.module for product in products().values()} == declared
    assert [name for name, product in products().items() if name != product.name] == []


def test_every_product_is_found_by_its_name_alone() -> None:
    for name, product in products().items():
        assert chosen([name]) == [product]
    with pytest.raises(BiogripError, match=r"no product 'fti'\. Did you mean 'fit'\? Allowed: "):
        chosen(["fit", "fti"])


def test_every_file_is_written_by_one_product_only(everything: list[ProductRule]) -> None:
    patterns = Counter(p for product in products().values() for p in product.writes.values())
    assert [pattern for pattern, count in patterns.items() if count > 1] == []
    files = Counter(files_of(everything))
    assert [file for file, count in files.items() if count > 1] == []
    # And no pattern could be filled in to be another's file.
    for rule in everything:
        for pattern in rule.outputs.values():
            parts = re.split(r"{(\w+)}", pattern)
            filled = [
                f"({rule.constraints[part]})" if odd % 2 else re.escape(part)
                for odd, part in enumerate(parts)
            ]
            own = set(files_of([rule]))
            fits = {file for file in files if re.fullmatch("".join(filled), file)}
            assert fits <= own, pattern


def test_what_is_read_is_written_by_another_or_the_user_s(everything: list[ProductRule]) -> None:
    written = set(files_of(everything))
    for rule in everything:
        for product in rule.products:
            for job in product.jobs(rule.plan):
                for read in product.inputs(rule.plan, job).values():
                    assert set(read) - written <= {"data/example_trace.csv"}, (product.name, job)


def test_the_sheets_make_every_job_of_every_product_once(everything: list[ProductRule]) -> None:
    """One command makes them, for one of the sheet's jobs."""
    for product in products().values():
        rules = [rule for rule in everything if product in rule.products]
        made = [dict(job) for rule in rules for job in rule.jobs]
        plan = everything[0].plan
        assert sorted(made, key=str) == sorted(map(dict, product.jobs(plan)), key=str), product.name


def test_a_table_or_figure_is_named_as_its_file() -> None:
    """With what it is of, or that it is a figure, where another has the file's name."""
    for product in products().values():
        if product.category in ("Tables", "Figures"):
            stem = Path(product.writes.get("csv") or product.writes["png"]).stem.split("_{")[0]
            assert product.name in (stem, f"{stem}_of_case", f"{stem}_figure")


def test_the_page_names_the_rule_that_makes_each_file(everything: list[ProductRule]) -> None:
    """Cases have not all the same figures, so there are several rules of a sheet."""
    rules = {
        pattern.format(**job): rule.name
        for rule in everything
        for job in rule.jobs
        for pattern in rule.outputs.values()
    }
    shown = page.content(everything[0].plan.study, {})
    entries = (*shown.figures, *shown.tables)
    assert {entry.file: entry.rule for entry in entries} == {e.file: rules[e.file] for e in entries}
    assert {"case_figures", "case_figures_2"} < {entry.rule for entry in entries}


@pytest.mark.parametrize("overlay", OVERLAYS, ids=" ".join)
def test_every_overlay_is_planned(
    overlay: tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    """With the products that it alone asks for, and what each of their jobs depends on."""
    monkeypatch.chdir(ROOT)
    over: dict[str, Any] = {}
    for name in overlay:
        over = overlaid(over, read_config(ROOT / "config" / name))
    rules = make_rules(products().values(), plan_of(yaml.safe_dump(over)))
    told_apart = [rule.digest(job) for rule in rules for job in rule.jobs]
    assert len(set(told_apart)) > 10


def test_no_command_nor_parameter_is_long(everything: list[ProductRule]) -> None:
    """However many cases, seeds and points there are."""
    for rule in everything:
        for job in rule.jobs:
            assert len(f"biogrip make {rule.command(job)} 2> {rule.log.format(**job)}") <= 300
            assert len(rule.digest(job)) <= 300


def changed(value: Any) -> Iterator[Any]:
    """The same with one thing in it changed, for everything in it."""
    if is_dataclass(value) and not isinstance(value, type):
        for field in fields(value):
            if field.init:
                for other in changed(getattr(value, field.name)):
                    yield replace(value, **{field.name: other})
    elif isinstance(value, Used):
        yield from (Used(other) for other in changed(vars(value)))
    elif isinstance(value, Mapping):
        # Where there are many they are all alike.
        for key, inner in islice(value.items(), 5):
            yield {k: v for k, v in value.items() if k != key}
            for other in changed(inner):
                yield {**value, key: other}
    elif isinstance(value, list | tuple):
        for index, inner in enumerate(value[:5]):
            for other in changed(inner):
                yield type(value)([*value[:index], other, *value[index + 1 :]])
        if value:
            yield type(value)(value[:-1])
    elif isinstance(value, bool):
        yield not value
    elif isinstance(value, int):
        yield value + 1
    elif isinstance(value, float):
        yield value * (1 + 1e-6) if value else 1e-300
    elif isinstance(value, str):
        yield f"{value}_"
    elif value is None:
        yield 0.0
    elif not callable(value):
        raise AssertionError(f"{value!r}")


@pytest.mark.nightly
def test_a_digest_changes_with_every_setting(everything: list[ProductRule]) -> None:
    """Of one job of each product: with each field, item and key."""
    for rule in everything:
        for product in rule.products:
            for job in islice(product.jobs(rule.plan), 1):
                settings = product.settings(rule.plan.study, job)
                ours = digest(settings)
                assert ours == digest(product.settings(rule.plan.study, job))
                others = [digest(other) for other in changed(settings)]
                assert ours not in others, product.name
                assert others or not vars(settings)


def test_what_is_not_declared_cannot_be_read() -> None:
    view = using("title study.shown", seeds=lambda _: 3)(STUDY.cases["liquid_drop_2"])
    assert (view.title, view.study.shown, view.seeds) == ("Liquid drop, case 2", "genetic", 3)
    for read in (lambda: view.noise, lambda: view.study.methods, lambda: setattr(view, "seeds", 4)):
        with pytest.raises(AttributeError, match=r"uses: title, study, seeds|uses: shown|config"):
            read()


@pytest.mark.parametrize("wrapped", [float, lambda x: [x], lambda x: {"a": x}, np.array])
def test_a_digest_has_twelve_digits(wrapped: Callable[[float], object]) -> None:
    """What is computed may differ beyond them from one processor to another."""
    ours = digest(Used({"held": wrapped(1.5)}))
    for digits in (3, 6, 9, 11):
        assert digest(Used({"held": wrapped(1.5 * (1 + 10.0**-digits))})) != ours
    for beyond in (1e-13, -1e-13, 3e-14):
        assert digest(Used({"held": wrapped(1.5 * (1 + beyond))})) == ours


def digests() -> str:
    rules = make_rules(products().values(), plan_of())
    return "".join(f"{rule.name} {[*map(rule.digest, rule.jobs)]}\n" for rule in rules)


@pytest.mark.nightly
def test_a_digest_is_the_same_in_every_process() -> None:
    """Whatever order Python keeps sets of text in."""
    seed = "2" if os.environ.get("PYTHONHASHSEED") == "1" else "1"
    found = subprocess.run(
        [sys.executable, "-c", f"from {__name__} import digests; print(digests(), end='')"],
        env={**os.environ, "PYTHONHASHSEED": seed},
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    assert "target" in found
    assert found == digests()


@pytest.mark.parametrize("value", [b"bytes", object(), iter([1])], ids=lambda v: str(type(v)))
def test_a_digest_refuses_what_it_does_not_know(value: object) -> None:
    for settings in (value, [value], {"key": value}, Used({"held": value})):
        with pytest.raises(TypeError, match="settings cannot hold"):
            digest(settings)


def test_a_name_can_be_declared_once_only(monkeypatch: pytest.MonkeyPatch) -> None:
    from biogrip.figures import fit
    from biogrip.tables import errors_of_case

    def draw() -> None:
        """Draw nothing."""

    draw.__module__ = fit.__name__
    second = replace(errors_of_case.ERRORS, make=draw)
    monkeypatch.setattr(fit, "SECOND", second, raising=False)
    with pytest.raises(BiogripError, match=r"declares errors a second time"):
        products.__wrapped__()
    assert isinstance(second, Product)
