"""Draw which rules read what others make, as far as others between them do not say it already."""

import re
import subprocess
import sys
from pathlib import Path

import networkx as nx
from grandalf.graphs import Edge, Graph, Vertex
from grandalf.layouts import SugiyamaLayout, VertexViewer
from grandalf.routing import EdgeViewer
from matplotlib.figure import Figure

from biogrip.figures.style import BLACK, GREY, save_png, styled
from biogrip.stages.job import logged


class Bends(EdgeViewer):
    """The points that a line passes."""

    def setpath(self, points):
        """Keep the points."""
        self.points = points


with logged(snakemake):
    params = snakemake.params
    command = [sys.executable, "-m", "snakemake", "-s", params.snakefile, params.target]
    dot = subprocess.run([*command, "--rulegraph"], check=True, capture_output=True, text=True)
    names = dict(re.findall(r'(\d+)\[label = "(\w+)"', dot.stdout))
    reads = sorted((names[a], names[b]) for a, b in re.findall(r"(\d+) -> (\d+)", dot.stdout))
    rules = {name: Vertex(name) for name in sorted(names.values())}
    for rule in rules.values():
        # Turned: from left to right, as high as a line of text and as wide as the longest name.
        rule.view = VertexViewer(w=14, h=80)
    shown = sorted(nx.transitive_reduction(nx.DiGraph(reads)).edges)
    edges = [Edge(rules[a], rules[b]) for a, b in shown]
    for edge in edges:
        edge.view = Bends()
    graph = Graph(list(rules.values()), edges).C[0]
    layout = SugiyamaLayout(graph)
    layout.route_edge = lambda edge, points: None
    layout.xspace, layout.yspace = 12, 20
    layout.init_all()
    layout.draw(10)
    with styled():
        drawn = Figure((7.2, 2.0))
        axes = drawn.add_axes((0.05, 0.05, 0.9, 0.9))
        axes.axis("off")
        for edge in edges:
            across, along = zip(*edge.view.points, strict=True)
            axes.plot(along, across, color=GREY, zorder=1)
        box = {"boxstyle": "round", "facecolor": "white", "edgecolor": BLACK}
        for name, rule in rules.items():
            across, along = rule.view.xy
            axes.text(along, across, name, ha="center", va="center", bbox=box, fontsize=7)
        save_png(drawn, Path(snakemake.output[0]))
