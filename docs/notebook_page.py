"""Pages of notebooks: each build of the site executes the cells and shows their output.

``python docs/notebook_page.py FILE.ipynb`` executes a notebook and prints its page.
"""

import ast
import contextlib
import io
import json
import os
import sys
from pathlib import Path
from typing import Any, Final

from docutils import nodes
from matplotlib.figure import Figure
from myst_parser.parsers.sphinx_ import MystParser
from sphinx.application import Sphinx

PICTURES: Final = Path(__file__).resolve().parents[1] / "build" / "notebooks"
"""Folder of the pictures that cells draw."""


class NotebookParser(MystParser):
    """Parse an executed notebook as a Markdown page."""

    supported = ("notebook",)

    def parse(self, inputstring: str, document: nodes.document) -> None:
        """Execute the notebook and parse its page."""
        super().parse(page_of(inputstring, Path(document["source"])), document)


def page_of(notebook: str, file: Path) -> str:
    """Execute all cells in one namespace and return the page as Markdown.

    Errors of a cell end the execution, and so the build.
    """
    names: dict[str, Any] = {"__name__": "__main__"}
    parts: list[str] = []
    for number, cell in enumerate(json.loads(notebook)["cells"]):
        source = "".join(cell["source"])
        if cell["cell_type"] == "markdown":
            parts.append(source)
            continue
        printed, value = _executed(source, names, f"{file.name}, cell {number}")
        parts.append(f"```python\n{source}\n```")
        if isinstance(value, Figure):
            PICTURES.mkdir(parents=True, exist_ok=True)
            picture = PICTURES / f"{file.stem}-{number}.png"
            value.savefig(picture, dpi=100)
            place = os.path.relpath(picture, file.parent)
            parts.append(f"![Output of the cell above]({place})")
        elif value is not None:
            printed += f"{value!r}\n"
        if printed:
            parts.append(f"```text\n{printed.rstrip()}\n```")
    return "\n\n".join(parts) + "\n"


def _executed(source: str, names: dict[str, Any], where: str) -> tuple[str, object]:
    """Execute a cell; return its printed text, and the value of a last expression."""
    tree = ast.parse(source, where)
    last = tree.body.pop() if tree.body and isinstance(tree.body[-1], ast.Expr) else None
    with contextlib.redirect_stdout(io.StringIO()) as printed:
        exec(compile(tree, where, "exec"), names)
        value = None
        if isinstance(last, ast.Expr):
            value = eval(compile(ast.Expression(last.value), where, "eval"), names)
    return printed.getvalue(), value


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the parser; pages may be read by several processes."""
    app.add_source_suffix(".ipynb", "notebook")
    app.add_source_parser(NotebookParser)
    return {"parallel_read_safe": True}


if __name__ == "__main__":
    path = Path(sys.argv[1]).resolve()
    sys.stdout.write(page_of(path.read_text(encoding="utf-8"), path))
