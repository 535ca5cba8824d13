"""Draw the rooms of the code and the imports between them: docs/pictures/rooms.svg.

python docs/pictures/tools/rooms.py docs/pictures/rooms.svg
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
from matplotlib.patches import FancyArrowPatch, FancyBboxPatch, Rectangle

Point = tuple[float, float]
ROOT = Path(__file__).resolve().parents[3]
COLOURS = {"config": "#e9e4f2", "drivers": "#dcefe0", "sim": "#f6e0e2", "controller": "#e2ebf5"}
PLACES = {
    "controller/app": (4.5, 11.4),
    "controller/runtime": (5.6, 10.4),
    "controller/metrics": (1.4, 9.4),
    "controller/repertoire": (4.2, 9.4),
    "controller/walk": (7.4, 9.4),
    "controller/runlog": (1.4, 8.4),
    "controller/motion": (4.6, 8.4),
    "controller/localization": (2.9, 8.4),
    "controller/capture": (2.9, 7.4),
    "controller/gaits": (4.9, 7.4),
    "controller/animal": (6.3, 8.4),
    "controller/mapping": (8.0, 8.4),
    "controller/terrain": (7.9, 6.4),
    "controller/shape": (1.4, 6.4),
    "controller/mechanics": (6.2, 7.4),
    "controller/kinematics": (4.2, 6.4),
    "sim/serve": (0.8, 4.6),
    "sim/rendering": (3.6, 4.6),
    "sim/ax12": (0.8, 3.8),
    "sim/physics": (3.6, 3.0),
    "sim/sniff": (0.8, 3.0),
    "sim/faults": (2.2, 3.8),
    "sim/line": (2.2, 3.0),
    "sim/servo": (2.2, 2.2),
    "sim": (2.2, 1.4),
    "drivers/chain": (6.3, 4.6),
    "drivers/safety": (8.2, 4.6),
    "drivers/bus": (6.3, 3.8),
    "drivers/port": (5.7, 3.0),
    "drivers/protocol": (7.2, 2.2),
    "drivers": (6.4, 1.4),
    "config": (4.5, 0.2),
}
"""Column and floor of each room: nothing points upwards."""
PANELS = {
    "controller": (0.3, 6.0, 8.5, 5.85),
    "sim": (0.05, 1.0, 4.3, 4.15),
    "drivers": (4.95, 1.0, 4.05, 4.15),
}
"""Left, bottom, width and height of a top folder."""
BETWEEN = (
    ((2.2, 6.0), (2.2, 5.15), "only app"),
    ((7.0, 6.0), (7.0, 5.15), "app; the others only the vocabulary"),
    ((4.35, 2.2), (4.95, 2.2), ""),
    ((2.2, 1.0), (4.1, 0.42), ""),
    ((6.9, 1.0), (4.9, 0.42), ""),
)
"""Arrows from folder to folder, and which rooms have them."""


def room_of(module: str) -> str:
    """Return the room of a dotted module without ``snakewalk``."""
    parts = module.split(".")
    name = "/".join(parts[:2])
    return name if name in PLACES else parts[0]


def measure() -> tuple[Counter[str], nx.DiGraph]:
    """Count the lines of each room, and find the imports from room to room."""
    lines: Counter[str] = Counter()
    arrows = nx.DiGraph()
    for top in COLOURS:
        for file in (ROOT / top).rglob("*.py"):
            text = file.read_text(encoding="utf-8")
            room = room_of(".".join(file.relative_to(ROOT).with_suffix("").parts))
            lines[room] += len(text.splitlines())
            for node in ast.walk(ast.parse(text)):
                module = node.module or "" if isinstance(node, ast.ImportFrom) else ""
                to = room_of(module.removeprefix("snakewalk."))
                if module.startswith("snakewalk.") and to != room:
                    arrows.add_edge(room, to)
    return lines, arrows


def draw(axes: Axes, lines: Counter[str], arrows: nx.DiGraph) -> None:
    """Draw folders, rooms, and the imports that no longer chain of imports implies."""
    grey, dark = "#a3adb8", "#5d6873"
    for top, (x, y, width, height) in PANELS.items():
        axes.add_patch(Rectangle((x, y), width, height, fc="#fafbfc", ec="#d5dae0", lw=0.8))
        axes.text(x + 0.08, y + height - 0.08, top, ha="left", va="top", fontsize=10, color=dark)
        inside = arrows.subgraph([room for room in arrows if room.split("/")[0] == top])
        for a, b in nx.transitive_reduction(inside).edges:
            (u, v), (w, z) = PLACES[a], PLACES[b]
            _arrow(axes, (u, v - 0.2), (w, z + 0.2), grey)
    for start, end, text in BETWEEN:
        _arrow(axes, start, end, dark)
        axes.text(start[0] + 0.1, (start[1] + end[1]) / 2, text, va="center", fontsize=8)
    for room, (x, y) in PLACES.items():
        colour = COLOURS[room.split("/")[0]]
        box = FancyBboxPatch(
            (x - 0.56, y - 0.18), 1.12, 0.36, "round,pad=0.03", fc=colour, ec=dark, lw=0.8
        )
        axes.add_patch(box)
        names = {"sim": "plant", "drivers": "vocabulary"}
        name = names.get(room, room.rpartition("/")[2])
        axes.text(x, y + 0.05, name, ha="center", va="center", fontsize=9)
        axes.text(x, y - 0.11, f"{lines[room]:,} lines", ha="center", va="center", fontsize=6.5)


def _arrow(axes: Axes, start: Point, end: Point, colour: str) -> None:
    style = {"arrowstyle": "-|>", "mutation_scale": 8, "color": colour, "lw": 0.8}
    axes.add_patch(FancyArrowPatch(start, end, shrinkA=0, shrinkB=0, **style))


def main() -> None:
    """Draw to the file that is named."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("file", type=Path)
    file = options.parse_args().file
    figure = Figure(figsize=(9.5, 9.5), layout="tight")
    FigureCanvasSVG(figure)
    axes = figure.add_subplot(xlim=(-0.1, 9.1), ylim=(-0.1, 12.0))
    axes.set_axis_off()
    draw(axes, *measure())
    with matplotlib.rc_context({"svg.hashsalt": "rooms", "svg.fonttype": "none"}):
        figure.savefig(file, metadata={"Date": None} if file.suffix == ".svg" else None)


if __name__ == "__main__":
    main()
