"""The page of the layout names all packages in their order, and files that exist."""

import ast
import re
from pathlib import Path

import pytest

from tests.architecture.layout import ORDER

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
LONGEST = {
    "From a shape's coefficients to a joint goal": 12,
    "From radians to bytes": 8,
    "From bytes to radians": 8,
    "A servo's fault, from its cause to the report": 10,
    "`snakewalk run`, from the command to the loop": 15,
}


def ways() -> dict[str, list[tuple[str, str]]]:
    """(file, name) of each step, by heading."""
    sections = re.findall(r"^### (.+)\n((?:.*\n)*?)(?=^#|\Z)", PAGE, re.MULTILINE)
    step = re.compile(r"^\d+\. `([\w/]+\.py)`: `(\w+)`", re.MULTILINE)
    return {heading: step.findall(text) for heading, text in sections}


def names_in(path: Path) -> set[str]:
    """Functions, classes, methods and constants that a file defines."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    found: set[str] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            found.add(node.name)
        elif isinstance(node, ast.Assign):
            found |= {target.id for target in node.targets if isinstance(target, ast.Name)}
    return found


def test_every_package_is_there_in_the_order_of_imports() -> None:
    rows = re.findall(r"^\| `([\w/]+)` \| ", PAGE, re.MULTILINE)
    packages = [each.replace(".", "/") for inner in ORDER.values() for each in inner]
    tops = [top for top in ORDER if top not in packages]
    assert [each for each in rows if each not in tops] == packages


@pytest.mark.parametrize("heading", LONGEST)
def test_a_way_of_data_is_short_and_true(heading: str) -> None:
    steps = ways()[heading]
    assert len({file for file, _ in steps}) <= LONGEST[heading]
    wrong = [
        (file, name)
        for file, name in steps
        if not (ROOT / file).is_file() or name not in names_in(ROOT / file)
    ]
    assert wrong == []


def test_every_file_named_on_the_page_exists() -> None:
    named = re.findall(r"`((?:config|drivers|sim|controller|tests)/[\w/]+\.py)`", PAGE)
    assert [file for file in named if not (ROOT / file).is_file()] == []


def test_no_way_is_left_unchecked() -> None:
    assert set(ways()) == set(LONGEST)


def test_every_package_says_in_a_sentence_what_it_is() -> None:
    purposes = {
        file.parent.relative_to(ROOT): str(ast.get_docstring(ast.parse(file.read_text())))
        for top in ORDER
        for file in (ROOT / top).rglob("__init__.py")
    }
    assert {each for each, says in purposes.items() if len(says.split()) < 5} == set()
