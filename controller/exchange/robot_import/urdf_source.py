"""URDF prepared for MuJoCo: it floats, repeated elements are resolved, missing meshes are gone."""

from pathlib import Path

import numpy as np

from snakewalk.config.errors import InputError
from snakewalk.controller.exchange.robot_import.model_source import (
    LineElement,
    ModelSource,
    added,
    children,
    counted,
    numbers,
    parents_of,
)

_SINGLE_ELEMENTS = {
    "joint": (
        "origin",
        "parent",
        "child",
        "axis",
        "limit",
        "dynamics",
        "calibration",
        "mimic",
        "safety_controller",
    ),
    "link": ("inertial",),
    "inertial": ("origin", "mass", "inertia"),
    "visual": ("origin", "geometry"),
    "collision": ("origin", "geometry"),
}
"""Elements that urdfdom reads once: the first counts."""
_NOT_READ = ("gazebo", "transmission", "ros2_control", "mujoco", "material")
_MESHES = (".stl", ".obj")
_FREE_JOINT_TYPES = ("floating", "planar")
"""Kinds of joints that let a robot move freely in its world."""
_SLIVER_KG = 1e-9
"""Mass that MuJoCo gets for a body that states none."""


def prepare_urdf(root: LineElement, path: Path, *, meshes: bool = True) -> ModelSource:
    """Prepare a URDF; the tree is changed.

    Args:
        root: of the file.
        path: of the file, next to which meshes are looked for.
        meshes: use those that are found.

    Raises:
        InputError: a joint mimics another, no link is the first, or the first is joined to the
            world by a joint that turns.

    """
    source = ModelSource(root)
    for joint in root.iter("joint"):
        if joint.find("mimic") is not None:
            raise InputError(
                f"{path}: joint {joint.get('name')}, {_element_place(joint)}: mimics another; "
                "each joint of a robot's file is a servo"
            )
    _drop_repeated(source)
    _check_names(root, path)
    _check_limits(root, path)
    _use_soft_limits(source)
    driven = _driven(root)
    source.actuated = driven or None
    source.friction = _friction(root)
    _drop_unread(source)
    first = _first_link(source, path)
    _choose_shapes(source, path, meshes=meshes)
    _repair_inertias(source)
    source.stated_mass_kg, source.part_names = _stated_masses_kg(root)
    _float(root, first)
    return source


def _element_place(element: object) -> str:
    assert isinstance(element, LineElement)
    return element.where


def _drop_repeated(source: ModelSource) -> None:
    """Keep the first of elements that may occur once, as urdfdom does."""
    repeated: dict[str, list[str]] = {}
    for parent in list(source.root.iter()):
        for tag in _SINGLE_ELEMENTS.get(parent.tag, ()):
            elements = children(parent, tag)
            if len(elements) < 2:
                continue
            first, *others = elements
            for other in others:
                parent.remove(other)
                differs = " with other values" if other.attrib != first.attrib else ""
                repeated.setdefault(f"{parent.tag} {{}} repeat <{tag}>", []).append(
                    f"{parent.get('name', '')} ({first.where} and {other.where}{differs})"
                )
    for what, places in repeated.items():
        words = what.format(", ".join(places[:3]) + (", ..." if len(places) > 3 else ""))
        source.notes.append(f"{words}, {len(places)} in all: the first counts")


def _driven(root: LineElement) -> frozenset[str]:
    """Joints that a transmission or ros2_control names."""
    return frozenset(
        str(joint.get("name"))
        for tag in ("transmission", "ros2_control")
        for driver in root.findall(tag)
        for joint in driver.iter("joint")
        if joint.get("name")
    )


def _drop_unread(source: ModelSource) -> None:
    dropped = []
    for parent, child in parents_of(source.root):
        if child.tag in _NOT_READ:
            parent.remove(child)
            if parent is source.root:
                dropped.append(child.tag)
    for joint in source.root.findall("joint"):
        for key, stated in (("effort", source.effort_n_m), ("velocity", source.speed_rad_s)):
            limit = joint.find("limit")
            value = None if limit is None else numbers(limit.get(key), 1)
            if value is not None:
                stated[str(joint.get("name"))] = value[0]
    if dropped:
        source.notes.append(f"left out of the URDF: {counted(dropped)}")


