"""Draw the packages and the imports between them: docs/pictures/layout.svg.

python docs/pictures/tools/layout_diagram.py docs/pictures/layout.svg
"""

import argparse
import ast
from collections import Counter
from pathlib import Path

import matplotlib
import networkx as nx
from matplotlib.axes import Axes
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch, FancyBboxPatch

Point = tuple[float, float]
ROOT = Path(__file__).resolve().parents[3]
COLOURS = {
    "config": "#e9e4f2",
    "drivers": "#dcefe0",
    "sim": "#f6e0e2",
    "controller": "#e2ebf5",
    "feature": "#fbf0d9",
}
JOINS = "run"
"""The controller's package above which only feature packages stand."""
WIDTH, ROW = 1.75, 0.95
"""Distance between columns and rows, in units of the drawing."""


def package_of(module: str) -> str:
    """Return the package of a dotted module without ``snakewalk``."""
    parts = module.split(".")
    return ".".join(parts[:2]) if parts[0] in ("sim", "drivers", "controller") else parts[0]


def measure() -> tuple[Counter[str], nx.DiGraph]:
    """Count the lines of each package, and find the imports between packages."""
    lines: Counter[str] = Counter()
    imports = nx.DiGraph()
    for top in ("config", "drivers", "sim", "controller"):
        for file in sorted((ROOT / top).rglob("*.py")):
            text = file.read_text(encoding="utf-8")
            module = ".".join(file.relative_to(ROOT).with_suffix("").parts)
            package = top if top != "controller" else package_of(module)
            lines[package] += len(text.splitlines())
            for node in ast.walk(ast.parse(text)):
                name = node.module or "" if isinstance(node, ast.ImportFrom) else ""
                if not name.startswith("snakewalk."):
                    continue
                to = name.removeprefix("snakewalk.")
                to = package_of(to) if to.startswith("controller.") else to.split(".")[0]
                if to != package:
                    imports.add_edge(package, to)
    return lines, imports


def places(imports: nx.DiGraph) -> dict[str, Point]:
    """Return a column and a row for each package; an arrow never points upwards."""
    rank: dict[str, int] = {}
    for package in reversed(list(nx.topological_sort(imports))):
        rank[package] = 1 + max((rank[to] for to in imports.successors(package)), default=-1)
    floors: dict[int, list[str]] = {}
    for package, floor in rank.items():
        floors.setdefault(floor, []).append(package)
    found: dict[str, Point] = {}
    for floor in sorted(floors):
        row = sorted(floors[floor], key=lambda p: _middle(found, imports, p))
        for column, package in enumerate(row):
            found[package] = ((column - (len(row) - 1) / 2) * WIDTH, floor * ROW)
    return found


def _middle(found: dict[str, Point], imports: nx.DiGraph, package: str) -> tuple[float, str]:
    below = [found[to][0] for to in imports.successors(package) if to in found]
    return (sum(below) / len(below) if below else 0.0, package)


def draw(axes: Axes, lines: Counter[str], imports: nx.DiGraph) -> None:
    """Draw the packages, and the imports that no longer chain of imports implies."""
    grey, dark = "#a3adb8", "#5d6873"
    at = places(imports)
    for a, b in nx.transitive_reduction(imports).edges:
        (u, v), (w, z) = at[a], at[b]
        axes.add_patch(
            FancyArrowPatch(
                (u, v - 0.25), (w, z + 0.25), arrowstyle="-|>", mutation_scale=8, color=grey, lw=0.8
            )
        )
    joins = at[f"controller.{JOINS}"][1]
    for package, (x, y) in at.items():
        kind = package.split(".")[0]
        colour = COLOURS["feature" if kind == "controller" and y > joins else kind]
        box = FancyBboxPatch(
            (x - 0.68, y - 0.2), 1.36, 0.4, "round,pad=0.03", fc=colour, ec=dark, lw=0.8
        )
        axes.add_patch(box)
        name = package.removeprefix("controller.")
        axes.text(x, y + 0.06, name, ha="center", va="center", fontsize=10)
        axes.text(x, y - 0.12, f"{lines[package]:,} lines", ha="center", va="center", fontsize=7)
    columns, rows = zip(*at.values(), strict=True)
    axes.set_xlim(min(columns) - 1.0, max(columns) + 1.0)
    axes.set_ylim(min(rows) - 0.5, max(rows) + 0.5)


def main() -> None:
    """Draw to the file that is named."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("file", type=Path)
    file = options.parse_args().file
    figure = Figure(figsize=(13, 11), layout="tight")
    FigureCanvasSVG(figure)
    axes = figure.add_subplot()
    axes.set_axis_off()
    draw(axes, *measure())
    with matplotlib.rc_context({"svg.hashsalt": "layout", "svg.fonttype": "none"}):
        figure.savefig(file, metadata={"Date": None} if file.suffix == ".svg" else None)


if __name__ == "__main__":
    main()
