"""Links of the README on a package index."""

import importlib.util
import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def test_every_link_of_the_readme_is_absolute_on_an_index() -> None:
    spec = importlib.util.spec_from_file_location("absolute_links", ROOT / ".ci/absolute_links.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    text = module.absolute(readme, "https://example.org/robot/")
    links = re.findall(r'\]\(([^)]+)\)|src="([^"]+)"', text)
    addresses = [one or other for one, other in links]
    assert len(addresses) > 10
    start = "https://example.org/robot/"
    assert all(one.startswith(start) for one in addresses)
    pictures = [one for one in addresses if one.endswith((".jpg", ".webp"))]
    assert len(pictures) > 6
    for one in addresses:
        kind, path = one.removeprefix(start).split("/HEAD/")
        assert kind == ("raw" if one in pictures else "blob")
        assert (ROOT / path.partition("#")[0]).is_file()


def test_pictures_of_the_entry_points_are_small() -> None:
    pictures = list((ROOT / "docs/pictures/entry").glob("*.jpg"))
    assert len(pictures) == 7
    assert max(one.stat().st_size for one in pictures) < 60_000
