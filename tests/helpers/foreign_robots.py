"""Robot models of the classes that are published, written here with figures of their like.

None is a copy. What each has that a reader may stumble over is in its docstring.
"""

import math
from collections.abc import Callable

_BALL = '<inertia ixx="{0}" ixy="0" ixz="0" iyy="{0}" iyz="0" izz="{0}"/>'


def _link(name: str, mass: str = "", shape: str = "", at: str = "0 0 0", inertia: str = "1") -> str:
    """Write a URDF link; without a mass it is a frame."""
    inner = (
        f'<inertial><origin xyz="{at}"/><mass value="{mass}"/>{_BALL.format(inertia)}</inertial>'
        if mass
        else ""
    )
    return f'<link name="{name}">{inner}{shape}</link>\n'


def _cylinder(length: float, radius: float, at: str = "0 0 0", rpy: str = "0 0 0") -> str:
    return (
        f'<collision><origin xyz="{at}" rpy="{rpy}"/><geometry><cylinder length="{length}" '
        f'radius="{radius}"/></geometry></collision>'
    )


def _mesh(name: str) -> str:
    return (
        f'<visual><geometry><mesh filename="package://snake/meshes/{name}.stl" '
        'scale="0.001 0.001 0.001"/></geometry><material name="grey"><color rgba="1 1 1 1"/>'
        "</material></visual>"
    )


def _joint(
    name: str, parent: str, child: str, kind: str, xyz: str = "0 0 0", rpy: str = "0 0 0",
    inside: str = "",
) -> str:  # fmt: skip
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{xyz}" rpy="{rpy}"/>{inside}</joint>\n'
    )


_LIMIT = '<limit lower="-1.57" upper="1.57" effort="7" velocity="2.2"/>'
_Z = '<axis xyz="0 0 1"/>'


def modules_of_three_links(count: int = 16) -> str:
    """REU: modules of in, body and out, with zero masses, inertias of a ton, shapes at the joint.

    The rotations are rounded, the body sits beside the line, and a dummy root has no inertia.
    """
    text = _link("dummy_root") + _joint(
        "root_fixed", "dummy_root", "in_0", "fixed", "0 0 0.026", "0 -1.57079632679 0"
    )
    for k in range(count):
        body = _mesh("module") + _cylinder(0.021, 0.025)
        text += _link(f"in_{k}", "1") + _link(f"body_{k}", "0.1", body, inertia="2.9")
        text += _link(f"out_{k}", "0")
        text += _joint(
            f"in2body_{k}", f"in_{k}", f"body_{k}", "fixed", "0 -0.0066 0", "1.57076327 0 0"
        )
        text += _joint(
            f"body2out_{k}", f"body_{k}", f"out_{k}", "fixed", "0 0 0.044", "0 1.57076327 0"
        )
        if k + 1 < count:
            kind = "fixed" if k == 0 else "revolute"
            inside = _Z + ("" if k == 0 else _LIMIT + '<dynamics damping="0.1"/>')
            turn = "0 3.14152654 -1.57076327"
            text += _joint(f"out2in_{k}", f"out_{k}", f"in_{k + 1}", kind, rpy=turn, inside=inside)
    return f'<robot name="m" xmlns:xacro="http://ros.org/wiki/xacro">\n{text}</robot>\n'


def rounded_quarter_turns(count: int = 15) -> str:
    """RSNAKE: ``rpy="1.57 0 0"`` in every joint, and centres of mass at the joints."""
    text = _link("dummy_root") + _joint("root_fixed", "dummy_root", "module_0", "fixed", "0 0 0.05")
    shape = _mesh("link") + _cylinder(0.145, 0.05, "0.118 0 0", "0 1.57 0")
    for k in range(count):
        text += _link(f"module_{k}", "1.07", shape, inertia="0.0104")
        if k:
            text += _joint(
                f"module_{k - 1}_to_{k}", f"module_{k - 1}", f"module_{k}", "revolute",
                "0.145 0 0", "1.57 0 0", _Z + _LIMIT,
            )  # fmt: skip
    return f'<robot name="r">\n{text}</robot>\n'


