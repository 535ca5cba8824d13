"""Names: one class a name, and none of the words that gave way to the field's."""

from collections import defaultdict

from tests.architecture.test_layout import sources

_WORDS = """
agenda alive arrivals climb coming_to_rest company debts easing express eyes faint footing
glimpse habit hear heard hillside hottest_c house jam judged laid learn listen look_again loops
most_a nap news occupy oldest orders owe path_laid paths_laid_again put readout relay say
service sins softness sound speak strangers surroundings tell told unlike usable voices wanted
way whole_file wish
"""
RETIRED = frozenset(_WORDS.split())
"""Words of the project's own that stood where the field has a term; docs/glossary.md has the terms.

Not here are words that are also right somewhere: effort and overlay, a verdict and a note of the
log, the turn of a heading, the eye of a snake, the pulse of [PT].
"""


def test_no_name_is_a_retired_word() -> None:
    found = [
        f"{module}:{line}: {name}"
        for module, source in sources().items()
        for name, line in source.defined
        if name.strip("_").lower() in RETIRED
    ]
    assert not found, "\n".join(found)


def test_no_class_name_is_defined_in_two_files() -> None:
    files: dict[str, set[str]] = defaultdict(set)
    for module, source in sources().items():
        for name in source.classes:
            if not name.startswith("_"):
                files[name].add(module)
    assert not {name: sorted(of) for name, of in files.items() if len(of) > 1}
