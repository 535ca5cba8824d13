"""Robot models and calibrations: units, orders, limits; and what is correct."""

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from snakewalk.config.reading import Facts
from snakewalk.controller.exchange.robot_import.robot_choice import RobotChoice
from snakewalk.controller.exchange.robot_import.robot_import import import_robot
from snakewalk.controller.mapping.elevation_choice import CalibrationChoice
from snakewalk.controller.mapping.stereo_camera import read_calibration
from tests.controller.exchange.robot_import.test_sdf import sdf
from tests.foreign.case import Case, Values

COUNT, LENGTH_M, MASS_KG, LIMIT_RAD = 6, 0.08, 0.15, 1.2
RIGHT = {
    "length_m": COUNT * LENGTH_M,
    "mass_kg": COUNT * MASS_KG,
    "joints": COUNT - 1,
    "limit_rad": LIMIT_RAD,
    "error_m": 0.0,
}
CHAIN = {"length_m": 5 * 0.07, "mass_kg": sum(float(f"0.1{k}") for k in range(5)),
         "joints": 4, "error_m": 0.0, "limit_rad": 1.0, "widest_rad": 1.3}  # fmt: skip
"""Chain of the SDF models."""
LIMITS_RAD = (-LIMIT_RAD, LIMIT_RAD)
Write = Callable[[Path], Path]


def read(file: Path, options: dict[str, Any]) -> tuple[Values, Facts]:
    made = import_robot(file, "model", "XM430-W350", RobotChoice(**options))
    robot = made.robot
    values = {
        "length_m": robot.length_m,
        "mass_kg": robot.mass_kg,
        "joints": robot.joint_count,
        "limit_rad": min(robot.limit_rad),
        "widest_rad": max(robot.limit_rad),
        "error_m": made.kinematics_error_m,
        "first": float(made.joint_names[0] == "j0"),
    }
    return values, made.facts


def urdf(
    size: float = 1.0, mass: str | None = None, limit: tuple[float, float] = LIMITS_RAD,
    kind: str = "revolute", root: str = "", axis: str = "0 0 1", inside: str = "",
    names: tuple[str, ...] = (), angle: str = "1.5707963267948966", limits: bool = True,
) -> Write:  # fmt: skip
    """Return what writes a chain along x whose joints turn about z and y in turn."""

    def write(folder: Path) -> Path:
        links = names or tuple(f"l{k}" for k in range(COUNT))
        kilograms = f'<mass value="{MASS_KG if mass is None else mass}"/>' if mass != "" else ""
        parts = []
        for name in links:
            at = f'<origin xyz="{size * LENGTH_M / 2} 0 0" rpy="0 {angle} 0"/>'
            cylinder = f'<cylinder radius="{size * 0.02}" length="{size * LENGTH_M}"/>'
            shape = f"<geometry>{cylinder}</geometry>"
            inertial = (
                f'<inertial><origin xyz="{size * LENGTH_M / 2} 0 0"/>{kilograms}'
                '<inertia ixx="1e-4" iyy="1e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"/></inertial>'
            )
            parts.append(
                f'<link name="{name}">{inertial if kilograms else ""}'
                f"<visual>{at}{shape}</visual><collision>{at}{shape}</collision></link>"
            )
        for k in range(COUNT - 1):
            bounds = f'lower="{limit[0]}" upper="{limit[1]}"' if limits else ""
            turn = axis if k % 2 == 0 else "0 1 0"
            parts.append(
                f'<joint name="j{k}" type="{kind}"><parent link="{links[k]}"/>'
                f'<child link="{links[k + 1]}"/><origin xyz="{size * LENGTH_M} 0 0"/>'
                f'<axis xyz="{turn}"/><limit {bounds} effort="2" velocity="3"/>{inside}</joint>'
            )
        file = folder / "model.urdf"
        file.write_text(f'<robot name="snake">{root}{"".join(parts)}</robot>')
        return file

    return write


def mjcf(
    compiler: str = 'angle="radian"', limit: str = f"-{LIMIT_RAD} {LIMIT_RAD}",
    mass: str | None = None, size: float = 1.0, density: str = "",
) -> Write:  # fmt: skip
    def write(folder: Path) -> Path:
        text = ""
        for k in range(COUNT)[::-1]:
            hinge = "" if k == 0 else (
                f'<joint name="j{k - 1}" type="hinge" axis="{"0 0 1" if k % 2 else "0 1 0"}" '
                f'range="{limit}" limited="true"/>'
            )  # fmt: skip
            weight = "" if density else f'mass="{MASS_KG if mass is None else mass}"'
            geom = (
                f'<geom type="cylinder" fromto="0 0 0 {size * LENGTH_M} 0 0" size="{size * 0.02}" '
                f"{weight}{density}/>"
            )
            place = 0.0 if k == 0 else size * LENGTH_M
            text = f'<body name="l{k}" pos="{place} 0 0">{hinge}{geom}{text}</body>'
        free = text.replace('<body name="l0" pos="0.0 0 0">', '<body name="l0"><freejoint/>', 1)
        file = folder / "model.xml"
        file.write_text(f"<mujoco><compiler {compiler}/><worldbody>{free}</worldbody></mujoco>")
        return file

    return write