def _first_link(source: ModelSource, path: Path) -> str:
    """Name of the link on which all hang.

    Links that hold it by a floating or planar joint are dropped, as is the link ``world``.

    Raises:
        InputError: no link is the root, several are, or the root is bolted to the world.

    """
    root = source.root
    free = [joint for joint in children(root, "joint") if joint.get("type") in _FREE_JOINT_TYPES]
    if free:
        _drop_base(source, free[0], path)
        return _first_link(source, path)
    joints = root.findall("joint")
    names = {end: [_end(joint, end) for joint in joints] for end in ("parent", "child")}
    for link in children(root, "link"):
        alone = link.get("name") not in names["parent"] + names["child"]
        if alone and link.find("inertial") is None and len(root.findall("link")) > 1:
            root.remove(link)
            source.notes.append(f"link {link.get('name')} is dropped: nothing joins it")
    first = [
        str(link.get("name"))
        for link in root.findall("link")
        if link.get("name") not in names["child"]
    ]
    if len(first) != 1:
        listed = ", ".join(first) or "each hangs on another"
        raise InputError(f"{path}: one link must be the first, on which all hang: {listed}")
    root_link = first[0]
    if root_link != "world":
        return root_link
    holding = [joint for joint in children(root, "joint") if _end(joint, "parent") == root_link]
    turning = [joint for joint in holding if joint.get("type") != "fixed"]
    if turning:
        raise InputError(
            f"{path}: joint {turning[0].get('name')}, {turning[0].where}: connects the robot to "
            f"the link world by a {turning[0].get('type')} joint, but this robot must move "
            "freely; use a fixed or floating joint, or remove the link world"
        )
    if len(holding) != 1:
        children_text = ", ".join(str(_end(joint, "child")) for joint in holding) or "nothing"
        raise InputError(
            f"{path}: link {root_link} holds {children_text}; one robot is read at a time"
        )
    _drop_base(source, holding[0], path)
    return _first_link(source, path)


def _drop_base(source: ModelSource, holding: LineElement, path: Path) -> None:
    """Drop the links around the robot, which a joint to the world holds.

    Raises:
        InputError: one of their joints turns.

    """
    root = source.root
    kept = [str(_end(holding, "child"))]
    for name in kept:
        children_of = [_end(j, "child") for j in root.findall("joint") if _end(j, "parent") == name]
        kept += [str(child) for child in children_of if child not in kept]
    dropped = [
        str(link.get("name")) for link in root.findall("link") if link.get("name") not in kept
    ]
    for joint in children(root, "joint"):
        is_outside = _end(joint, "child") not in kept[1:]
        if is_outside and joint.get("type") not in ("fixed", *_FREE_JOINT_TYPES):
            raise InputError(
                f"{path}: joint {joint.get('name')}, {joint.where}: moves a second body, apart "
                f"from the one that joint {holding.get('name')} holds; one robot is read at a time"
            )
        if is_outside:
            root.remove(joint)
    for link in children(root, "link"):
        if link.get("name") not in kept:
            root.remove(link)
    source.notes += [
        f"link {name} is dropped: it holds {kept[0]} by the {holding.get('type')} joint "
        f"{holding.get('name')}"
        for name in dropped
    ]


def _check_limits(root: LineElement, path: Path) -> None:
    """Reject limits in the wrong order; MuJoCo would ignore both.

    Raises:
        InputError: with the joint and its line.

    """
    for joint in children(root, "joint"):
        limit = joint.find("limit")
        low, high = (
            numbers(None if limit is None else limit.get(key), 1) for key in ("lower", "upper")
        )
        if low is not None and high is not None and low[0] > high[0]:
            raise InputError(
                f"{path}: joint {joint.get('name')}, {joint.where}: its lower limit of {low[0]:g} "
                f"is above its upper limit of {high[0]:g}; exchange them"
            )


def _check_names(root: LineElement, path: Path) -> None:
    """Reject links or joints of one name, of which MuJoCo shows no name.

    Raises:
        InputError: with the name and both lines.

    """
    for tag in ("link", "joint"):
        first_of: dict[str | None, LineElement] = {}
        for element in children(root, tag):
            first = first_of.setdefault(element.get("name"), element)
            if first is not element:
                raise InputError(
                    f"{path}: {tag} {element.get('name')} occurs twice, {first.where} and "
                    f"{element.where}; names must differ"
                )


def _use_soft_limits(source: ModelSource) -> None:
    """Narrow the ranges of joints to their soft limits, beyond which ROS pushes them back."""
    used = []
    for joint in children(source.root, "joint"):
        soft, limit = joint.find("safety_controller"), joint.find("limit")
        if soft is None or limit is None:
            continue
        low, high = (numbers(soft.get(f"soft_{end}_limit"), 1) for end in ("lower", "upper"))
        if low is None or high is None or low[0] >= high[0]:
            continue  # not stated
        for end, value, inner in (("lower", low[0], max), ("upper", high[0], min)):
            stated = numbers(limit.get(end), 1) or [value]
            limit.set(end, repr(inner(value, stated[0])))
            if inner(value, stated[0]) != stated[0]:
                used.append(str(joint.get("name")))
    if used:
        source.notes.append(
            f"the soft limits of safety_controller count: {', '.join(dict.fromkeys(used))}"
        )


def _end(joint: object, end: str) -> str | None:
    assert isinstance(joint, LineElement)
    end_element = joint.find(end)
    return None if end_element is None else end_element.get("link")