def modules_with_collars(count: int = 16) -> str:
    """SEA: two bodies a joint, a collar without inertia, ``gazebo`` tags, meshes elsewhere."""
    base = _cylinder(0.05, 0.026) + _mesh("dome")
    text = _link("dummy_root") + _link("base", "0.05", base)
    text += _joint("root_fixed", "dummy_root", "base", "fixed", "0 0 0.026", "0 -1.57079632679 0")
    text += _joint("head_output", "base", "s0_in", "fixed", "0 0 0.025")
    shape = _mesh("rotary") + _cylinder(0.033, 0.026, "0 0 0.0183")
    for k in range(count):
        text += f'<gazebo reference="s{k}_out"><mu1>0.9</mu1></gazebo>'
        text += _link(f"s{k}_in", "0.103", shape, "0 0 0.0366", "5.5e-05")
        text += _link(f"s{k}_collar", shape=_mesh("collar"))
        text += _joint(f"s{k}_collar_fixed", f"s{k}_in", f"s{k}_collar", "fixed")
        text += _joint(
            f"s{k}", f"s{k}_in", f"s{k}_out", "revolute", "0 0 0.0366",
            inside='<axis xyz="0 1 0"/>' + _LIMIT + '<dynamics damping=".1" friction="0.2"/>',
        )  # fmt: skip
        text += _link(f"s{k}_out", "0.103", shape, inertia="5.5e-05")
        if k + 1 < count:
            text += _joint(
                f"s{k}_output", f"s{k}_out", f"s{k + 1}_in", "fixed", "0 0 0.0273", "0 0 -1.57075"
            )
    return f'<robot name="s">\n{text}</robot>\n'


def standing_on_world(count: int = 7, *, bare_tail: bool = False) -> str:
    """A tutorial's snake: link ``world``, joints without axis or range, meshes, stand-in inertias.

    With ``bare_tail`` the last link states no mass.
    """
    text = '<link name="world"/>\n' + _joint("fixed", "world", "base_link", "fixed")
    for k in range(count + 1):
        name = "base_link" if k == 0 else f"link{k + 1}"
        mass = "" if bare_tail and k == count else "1"
        text += _link(name, mass, _mesh("servo"), "0 0 0.036", "0.1")
        if k:
            before = "base_link" if k == 1 else f"link{k}"
            turn = "0" if k == 1 else f"{(-1) ** k * math.pi / 2:.11f}"
            text += _joint(
                f"joint{k}", before, name, "continuous",
                f"0. 0. {0 if k == 1 else 0.072}", f"0. 0. {turn}",
                '<safety_controller k_velocity="40.0" soft_lower_limit="-1.5"/>'
                '<limit effort="0.01" lower="-1" upper="1" velocity="0.5"/>'
                '<dynamics damping="0.7"/>',
            )  # fmt: skip
            text += (
                f'<transmission name="trans{k}"><joint name="joint{k}"/><actuator name="servo{k}"/>'
                "</transmission>"
            )
    return f'<robot name="t">\n<gazebo/>{text}</robot>\n'


def wheeled_urdf(count: int = 8) -> str:
    """A Gazebo snake of yaw joints with two passive wheels under each link, the tail's too."""
    text = _link("base_footprint") + _joint("on_ground", "base_footprint", "l0", "fixed")
    box = '<collision><geometry><box size="0.08 0.05 0.04"/></geometry></collision>'
    for k in range(count + 1):
        text += _link(f"l{k}", "0.2", box, inertia="1e-4")
        for side, y in (("left", 0.03), ("right", -0.03)):
            wheel = f"l{k}_{side}_wheel"
            text += _link(wheel, "0.01", _cylinder(0.01, 0.02, rpy="1.5708 0 0"), inertia="1e-6")
            text += _joint(
                f"{wheel}_joint", f"l{k}", wheel, "continuous", f"0 {y} -0.01",
                inside='<axis xyz="0 1 0"/>',
            )  # fmt: skip
        if k:
            # the origin of a link is its middle: the joint is between two of them
            text += _link(f"pin{k}", "0.001", inertia="1e-7")
            text += _joint(
                f"j{k}", f"l{k - 1}", f"pin{k}", "revolute", "-0.05 0 0", inside=_Z + _LIMIT
            )
            text += _joint(f"pin{k}_fixed", f"pin{k}", f"l{k}", "fixed", "-0.05 0 0")
    return f'<robot name="w">\n{text}</robot>\n'


