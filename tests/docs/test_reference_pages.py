"""The generated reference pages contain every command with its options, and every topic."""

import importlib.util
import re
from pathlib import Path
from types import ModuleType

import pytest

from snakewalk.controller.console.plugins import builtin_plugins
from snakewalk.controller.runlog.column import registered_tables

pytestmark = pytest.mark.costs("makes the reference of all commands")

DOCS = Path(__file__).resolve().parents[2] / "docs"


@pytest.fixture(scope="module")
def pages() -> ModuleType:
    """The extension of the site that fills reference pages."""
    spec = importlib.util.spec_from_file_location("reference_pages", DOCS / "reference_pages.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def filled(pages: ModuleType, name: str) -> str:
    source = [(DOCS / f"{name}.md").read_text(encoding="utf-8")]
    pages.fill(None, name, source)
    return source[0]


def test_each_command_is_on_one_page(pages: ModuleType) -> None:
    text = "".join(filled(pages, name) for name in pages.PAGES)
    found = re.findall(r"^## snakewalk (.*)$", text, re.MULTILINE)
    assert sorted(found) == sorted(
        each.name for each in builtin_plugins() if each.kind == "command"
    )


def test_a_command_has_its_options_and_examples(pages: ModuleType) -> None:
    text = filled(pages, "reference/commands-robot")
    section = text.partition("## snakewalk bus set\n")[2].partition("\n## ")[0]
    assert "| `--new-baud` | `<int>` | new baud rate in bit/s |  |" in section
    assert "| `--id` | `<int>` | ID of the servo, 0 to 252 | required |" in section
    assert "\nsnakewalk bus set --id 7 --return-delay 0 --yes\n" in section
    assert "--log-level" not in section


def test_every_topic_is_on_its_page_with_all_fields(pages: ModuleType) -> None:
    text = filled(pages, "reference/log-topics")
    for table in registered_tables():
        section = text.partition(f"## {table.topic.name}\n")[2].partition("\n## ")[0]
        assert [f"| `{name}` |" in section for name in table.topic.columns] == [True] * len(
            table.topic.columns
        )


def test_an_unknown_command_ends_the_build(pages: ModuleType) -> None:
    with pytest.raises(ValueError, match="no such command"):
        pages.commands("nosuch")