def described(**options: Any) -> Write:
    def write(folder: Path) -> Path:
        (folder / "model.sdf").write_text(sdf(**options))
        return folder / "model.sdf"

    return write


def models() -> Iterator[Case]:
    """Yield the robot models."""

    def case(kind: str, statement: str, write: Write, answer: Any = RIGHT, **options: Any) -> Case:
        return Case(kind, statement, write, read, answer, options)

    yield case("urdf", "all stated", urdf())
    yield case("urdf", "--reverse", urdf(), RIGHT | {"first": 0.0}, reverse=True)
    for limit in ((-0.7, 0.7), (-2.0, 2.0)):
        yield case("urdf", f"limits {limit}", urdf(limit=limit), RIGHT | {"limit_rad": limit[1]})
    uneven = RIGHT | {"limit_rad": 0.5}
    yield case("urdf", "uneven limits", urdf(limit=(-0.5, 1.2)), uneven)
    yield case("urdf", "swapped limits", urdf(limit=(1.2, -1.2)), "is above its upper limit")
    for limit in (90.0, 45.0, 180.0):
        write = urdf(limit=(-limit, limit))
        yield case("urdf", f"limits of {limit:g}, as in degrees", write, "degrees.*limit_rad")
    given = {"assume": {"*.limit_rad": "1.2"}}
    yield case("urdf", "limits in degrees, --assume", urdf(limit=(-69.0, 69.0)), **given)
    endless = urdf(kind="continuous", limits=False)
    yield case("urdf", "endless joints", endless, RIGHT | {"limit_rad": 3.05})
    soft = '<safety_controller soft_lower_limit="-0.8" soft_upper_limit="0.8" k_velocity="1"/>'
    yield case("urdf", "soft limits", urdf(inside=soft), RIGHT | {"limit_rad": 0.8})
    yield case("urdf", "no masses", urdf(mass=""), r"mass_kg.*\*\.mass_kg")
    yield case("urdf", "no masses, --assume *", urdf(mass=""),
               assume={"*.mass_kg": str(MASS_KG)})  # fmt: skip
    yield case("urdf", "masses of 0", urdf(mass="0"), "mass_kg")
    for size, factor in ((1e3, 1e-3), (100.0, 0.01)):
        yield case("urdf", f"lengths times {size:g}", urdf(size), "--mass-scale 1")
        yield case("urdf", f"lengths times {size:g}, both factors", urdf(size),
                   scale=factor, mass_scale=1.0)  # fmt: skip
    grams = urdf(mass=str(1e3 * MASS_KG))
    yield case("urdf", "masses in grams", grams, "its mass is")
    yield case("urdf", "masses in grams, --mass-scale", grams, mass_scale=1e-3)
    half = {"length_m": RIGHT["length_m"] / 2, "mass_kg": RIGHT["mass_kg"] / 8}
    yield case("urdf", "--scale 0.5", urdf(), RIGHT | half, scale=0.5)
    for name in ("world", "odom", "map", "base_footprint"):
        for kind in ("fixed", "floating", "planar"):
            base = f'<link name="{name}"/><joint name="b" type="{kind}"><parent link="{name}"/>'
            base += '<child link="l0"/><axis xyz="0 0 1"/></joint>'
            yield case("urdf", f"{name} holds it, {kind}", urdf(root=base))
    yield case("urdf", "right angles of 1.57", urdf(angle="1.57"))
    twice = urdf(names=("a", "b", "a", "d", "e", "f"))
    yield case("urdf", "a link name twice", twice, r"\ba\b")
    yield case("urdf", "an axis between yaw and pitch", urdf(axis="0 0.7 0.7"), "j0")
    turned = urdf(axis="0 0 -1")
    yield case("urdf", "axes that point down", turned)

    degrees = {"compiler": 'angle="degree"', "limit": "-68.7549354 68.7549354"}
    yield case("mjcf", "radians", mjcf())
    yield case("mjcf", "degrees", mjcf(**degrees))
    yield case("mjcf", "no unit of angles: degrees", mjcf("", degrees["limit"]))
    for eulers in ("xyz", "XYZ", "zyx"):
        yield case("mjcf", f"eulerseq {eulers}", mjcf(f'angle="radian" eulerseq="{eulers}"'))
    for mass in ("0.1", "0.3"):
        made = RIGHT | {"mass_kg": COUNT * float(mass)}
        yield case("mjcf", f"masses of {mass}", mjcf(mass=mass), made)
    volume_m3 = np.pi * 0.02**2 * LENGTH_M
    for density in (500.0, 1000.0):
        made = RIGHT | {"mass_kg": COUNT * density * volume_m3}
        yield case("mjcf", f"density {density:g}", mjcf(density=f'density="{density}"'), made)
    yield case("mjcf", "millimetres", mjcf(size=1e3), "--mass-scale 1")
    yield case("mjcf", "millimetres, both factors", mjcf(size=1e3), scale=1e-3, mass_scale=1.0)
    total = mjcf('angle="radian" settotalmass="1.8"')
    yield case("mjcf", "settotalmass 1.8", total, RIGHT | {"mass_kg": 1.8})

    chain = CHAIN
    old = described(version="1.4", axes="model")
    yield case("sdf", "version 1.4: axes in the model's frame", old, chain)
    for version in ("1.5", "1.6", "1.7", "1.8", "1.9"):
        yield case("sdf", f"version {version}", described(version=version), chain)
    for seed in (1, 2):
        yield case("sdf", f"frames anywhere, {seed}", described(seed=seed), chain)
    yield case("sdf", "axes in a named frame", described(axes="named"), chain)
    yield case("sdf", "axes in the model's frame", described(axes="parent", version="1.6"), chain)


