"""XML of a robot model: lines of the user's file, limits of size and depth, other encodings."""

from pathlib import Path

import pytest

from snakewalk.config.errors import InputError
from snakewalk.controller.exchange.robot_import.model_source import (
    MOST_PARTS,
    LineElement,
    ModelSource,
    added,
    check_parts,
    children,
    counted,
    numbers,
    parents_of,
    parse,
    with_places,
)

FILE = Path("robot.xml")
MODEL = """<robot name="a &lt; b">
  <link name="head">
    <mass value="1"/>
  </link>

  <joint
    name="yaw"/>text
  <link name="tail"></link>
</robot>
"""


def parsed(text: str, name: str = "") -> LineElement:
    root, replaced = parse(FILE, name, text)
    assert replaced == 0
    return root


def test_each_start_tag_is_a_line_that_knows_its_line_in_the_users_file() -> None:
    text, places = ModelSource(parsed(MODEL)).text()
    assert text.splitlines() == [
        '<robot name="a &lt; b">',
        '<link name="head">',
        '<mass value="1"/>',
        "</link>",
        '<joint name="yaw"/>',
        '<link name="tail"/>',
        "</robot>",
    ]
    assert places == [f"line {k}" for k in (1, 2, 3, 2, 6, 8, 1)]
    assert parsed(text).find("link/mass") is not None
    included = ModelSource(parsed(MODEL, "arm.xml")).text()[1]
    assert included == [f"arm.xml {place}" for place in places]


def test_a_part_of_the_import_has_no_line_and_comes_last() -> None:
    root = parsed(MODEL)
    new = added(root, "compiler", angle="radian")
    assert root[-1] is new
    text, places = ModelSource(root).text()
    assert text.splitlines()[-2] == '<compiler angle="radian"/>'
    assert places[-2] == "a part of the import"


def test_a_message_names_the_lines_of_the_users_file() -> None:
    places = ["line 7", "arm.xml line 2"]
    message = "Error, line 1 and line 2: bad; line 3 and line 0 are not in it"
    assert with_places(message, places) == (
        "Error, line 7 and arm.xml line 2: bad; line 3 and line 0 are not in it"
    )


def test_a_thousand_parts_are_accepted_and_one_more_is_not() -> None:
    root = parsed("<robot><material/></robot>")
    for k in range(MOST_PARTS):
        added(root, ("body", "link", "joint")[k % 3])
    check_parts(FILE, root)
    added(root, "link")
    with pytest.raises(InputError, match=r"robot\.xml: holds 1001 bodies and joints"):
        check_parts(FILE, root)


def test_elements_lie_in_each_other_up_to_a_limit() -> None:
    def nested(depth: int) -> str:
        return "<a>" * depth + "</a>" * depth

    assert sum(1 for _ in parsed(nested(600)).iter()) == 600
    parsed("<b>" + nested(599) * 3 + "</b>")
    with pytest.raises(InputError, match=r"robot\.xml: line 1: nested too deeply"):
        parsed(nested(601))


@pytest.mark.parametrize("text", ["", "<robot>", "<robot></link></robot>", "<a/><b/>", "no XML"])
def test_a_file_that_is_no_xml_is_named(text: str) -> None:
    with pytest.raises(InputError, match=r"robot\.xml: is no XML: "):
        parse(FILE, "", text)


def test_a_file_in_another_encoding_keeps_its_lines(tmp_path: Path) -> None:
    """The bytes of a comment that are not UTF-8 are counted, and the declaration has no effect."""
    path = tmp_path / "robot.xml"
    words = '<?xml version="1.0"\n encoding="klingon"?>\n<!-- {} -->\n<robot name="a"/>\n'
    path.write_bytes(words.format("möß").encode("latin-1"))
    root, replaced = parse(path)
    assert (root.tag, root.line, replaced) == ("robot", 4, 2)
    path.write_bytes(words.format("plain").encode())
    with pytest.raises(InputError, match="is no XML: unknown encoding"):
        parse(path)
    path.write_bytes('<robot name="möß"/>'.encode())
    root, replaced = parse(path)
    assert (root.get("name"), replaced) == ("möß", 0)
    with pytest.raises(InputError, match=r"missing\.xml: No such file"):
        parse(tmp_path / "missing.xml")


def test_parents_and_children_are_those_of_the_file() -> None:
    root = parsed(MODEL)
    pairs = [(parent.tag, child.tag) for parent, child in parents_of(root)]
    assert pairs == [("robot", "link"), ("robot", "joint"), ("robot", "link"), ("link", "mass")]
    for parent, child in parents_of(root):
        parent.remove(child)
    assert len(root) == 0
    assert [child.get("name") for child in children(parsed(MODEL), "joint", "link")] == [
        "head",
        "yaw",
        "tail",
    ]


def test_an_attribute_holds_exactly_its_count_of_numbers() -> None:
    assert numbers(" 1 -2.5\t3e2 ", 3) == [1.0, -2.5, 300.0]
    for text in ("1 2", "1 2 3 4", "1 2 x", "", None):
        assert numbers(text, 3) is None
    assert counted(["light", "material", "light"]) == "2 light, 1 material"
