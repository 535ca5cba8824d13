"""Names of the code."""

from collections import defaultdict

import pytest

from tests.architecture.imports import sources

pytestmark = pytest.mark.costs("reads every source file")


def test_no_public_class_name_is_defined_in_two_files() -> None:
    files: dict[str, set[str]] = defaultdict(set)
    for module, source in sources().items():
        for name in source.classes:
            if not name.startswith("_"):
                files[name].add(module)
    assert not {name: sorted(of) for name, of in files.items() if len(of) > 1}
