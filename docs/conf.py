"""The site: ``make docs`` builds it of these pages by Sphinx, with warnings as errors."""

import re
import sys
from importlib.metadata import version as installed
from pathlib import Path

from pydantic import BaseModel
from sphinx.application import Sphinx

sys.path.insert(0, str(Path(__file__).parent))  # notebook_page, reference_pages
project = "snakewalk"
author = "the authors of snakewalk"
copyright = "Apache-2.0"
version = release = installed("snakewalk")
extensions = [
    "myst_parser",
    "notebook_page",
    "reference_pages",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
]
source_suffix = {".md": "markdown"}
exclude_patterns = ["tables", "decisions"]  # choices of developers stay in the repository
nitpicky = True
nitpick_ignore_regex = [("py:.*", ".*")]  # types of numpy and pydantic, which are no pages here

myst_enable_extensions = ["colon_fence"]
myst_heading_anchors = 3

autodoc_typehints = "description"
autodoc_member_order = "bysource"
autodoc_default_options = {"exclude-members": "model_config, model_post_init"}
napoleon_numpy_docstring = False

highlight_language = "bash"  # of blocks that name no language
html_theme = "furo"
html_title = "snakewalk"
html_show_sphinx = False
html_static_path = ["_static"]
html_css_files = ["site.css"]

PAGES = Path(__file__).parent
DECISION = re.compile(r"\[(decision\s)?([^\]]*)\]\((?:\.\./|docs/)*decisions/(\d{4})-[^)]*\)")


def name_decision(found: re.Match[str]) -> str:
    """Return the number of a decision in place of a link to its file in the repository."""
    if found[1] or found[2].isdigit():
        return f"{found[1] or ''}{found[2]}"
    return f"{found[2]} (decision {int(found[3])})"


def link_pages(app: Sphinx, name: str, source: list[str]) -> None:
    """Make a link of each page that stands in backticks, as one reads it in the repository."""
    source[0] = DECISION.sub(name_decision, source[0])
    if not (PAGES / f"{name}.md").is_file():
        return  # a notebook
    folder = (PAGES / f"{name}.md").parent

    def link(found: re.Match[str]) -> str:
        page = PAGES / found[1]
        if not page.is_file():
            return found[0]
        up = "../" * len(folder.relative_to(PAGES).parts)
        return f"[`{found[1]}`]({up}{found[1]})"

    outside = re.split(r"(^```.*?^```|^    .*?$)", source[0], flags=re.MULTILINE | re.DOTALL)
    source[0] = "".join(
        part if number % 2 else re.sub(r"(?<!\[)`(?:docs/)?([\w/-]+\.md)`", link, part)
        for number, part in enumerate(outside)
    )


def hide_fields(app: Sphinx, kind: str, name: str, what: object, *rest: object) -> object:
    """Leave out the signature of a configuration: its keys are described one by one."""
    if isinstance(what, type) and issubclass(what, BaseModel):
        return "", None
    return None


def setup(app: Sphinx) -> None:
    """Take part in the reading of each page."""
    app.connect("source-read", link_pages)
    app.connect("autodoc-process-signature", hide_fields)
