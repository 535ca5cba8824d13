"""The reference of the configuration is the schema's own words."""

from pathlib import Path

from snakewalk.config.document import reference
from snakewalk.config.run import RunConfig

PAGE = Path(__file__).parents[2] / "docs" / "configuration.md"


def test_the_page_says_what_the_schema_says() -> None:
    written = PAGE.read_text(encoding="utf-8")
    assert written == reference(), (
        "run: python -m snakewalk.config.document > docs/configuration.md"
    )


def test_numbers_of_a_list_are_told_in_words() -> None:
    row = next(line for line in reference().splitlines() if line.startswith("| `start_m` |"))
    assert "| [number (≥ -1000, ≤ 1000), number (≥ -1000, ≤ 1000)] |" in row
    assert "Annotated" not in reference()


def test_every_key_of_a_run_has_its_line_or_its_table() -> None:
    text = reference()
    for name in RunConfig.model_fields:
        assert f"| `{name}` |" in text or f"## Run: `[{name}]`" in text
