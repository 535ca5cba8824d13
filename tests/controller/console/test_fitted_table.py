"""Tables at the width of a screen: no word is cut, whatever their columns."""

import io

import pytest
from rich.table import Table

from snakewalk.controller.console.plain_console import PlainConsole


def shown(table: Table, width: int) -> str:
    file = io.StringIO()
    PlainConsole(file=file, width=width, highlight=False).print(table)
    return file.getvalue()


def table_of(columns: int, word: str) -> Table:
    table = Table("run", *(f"number {n}" for n in range(columns)), box=None)
    for row in range(2):
        table.add_row(word, *(f"{100 * row + n}.25" for n in range(columns)))
    return table


@pytest.mark.parametrize("columns", [1, 5, 9, 12, 30])
@pytest.mark.parametrize("word", ["flat", "jacksboro-traverse", "a sentence of several words"])
def test_no_word_is_cut_at_80_columns(columns: int, word: str) -> None:
    text = shown(table_of(columns, word), 80)
    assert max(map(len, text.splitlines())) <= 80
    assert "\N{HORIZONTAL ELLIPSIS}" not in text
    words = text.split()
    assert words.count(word.rsplit(maxsplit=1)[-1]) == 2
    assert [
        n for row in range(2) for n in range(columns) if f"{100 * row + n}.25" not in words
    ] == []


def test_a_table_that_fits_is_not_changed() -> None:
    table = Table("run", "seed", box=None)
    table.add_row("flat", "1")
    assert shown(table, 80) == " run   seed \n flat  1    \n"


def test_a_row_with_too_many_columns_is_a_block_with_its_headings() -> None:
    lines = shown(table_of(30, "flat"), 80).splitlines()
    assert lines[0].split() == ["run", "flat"]
    assert lines[30].split() == ["number", "29", "29.25"]
    assert [line.split()[0] for line in lines if line.strip()].count("run") == 2


def test_a_column_of_sentences_is_no_tower_of_words() -> None:
    table = Table(*"abcdefg", box=None)
    table.add_row(*["12345678901"] * 6, "a sentence of several words")
    assert "a sentence of several words\n" in shown(table, 80).replace("  ", "")
