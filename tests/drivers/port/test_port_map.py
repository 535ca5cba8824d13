"""Ports of a chain's segments, on a command line and in a robot's file."""

import pytest

from snakewalk.config.errors import ConfigError, InputError
from snakewalk.config.loader import checked
from snakewalk.config.robot import RobotConfig
from snakewalk.config.template import plain_toml
from snakewalk.drivers.port.port_map import is_port_map, parse_port_map, port_map_text, ports_in

TWO = [{"port": "/dev/ttyUSB0", "ids": [1, 2]}, {"port": "socket://host:5000", "ids": [3, 4]}]


@pytest.mark.parametrize(
    ("text", "ids", "written"),
    [
        ("1-8=/dev/ttyUSB0,9-16=/dev/ttyUSB1", [range(1, 9), range(9, 17)], None),
        ("1,2,5-7=/dev/ttyUSB0,3=socket://h:1", [(1, 2, 5, 6, 7), (3,)], "1-2,5-7=/dev/ttyUSB0,3="),
        (" 4 = /dev/a , 1-2 =/dev/b", [(4,), (1, 2)], "4=/dev/a,1-2=/dev/b"),
    ],
)
def test_ids_and_ports_are_read(text: str, ids: list, written: str | None) -> None:
    assert is_port_map(text)
    found = parse_port_map(text)
    assert [on_it for _, on_it in found] == [tuple(each) for each in ids]
    assert port_map_text(found).startswith(written or text)
    assert parse_port_map(port_map_text(found)) == found
    assert ports_in(text) == [port for port, _ in found]


@pytest.mark.parametrize("text", ["/dev/ttyUSB0", "COM3", "socket://host:5000", "robot"])
def test_one_port_is_no_map(text: str) -> None:
    assert not is_port_map(text)
    assert ports_in(text) == [text]


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("1-8=/dev/a,/dev/b", "'/dev/b' names no IDs and port; write 1-8="),
        ("8-1=/dev/a", "8-1 runs backwards"),
        ("1-300=/dev/a", "ID 300: a servo has 0 to 252"),
        ("1,,3=/dev/a", "'' is no ID"),
    ],
)
def test_what_cannot_be_read_is_told(text: str, fault: str) -> None:
    with pytest.raises(InputError, match=fault):
        parse_port_map(text)


def a_robot(ports: list) -> RobotConfig:
    return checked(RobotConfig, {"name": "four", "joint_axes": "ypyp", "ports": ports}, "four.toml")


def test_a_file_says_it_and_messages_name_the_port() -> None:
    robot = a_robot(TWO)
    assert robot.joint_label(2) == "joint yaw_03 (ID 3 on socket://host:5000)"
    assert '[[ports]]\nport = "/dev/ttyUSB0"\nids = [1, 2]\n' in plain_toml(robot)


@pytest.mark.parametrize(
    ("ports", "fault"),
    [
        ([TWO[0]], "ports: ID 3, 4 is on none of them"),
        ([TWO[0], {"port": "b", "ids": [2, 3, 4]}], "ports: ID 2 is on more than one"),
        ([TWO[0], {"port": "b", "ids": [3, 4, 9]}], "ports: ID 9 is not of this robot"),
        ([TWO[0], {"port": "/dev/ttyUSB0", "ids": [3, 4]}], "/dev/ttyUSB0 is named twice"),
        ([{"port": "a", "ids": [1, 2, 3, 4]}], "only one: leave the table out"),
        ([{"port": "", "ids": [1]}, TWO[1]], "must not be empty"),
    ],
)
def test_ports_that_do_not_fit_the_servos_are_refused(ports: list, fault: str) -> None:
    with pytest.raises(ConfigError, match=fault):
        a_robot(ports)