def arm_of_threes(units: int = 4, *, xacro: bool = False) -> str:
    """An arm of units of a yaw and two pitch joints, as xacro or as the URDF that it gives.

    Two joints share a place, ``<dynamics>`` comes twice, ``world`` holds it, and the first link is
    a flange of 10 g without a shape.
    """
    twice = '<dynamics damping="0.1" friction="0.1"/>', '<dynamics damping="0.7"/>'
    limit = '<limit effort="3000" velocity="10.0" lower="-1.5708" upper="1.5708"/>'

    def turning(axis: str) -> str:
        return twice[0] + limit + f'<axis xyz="{axis}"/>' + twice[1]

    def unit(p: str) -> str:
        arm = _cylinder(0.25, 0.1, "0 -0.125 0", "1.5708 0 0")
        return (
            _link(f"{p}mount", "0.01", inertia="0.01")
            + _joint(f"{p}joint_1", f"{p}mount", f"{p}cross", "revolute",
                     rpy=f"{-math.pi / 2} 0 0", inside=turning("0 0 1"))
            + _link(f"{p}cross", "0.01", inertia="0.01")
            + _joint(f"{p}joint_2", f"{p}cross", f"{p}upper", "revolute", inside=turning("1 0 0"))
            + _link(f"{p}upper", "1.6", arm, inertia="0.019")
            + _joint(f"{p}joint_3", f"{p}upper", f"{p}fore", "revolute", "0 -0.25 0",
                     inside=turning("1 0 0"))
            + _link(f"{p}fore", "1.3", arm, inertia="0.0085")
            + _joint(f"{p}end", f"{p}fore", f"{p}flange", "fixed", "0 -0.25 0",
                     f"{math.pi / 2} 0 0")
            + _link(f"{p}flange", "0.01", inertia="0.01")
        )  # fmt: skip

    head = _joint("base_joint", "world", "a_mount", "fixed", "0 0 0.2") + '<link name="world"/>\n'
    joints = "".join(
        _joint(f"{b}_fixed", f"{a}_flange", f"{b}_mount", "fixed")
        for a, b in zip("abcdefgh"[: units - 1], "bcdefgh", strict=False)
    )
    names = [f"{letter}_" for letter in "abcdefgh"[:units]]
    if not xacro:
        return f'<robot name="a">\n{head}{joints}{"".join(map(unit, names))}</robot>\n'
    calls = "".join(f'<xacro:unit p="{name}"/>' for name in names)
    return (
        '<robot name="a" xmlns:xacro="http://ros.org/wiki/xacro">\n'
        f'<xacro:macro name="unit" params="p">{unit("${p}")}</xacro:macro>\n'
        f"{head}{joints}{calls}</robot>\n"
    )


def modules_without_meshes(count: int = 14) -> str:
    """MJCF modules with missing meshes, words between elements and alternating links."""
    inner = ""
    for k in reversed(range(1, count + 1)):
        back = 0.0695 if k % 2 else 0.0675
        axis = "1 0 0" if k % 2 else "0 -1 0"
        inner = (
            f'<body name="link{k}" pos="0 0 {-back}" euler="0 0 -180"><site name="s{k}"/>\n'
            f'<joint name="joint{k}" pos="0 0 0.0685" axis="{axis}" limited="true" range="-90 90" '
            f'damping="0.6"/>\n<geom type="mesh" mesh="link" mass="0.2" condim="6"/>{inner}</body>'
        )
    servos = "".join(
        f'<position name="servo{k}" joint="joint{k}" kp="4"/>' for k in range(1, count + 1)
    )
    return (
        '<mujoco model="s"><option timestep="0.001" collision="all" solver="Newton"/>'
        '<size nconmax="100"/><asset><texture name="t" type="2d" builtin="checker" width="64" '
        'height="64"/><material name="m" texture="t"/><mesh name="head" file="./asset/head.stl"/>'
        '<mesh name="link" file="./asset/link.stl"/></asset><worldbody>\n'
        '<geom type="plane" size="0 0 .25" material="m"/><light pos="0 0 9"/>// axes\n'
        '<body name="axes" pos=".5 .5 .7"><site name="x"/></body>'
        '<body name="head" pos="0 0 0.033" euler="0 90 -90">pos="0 0 0"<freejoint name="root"/>'
        f'<geom type="mesh" mesh="head" mass="0.2"/>{inner}</body></worldbody>'
        f"<actuator>{servos}</actuator></mujoco>"
    )