K = np.array([[400.0, 0.0, 160.0], [0.0, 400.0, 120.0], [0.0, 0.0, 1.0]])
TURN = cv2.Rodrigues(np.array([0.02, -0.03, 0.01]))[0]
T_M = np.array([-0.12, 0.004, -0.003])
BASELINE = {"baseline_m": float(np.linalg.norm(T_M)), "focal_px": 400.0}
NAMES = (
    ("K1", "D1", "K2", "D2", "R", "T"),
    ("cameraMatrix1", "distCoeffs1", "cameraMatrix2", "distCoeffs2", "R", "T"),
)


def calibration(ending: str, names: tuple[str, ...], factor: float, sign: float = 1.0) -> Write:
    def write(folder: Path) -> Path:
        file = folder / f"c.{ending}"
        none = np.zeros(5)
        values = (K, none, K, none, TURN, sign * factor * T_M)
        if ending == "json":
            lists = {name: value.tolist() for name, value in zip(names, values, strict=True)}
            file.write_text(json.dumps(lists))
        elif ending == "npz":
            np.savez(file, **dict(zip(names, values, strict=True)))
        else:
            out = cv2.FileStorage(str(file), cv2.FILE_STORAGE_WRITE)
            for name, value in zip(names, values, strict=True):
                out.write(name, value)
            out.release()
        return file

    return write


def middlebury(folder: Path) -> Path:
    text = "cam0=[400 0 160; 0 400 120; 0 0 1]\ncam1=[400 0 170; 0 400 120; 0 0 1]\n"
    (folder / "calib.txt").write_text(text + "doffs=10\nbaseline=193.001\nwidth=320\nheight=240\n")
    return folder / "calib.txt"


def calibrations() -> Iterator[Case]:
    """Yield the calibrations."""

    def read_one(file: Path, options: dict[str, Any]) -> tuple[Values, Facts]:
        found = read_calibration(file, CalibrationChoice(**options))
        baseline_m = float(np.linalg.norm(found.translation_m))
        return {"baseline_m": baseline_m, "focal_px": found.k_left[0, 0]}, found.facts

    def case(statement: str, write: Write, answer: Any = BASELINE, **options: Any) -> Case:
        return Case("calibration", statement, write, read_one, answer, options)

    for ending in ("yml", "xml", "json", "npz"):
        for names in NAMES:
            words = f"{ending}, {names[0]}"
            yield case(f"{words}, T in m", calibration(ending, names, 1.0))
        for unit, factor in (("mm", 1e3), ("cm", 100.0)):
            write = calibration(ending, NAMES[0], factor)
            yield case(f"{ending}, T in {unit}", write, f"states no unit of T.*--unit {unit}")
            yield case(f"{ending}, --unit {unit}", write, unit=unit)
        write = calibration(ending, NAMES[0], 1.0)
        yield case(f"{ending}, --unit m", write, unit="m")
        yield case(
            f"{ending}, --unit mm of T in m",
            write,
            "length of T is 0.1.*possible units: m$",
            unit="mm",
        )
    yield case("cameras exchanged", calibration("yml", NAMES[0], 1.0, -1.0), "exchange the cameras")
    yield case(
        "Middlebury, baseline in mm", middlebury, {"baseline_m": 0.193001, "focal_px": 400.0}
    )


def cases() -> Iterator[Case]:
    """Yield the cases."""
    yield from models()
    yield from calibrations()
