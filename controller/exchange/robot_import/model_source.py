"""A robot model as XML whose elements know their line in the user's file."""

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from xml.etree import ElementTree as ET
from xml.parsers import expat
from xml.sax.saxutils import quoteattr

from snakewalk.config.archive import read_bytes
from snakewalk.config.errors import InputError

MOST_BYTES = 20_000_000
"""Size of a model's file (ours)."""
MOST_PARTS = 1000
"""Bodies and joints of a model (ours)."""
_DEEPEST_NESTING = 600
"""Depth of elements (ours)."""
_DECLARATION = re.compile(r"^\s*<\?xml[^>]*\?>")
_LINE = re.compile(r"\bline (\d+)")


class LineElement(ET.Element):
    """Element that knows where it begins."""

    file: str = ""
    """Name of the included file; empty in the main one."""
    line: int = 0

    @property
    def where(self) -> str:
        """The place, for messages."""
        return f"{self.file} line {self.line}".strip() if self.line else "a part of the import"


@dataclass(slots=True)
class ModelSource:
    """A model prepared for MuJoCo."""

    root: LineElement
    notes: list[str] = field(default_factory=list)
    """Parts that were dropped or changed."""
    actuated: frozenset[str] | None = None
    """Names of joints with an actuator; None if the file lists no actuators."""
    stated_mass_kg: dict[str, float] | None = None
    """Mass by name of a moving body, for files that must state it (URDF)."""
    massless_geoms: frozenset[str] = frozenset()
    """Names of geoms that are only drawn."""
    part_names: dict[str, str] = field(default_factory=dict)
    """Name of the heaviest part by name of a moving body, of links that are fixed together."""
    effort_n_m: dict[str, float] = field(default_factory=dict)
    """Torque limit that the file states, by joint."""
    speed_rad_s: dict[str, float] = field(default_factory=dict)
    """Speed limit that the file states, by joint."""
    friction: dict[str, float] | None = None
    """Sliding friction by name of a moving body, if the model states it outside the links
    (URDF)."""

    def text(self) -> tuple[str, list[str]]:
        """XML with one start tag in a line, and the user's place of each line."""
        lines: list[str] = []
        places: list[str] = []
        for words, element in _tags(self.root):
            lines.append(words)
            places.append(element.where)
        return "\n".join(lines) + "\n", places


def parse(path: Path, name: str = "", text: str | None = None) -> tuple[LineElement, int]:
    """Root of an XML file, and how many of its bytes are not UTF-8.

    Args:
        path: of the file; named in faults.
        name: to show in places, of an included file.
        text: in place of the file's content.

    Raises:
        InputError: it cannot be read, is no XML, or is nested too deeply.

    """
    try:
        raw = read_bytes(path, MOST_BYTES) if text is None else text.encode()
    except OSError as error:
        raise InputError(f"{path}: {getattr(error, 'strerror', None) or error}") from None
    parser = expat.ParserCreate()
    builder = ET.TreeBuilder(element_factory=LineElement)
    depth = 0

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal depth
        depth += 1
        if depth > _DEEPEST_NESTING:
            raise InputError(f"{path}: line {parser.CurrentLineNumber}: nested too deeply")
        element = builder.start(tag, attributes)
        assert isinstance(element, LineElement)
        element.file = name
        element.line = parser.CurrentLineNumber

    def end(tag: str) -> None:
        nonlocal depth
        depth -= 1
        builder.end(tag)

    parser.StartElementHandler = start
    parser.EndElementHandler = end
    parser.CharacterDataHandler = builder.data
    try:
        parser.Parse(raw, True)
        root = builder.close()
    except (expat.ExpatError, LookupError, AssertionError) as error:
        decoded = None if text is not None else _other_letters(raw)
        if decoded is None:
            raise InputError(f"{path}: is no XML: {error}") from None
        return parse(path, name, decoded)[0], decoded.count("\ufffd")
    assert isinstance(root, LineElement)
    return root, 0


def _other_letters(raw: bytes) -> str | None:
    """Text of a file in another encoding: that of comments is common, names are ASCII."""
    try:
        raw.decode("utf-8")
    except UnicodeDecodeError:
        text = raw.decode("utf-8-sig", errors="replace")
        return _DECLARATION.sub(lambda match: "\n" * match[0].count("\n"), text, count=1)
    return None


def check_parts(path: Path, root: LineElement) -> None:
    """Reject a model with more parts than a robot can have.

    Raises:
        InputError: it has.

    """
    parts = sum(element.tag in ("body", "link", "joint") for element in root.iter())
    if parts > MOST_PARTS:
        raise InputError(
            f"{path}: holds {parts} bodies and joints; a chain has at most {MOST_PARTS}"
        )


def with_places(message: str, places: list[str]) -> str:
    """Replace line numbers of the prepared copy by the places of the user's file."""

    def place(match: re.Match[str]) -> str:
        index = int(match[1]) - 1
        return places[index] if 0 <= index < len(places) else match[0]

    return _LINE.sub(place, message)


def added(parent: ET.Element, tag: str, **attributes: str) -> LineElement:
    """New last child of an element, which no line of the user's file has."""
    child = LineElement(tag, attributes)
    parent.append(child)
    return child


def parents_of(root: ET.Element) -> Iterator[tuple[LineElement, LineElement]]:
    """Each element with its parent; changes of the tree during the walk are harmless."""
    pairs = [(parent, child) for parent in root.iter() for child in parent]
    for parent, child in pairs:
        assert isinstance(parent, LineElement)
        assert isinstance(child, LineElement)
        yield parent, child


def children(parent: ET.Element, *tags: str) -> list[LineElement]:
    """Children with one of the tags."""
    return [c for c in parent if c.tag in tags and isinstance(c, LineElement)]


def numbers(text: str | None, count: int) -> list[float] | None:
    """``count`` numbers of an attribute; None if it has another form."""
    try:
        values = [float(word) for word in (text or "").split()]
    except ValueError:
        return None
    return values if len(values) == count else None


def counted(things: Iterable[str]) -> str:
    """``3 light, 2 material``: how many of each, for a note."""
    counts: dict[str, int] = {}
    for thing in things:
        counts[thing] = counts.get(thing, 0) + 1
    return ", ".join(f"{number} {thing}" for thing, number in counts.items())


def _tags(root: LineElement) -> Iterator[tuple[str, LineElement]]:
    stack: list[tuple[LineElement, bool]] = [(root, False)]
    while stack:
        element, closes = stack.pop()
        if closes:
            yield f"</{element.tag}>", element
            continue
        words = "".join(f" {key}={quoteattr(value)}" for key, value in element.attrib.items())
        if len(element) == 0:
            yield f"<{element.tag}{words}/>", element
            continue
        yield f"<{element.tag}{words}>", element
        stack.append((element, True))
        for child in reversed(element):
            assert isinstance(child, LineElement)
            stack.append((child, False))
