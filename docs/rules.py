"""Draw which rules read what others make, as far as others between do not say it: `make docs`."""

import re
import subprocess
import sys
from pathlib import Path

import networkx as nx
import numpy as np
from matplotlib.figure import Figure

from biogrip.figures.style import BLACK, GREY, save_png, styled

# Sweeps over the columns, after which no row changes any more.
SWEEPS = 20


def lay_out(graph):
    """Place rules in columns, each behind all that it reads from; lines have a point in each.

    A point's row in its column is that of the mean of its neighbours. The same graph is always
    laid out in the same way: what is equal is sorted by its name.
    """
    columns = [sorted(column) for column in nx.topological_generations(graph)]
    column_of = {rule: index for index, column in enumerate(columns) for rule in column}
    lines = []
    for first, last in sorted(graph.edges):
        passed = range(column_of[first] + 1, column_of[last])
        points = {index: f"{first} {last} {index}" for index in passed}
        for index, point in points.items():
            columns[index].append(point)
        lines.append([first, *points.values(), last])
    beside = nx.Graph()
    for line in lines:
        nx.add_path(beside, line)
    place = {}
    for sweep in range(SWEEPS):
        for index, column in list(enumerate(columns))[:: 1 if sweep % 2 == 0 else -1]:
            means = {it: np.mean([place.get(o, (0, 0))[1] for o in beside[it]]) for it in column}
            for row, point in enumerate(sorted(column, key=lambda it: (means[it], it))):
                place[point] = index, row - (len(column) - 1) / 2
    return place, lines


snakefile = Path(__file__).parents[1] / "Snakefile"
command = [sys.executable, "-m", "snakemake", "-s", snakefile, "results/report.html"]
dot = subprocess.run([*command, "--rulegraph"], check=True, capture_output=True, text=True)
names = dict(re.findall(r'(\d+)\[label = "(\w+)"', dot.stdout))
reads = [(names[a], names[b]) for a, b in re.findall(r"(\d+) -> (\d+)", dot.stdout)]
place, lines = lay_out(nx.transitive_reduction(nx.DiGraph(sorted(reads))))
with styled():
    drawn = Figure((7.2, 2.9))
    axes = drawn.add_axes((0.05, 0.05, 0.9, 0.9))
    axes.axis("off")
    for line in lines:
        axes.plot(*zip(*(place[point] for point in line), strict=True), color=GREY, zorder=1)
    box = {"boxstyle": "round", "facecolor": "white", "edgecolor": BLACK}
    for name in sorted(names.values()):
        axes.text(*place[name], name, ha="center", va="center", bbox=box, fontsize=7)
    save_png(drawn, Path(sys.argv[1]))
