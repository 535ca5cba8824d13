"""The manifests list what the packages declare, and every listed plug-in exists."""

from pathlib import Path

import pytest

from snakewalk.controller.console.plugins import builtin_plugins
from tests.architecture.manifests import packages, text


@pytest.mark.parametrize("package", packages(), ids=lambda package: package.name)
def test_a_manifest_is_as_generated(package: Path) -> None:
    file = package / "manifest.py"
    written = file.read_text(encoding="utf-8") if file.exists() else ""
    assert written == text(package), "run: python -m tests.architecture.manifests"


def test_no_plug_in_is_listed_twice() -> None:
    listed = [(each.kind, each.name) for each in builtin_plugins()]
    assert len(listed) == len(set(listed))


def test_every_plug_in_says_what_it_is() -> None:
    assert [each.name for each in builtin_plugins() if not each.help.endswith(".")] == []