def wheeled_mjcf(links: int = 9, *, mesh: bool = False) -> str:
    """Cars with two passive wheels, by default classes, on slides and hinges; with or without mesh.

    With ``mesh`` the shape is a mesh that is not there, whose mass only its volume states.
    """
    if mesh:
        shape = '<geom type="mesh" mesh="module" euler="270 270 0"/>'
        back, joint, wheel = (
            -0.08,
            'pos="-0.024 0.033 0"',
            ("-0.05 0.06 -0.05", "-0.05 0.005 -0.05"),
        )
        size, density = "0.004", "100000"
    else:
        shape = (
            '<geom type="box" pos="-0.175 0 0" size="0.125 0.05 0.05"/>'
            '<geom type="capsule" fromto="-0.30 0 0 -0.05 0 0" size="0.05"/>'
        )
        back, joint, wheel = -0.35, "", ("-0.175 0.05 -0.05", "-0.175 -0.075 -0.05")
        size, density = "0.05", "600"

    def wheels(k: int) -> str:
        return "".join(
            f'<body pos="{at}" childclass="wheel"><joint name="wheel_{side}_{k}"/><geom/></body>'
            for side, at in zip("lr", wheel, strict=True)
        )

    inner = ""
    for k in reversed(range(1, links)):
        inner = (
            f'<body name="car{k + 1}" pos="{back} 0 0" childclass="car"><joint name="joint{k}" '
            f"{joint}/>{wheels(k)}{shape}{inner}</body>"
        )
    root = "".join(
        f'<joint type="{kind}" axis="{axis}" name="{kind}{axis[::2]}"/>'
        for kind in ("slide", "hinge")
        for axis in ("1 0 0", "0 1 0", "0 0 1")
    )
    asset = '<mesh file="module.stl" scale="0.001 0.001 0.001"/>' if mesh else ""
    motors = "".join(f'<position joint="joint{k}"/>' for k in range(1, links))
    return (
        '<mujoco><compiler angle="degree" coordinate="local" inertiafromgeom="true"/>'
        '<option integrator="Euler"><flag energy="enable"/></option><size nconmax="1000"/>'
        f'<default><geom conaffinity="0" friction="1 0.05 0.00001" density="{density}"/>'
        '<joint armature="0.001"/><default class="wheel"><joint axis="0 1 0" type="hinge" '
        f'damping="0.2"/><geom type="cylinder" fromto="0 0 0 0 0.002 0" size="{size}" '
        'friction="1.25 1 0.0001"/></default><default class="car"><joint axis="0 0 1" '
        'limited="true" range="-90 90"/></default></default>'
        f'<asset>{asset}</asset><visual><map znear="0.06"/></visual><worldbody>'
        '<geom type="plane" size="9 9 1"/><body name="ball"><joint type="slide" axis="1 0 0"/>'
        f'<geom size="0.02"/></body><body name="car1" pos="0 0 0.1">{root}{wheels(0)}{shape}'
        f"{inner}</body></worldbody><actuator>{motors}</actuator></mujoco>"
    )


CLASSES: dict[str, tuple[str, Callable[[], str], str, tuple[str, ...]]] = {
    "REU": (".urdf", modules_of_three_links, "p" * 15, ()),
    "RSNAKE": (".urdf", rounded_quarter_turns, "", ()),
    "SEA": (".urdf", modules_with_collars, "", ()),
    "seven joints": (".urdf", standing_on_world, "", ()),
    "three joints": (
        ".urdf", lambda: standing_on_world(3, bare_tail=True), "", ("link4.mass_kg=1",),
    ),
    "wheeled Gazebo snake": (".urdf", wheeled_urdf, "y" * 8, ()),
    "arm of threes": (".urdf", arm_of_threes, "ypp" * 4, ()),
    "o14": (".xml", modules_without_meshes, "", ()),
    "o20": (".xml", lambda: modules_without_meshes(20), "", ()),
    "o40": (".xml", lambda: modules_without_meshes(40), "", ()),
    "cars": (".xml", wheeled_mjcf, "y" * 8, ()),
    "cars of meshes": (
        ".xml", lambda: wheeled_mjcf(mesh=True), "y" * 8, ("module.mass_kg=0.15",),
    ),
}  # fmt: skip
"""Name: suffix, text, axes ("" for alternating ones), what has to be assumed."""
