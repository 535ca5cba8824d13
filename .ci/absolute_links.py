"""Print the README with absolute links, as a package index shows it.

python .ci/absolute_links.py README.md    # the address: Source of [project.urls], pyproject.toml
"""

import re
import sys
import tomllib
from pathlib import Path

PICTURES = (".webp", ".jpg", ".png", ".svg")
LINK = re.compile(
    r"""(?<=\]\()(?:(?:docs|examples)/[^)\s]+|CONTRIBUTING\.md)|(?<=src=")docs/[^"]+"""
)


def absolute(text: str, source_url: str) -> str:
    """Return the text with each relative link below ``source_url``; pictures as raw files."""

    def whole(link: re.Match[str]) -> str:
        kind = "raw" if link[0].endswith(PICTURES) else "blob"
        return f"{source_url.rstrip('/')}/{kind}/HEAD/{link[0]}"

    return LINK.sub(whole, text)


def main() -> None:
    """Print the file that is named."""
    text = Path(sys.argv[1]).read_text(encoding="utf-8")
    project = tomllib.loads(Path("pyproject.toml").read_text(encoding="utf-8"))["project"]
    source_url = project.get("urls", {}).get("Source", "")
    sys.stdout.write(absolute(text, source_url) if source_url else text)


if __name__ == "__main__":
    main()