def _choose_shapes(source: ModelSource, path: Path, *, meshes: bool) -> None:
    """Keep the collision shapes of a link, else the drawn ones; meshes only if they are there."""
    missing: list[str] = []
    used: set[str] = set()
    for link in children(source.root, "link"):
        for shape in children(link, "visual", "collision"):
            mesh = shape.find("geometry/mesh")
            if mesh is None:
                continue
            name = mesh.get("filename", "")
            file = _mesh_file(name, path) if meshes else None
            if file is None:
                link.remove(shape)
                missing.append(name)
            else:
                mesh.set("filename", str(file))
                used.add(name)
        if children(link, "collision"):
            for drawn in children(link, "visual"):
                link.remove(drawn)
    if missing:
        names = ", ".join(sorted(set(missing))[:3])
        kinds = len(set(missing))
        source.notes.append(
            f"{len(missing)} shapes are left out: "
            + (f"{kinds} mesh files are missing or unreadable: " if kinds > 1 else "mesh file ")
            + names
            + (", ..." if kinds > 3 else "" if kinds > 1 else " is missing or unreadable")
        )
    if used:
        source.notes.append(f"meshes read: {len(used)}")


def _mesh_file(name: str, path: Path) -> Path | None:
    """File of a mesh: next to the URDF, or in the folder of its package around the URDF."""
    relative = name.removeprefix("file://")
    if "://" in relative:
        scheme, _, relative = relative.partition("://")
        if scheme not in ("package", "model"):
            return None
    if Path(relative).suffix.lower() not in _MESHES or not relative:
        return None
    inside = Path(relative)
    behind = Path(*inside.parts[1:]) if len(inside.parts) > 1 else inside
    for folder in path.resolve().parents:
        for candidate in (folder / inside, folder / behind):
            if candidate.is_file():
                return candidate
    return None


def _repair_inertias(source: ModelSource) -> None:
    """Replace inertias that no body can have by those of a small ball: only the mass is used."""
    wrong = []
    for link in children(source.root, "link"):
        inertial = link.find("inertial")
        if inertial is None:
            continue
        mass = numbers(getattr(inertial.find("mass"), "attrib", {}).get("value"), 1)
        inertia = inertial.find("inertia")
        if mass is None or inertia is None or mass[0] <= 0.0:
            continue
        xx, xy, xz, yy, yz, zz = (
            (numbers(inertia.get(key, "0"), 1) or [np.nan])[0]
            for key in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
        )
        matrix = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        if not np.isfinite(matrix).all():
            continue  # MuJoCo names the number
        values = np.linalg.eigvalsh(matrix)
        if values[0] <= 0.0 or values[0] + values[1] < values[2] * (1.0 - 1e-6):
            wrong.append(str(link.get("name")))
            ball = repr(0.4 * mass[0] * 1e-4)
            inertia.attrib.update(
                ixx=ball, iyy=ball, izz=ball, ixy="0", ixz="0", iyz="0"
            )  # of 1 cm
    if wrong:
        source.notes.append(
            f"inertia of {len(wrong)} links is that of no body ({', '.join(wrong[:3])}"
            f"{', ...' if len(wrong) > 3 else ''}): only their mass is used"
        )


def _friction(root: LineElement) -> dict[str, float]:
    """Gazebo's ``mu1`` by link."""
    friction_by_link = {}
    for gazebo in root.findall("gazebo"):
        value = numbers(gazebo.findtext("mu1"), 1) or numbers(gazebo.findtext("mu"), 1)
        if value is not None and gazebo.get("reference"):
            friction_by_link[str(gazebo.get("reference"))] = value[0]
    return friction_by_link


def _stated_masses_kg(root: LineElement) -> tuple[dict[str, float], dict[str, str]]:
    parent = {
        str(_end(joint, "child")): str(_end(joint, "parent"))
        for joint in root.findall("joint")
        if joint.get("type") == "fixed"
    }
    masses: dict[str, float] = {}
    heaviest: dict[str, tuple[float, str]] = {}
    for link in root.findall("link"):
        owner = name = str(link.get("name"))
        steps = 0
        while name in parent and steps < len(parent):
            name = parent[name]
            steps = steps + 1
        stated = link.find("inertial/mass")
        value = numbers(None if stated is None else stated.get("value"), 1) or [0.0]
        masses[name] = masses.get(name, 0.0) + value[0]
        if value[0] > heaviest.get(name, (0.0, ""))[0]:
            heaviest[name] = value[0], owner
    return masses, {name: part for name, (_, part) in heaviest.items()}


def _float(root: LineElement, first: str) -> None:
    """Join the first link to MuJoCo's world by a floating joint; bodies without mass compile."""
    names = {element.get("name") for element in root.iter()}
    ground = next(name for name in ("_ground", "_ground_", "_ground__") if name not in names)
    options = added(root, "mujoco")
    sliver = repr(_SLIVER_KG)
    added(
        options,
        "compiler",
        fusestatic="true",
        discardvisual="false",
        strippath="false",
        balanceinertia="true",
        boundmass=sliver,
        boundinertia=sliver,
    )
    added(root, "link", name=ground)
    floating = added(root, "joint", name=f"{ground}_floats", type="floating")
    added(floating, "parent", link=ground)
    added(floating, "child", link=first)
