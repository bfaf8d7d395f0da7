"""Draw which rules read what others make, as far as others between them do not say it already."""

import re
import subprocess
import sys
from itertools import pairwise
from pathlib import Path
from statistics import fmean

from matplotlib.figure import Figure

from biogrip.figures.style import BLACK, GREY, save_png, styled
from biogrip.stages.job import logged

PAGE = "results/report.html"


def graph(snakefile):
    """Return the rules that each rule reads from, by name."""
    command = [sys.executable, "-m", "snakemake", "--snakefile", snakefile, PAGE, "--rulegraph"]
    dot = subprocess.run(command, check=True, stdout=subprocess.PIPE, stderr=sys.stderr, text=True)
    rules = dict(re.findall(r'(\d+)\[label = "(\w+)"', dot.stdout))
    edges = re.findall(r"(\d+) -> (\d+)", dot.stdout)
    reads = {rules[n]: {rules[a] for a, b in edges if b == n} for n in rules}
    return dict(sorted(reads.items()))


def before(rule, reads):
    """Return all rules that a rule needs."""
    return set().union(reads[rule], *(before(other, reads) for other in reads[rule]))


def layers(reads):
    """Return rules, and the bends of edges, in columns; and each edge as the points it passes."""
    column = {}
    for rule in sorted(reads, key=lambda rule: len(before(rule, reads))):
        column[rule] = max((column[other] + 1 for other in reads[rule]), default=0)
    for rule in (rule for rule in reads if not reads[rule]):
        column[rule] = min(column[other] - 1 for other in reads if rule in reads[other])
    columns = [[r for r in reads if column[r] == n] for n in range(max(column.values()) + 1)]
    edges = []
    for rule in reads:
        for other in sorted(reads[rule]):
            bends = [(other, rule, n) for n in range(column[other] + 1, column[rule])]
            for bend in bends:
                columns[bend[2]].append(bend)
            edges.append([other, *bends, rule])
    return columns, edges


def heights(columns, edges):
    """Return the height of each rule and bend, close to that of its neighbours."""
    joined = [pair for edge in edges for pair in pairwise(edge)]
    y = {item: n - (len(items) - 1) / 2 for items in columns for n, item in enumerate(items)}
    for turn in range(40):
        for items in columns if turn % 2 else reversed(columns):
            side = {i: [y[a if b == i else b] for a, b in joined if i in (a, b)] for i in items}
            items.sort(key=lambda item: fmean(side[item]))
            y |= {item: n - (len(items) - 1) / 2 for n, item in enumerate(items)}
    return y


with logged(snakemake):
    reads = graph(snakemake.params.snakefile)
    needed = {rule: set().union(*(before(r, reads) for r in reads[rule])) for rule in reads}
    columns, edges = layers({rule: reads[rule] - needed[rule] for rule in reads})
    y = heights(columns, edges)
    place = {item: (n, y[item]) for n, items in enumerate(columns) for item in items}
    with styled():
        drawn = Figure((7.2, 1.9))
        axes = drawn.add_axes((0.04, 0.08, 0.92, 0.84))
        axes.axis("off")
        for edge in edges:
            axes.plot(*zip(*(place[item] for item in edge), strict=True), color=GREY, zorder=1)
        box = {"boxstyle": "round", "facecolor": "white", "edgecolor": BLACK}
        for rule in reads:
            axes.text(*place[rule], rule, ha="center", va="center", bbox=box)
        save_png(drawn, Path(snakemake.output[0]))
