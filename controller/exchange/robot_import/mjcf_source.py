"""MJCF prepared for MuJoCo: one file, without the parts that a robot file does not use."""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from snakewalk.config.errors import Assumptions, InputError
from snakewalk.controller.exchange.robot_import.model_source import (
    LineElement,
    ModelSource,
    check_parts,
    children,
    counted,
    numbers,
    parents_of,
    parse,
)

_NOT_READ = frozenset(
    {
        "option",
        "size",
        "visual",
        "statistic",
        "sensor",
        "keyframe",
        "custom",
        "contact",
        "actuator",
        "light",
        "camera",
        "texture",
        "material",
        "hfield",
        "skin",
        "extension",
    }
)
_SILENT = frozenset({"option", "size", "visual", "statistic"})
"""Elements that do not describe the robot."""
_OLD_ATTRIBUTES = {"compiler": ("convexhull", "exactmeshinertia", "coordinate")}
"""Attributes of older MuJoCo versions that this one does not know."""
_FILES = ("file",)
_MOST_INCLUDES = 50
_ROLLER = re.compile(r"roller\d+")
"""Name of a body that an exported robot rolls on."""
_MARK_M = "0.0001"
"""Radius of the ball that carries a missing mesh's mass."""


def prepare_mjcf(root: LineElement, path: Path, assumed: Assumptions) -> ModelSource:
    """Prepare a MuJoCo model; the tree is changed.

    Raises:
        InputError: a file that it includes cannot be read, it has global coordinates, or the mass
            of a missing mesh is not stated.

    """
    source = ModelSource(root)
    _include(root, path)
    check_parts(path, root)
    for compiler in root.iter("compiler"):
        assert isinstance(compiler, LineElement)
        if compiler.get("coordinate") == "global":
            raise InputError(
                f"{path}: {compiler.where}: states global coordinates, as MuJoCo 1 had; load and "
                "save it with MuJoCo 2.3.3 or older"
            )
    source.actuated = frozenset(
        name
        for actuators in root.findall("actuator")
        for actuator in actuators
        for name in [actuator.get("joint") or actuator.get("jointinparent")]
        if name
    )
    _drop_unread(source)
    _join_rollers(source)
    defaults = _Defaults.of(root)
    _resolve_meshes(source, path, defaults, assumed)
    source.massless_geoms = frozenset(_massless(root, defaults))
    return source


def _join_rollers(source: ModelSource) -> None:
    """Give the mass of the rollers of an exported robot back to their links."""
    joined = 0
    for link, roller in parents_of(source.root):
        inertial = link.find("inertial")
        if not _ROLLER.fullmatch(roller.get("name", "")) or roller.tag != "body":
            continue
        if inertial is not None:
            parts = [inertial, *roller.findall("geom")]
            inertial.set("mass", repr(sum(float(part.get("mass", "0")) for part in parts)))
        link.remove(roller)
        joined += 1
    if joined:
        source.notes.append(f"{joined} rollers of an exported robot are part of their links")


def _include(root: LineElement, path: Path) -> None:
    """Put the content of included files in place of ``<include>``."""
    for _ in range(_MOST_INCLUDES):
        places = [pair for pair in parents_of(root) if pair[1].tag == "include"]
        if not places:
            return
        parent, include = places[0]
        file = path.parent / include.get("file", "")
        position = list(parent).index(include)
        inner, _ = parse(file, name=str(include.get("file", "")))
        parent.remove(include)
        for child in reversed(list(inner)):
            parent.insert(position, child)
    raise InputError(f"{path}: includes more than {_MOST_INCLUDES} files")


def _drop_unread(source: ModelSource) -> None:
    dropped = []
    for parent, child in parents_of(source.root):
        if child.tag in _NOT_READ:
            parent.remove(child)
            if child.tag not in _SILENT:
                several = child.tag in ("sensor", "actuator", "contact", "keyframe", "custom")
                dropped += [child.tag] * (max(len(child), 1) if several else 1)
    for element in source.root.iter():
        for name in ("material", *_OLD_ATTRIBUTES.get(element.tag, ())):
            if element.attrib.pop(name, None) is not None and name not in (
                "material",
                "coordinate",
            ):
                source.notes.append(f"attribute {name} of <{element.tag}> is left out: old MuJoCo")
        if element.tag == "geom" and "hfield" in element.attrib:
            element.attrib.clear()
            element.attrib.update(type="plane", size="1 1 1")
            dropped.append("hfield geom")
    if dropped:
        source.notes.append(f"left out of the MJCF: {counted(dropped)}")


@dataclass(slots=True)
class _Defaults:
    """Attributes of geoms by default class."""

    geom: dict[str, dict[str, str]] = field(default_factory=dict)

    @staticmethod
    def of(root: LineElement) -> "_Defaults":
        defaults = _Defaults({"": {}})
        stack = [(default, "", True) for default in root.findall("default")]
        while stack:
            default, above, is_main = stack.pop()
            name = "" if is_main else default.get("class", "")
            values = dict(defaults.geom.get(above, {}))
            for geom in default.findall("geom"):
                values.update(geom.attrib)
            defaults.geom[name] = values
            if is_main and default.get("class"):
                defaults.geom[default.get("class", "")] = values
            stack += [(child, name, False) for child in default.findall("default")]
        return defaults

    def value(self, geom: LineElement, name: str, childclass: str) -> str | None:
        chosen = self.geom.get(geom.get("class", childclass), {})
        return geom.get(name, chosen.get(name))


def _geoms(root: LineElement) -> Iterator[tuple[LineElement, LineElement, str]]:
    """Parent, geom and class of the bodies around it."""
    stack = [(body, "") for body in children(root, "worldbody")]
    while stack:
        body, childclass = stack.pop()
        child_class = body.get("childclass", childclass)
        for child in body:
            assert isinstance(child, LineElement)
            if child.tag == "geom":
                yield body, child, child_class
            elif child.tag in ("body", "frame", "replicate"):
                stack.append((child, child_class))


def _resolve_meshes(
    source: ModelSource, path: Path, defaults: _Defaults, assumed: Assumptions
) -> None:
    root = source.root
    missing = _find_meshes(root, path)
    if missing:
        source.notes.append(_replace_missing_meshes(root, missing, defaults, assumed))


def _find_meshes(root: LineElement, path: Path) -> dict[str, str]:
    """Write the whole path of each mesh into the model; return name and file of those not found."""
    missing = {}
    compiler = root.find("compiler")
    settings = {} if compiler is None else compiler.attrib
    folder = path.parent / settings.get("meshdir", settings.get("assetdir", "."))
    strips = settings.get("strippath", "false") == "true"
    for asset in root.findall("asset"):
        for mesh in children(asset, "mesh", "model"):
            if not mesh.get("file"):
                continue
            stated = Path(mesh.get("file", ""))
            file = folder / (stated.name if strips else stated)
            if "name" not in mesh.attrib:
                mesh.set("name", stated.stem)
            if file.is_file():
                mesh.set("file", str(file.resolve()))
            else:
                missing[mesh.get("name", "")] = str(stated)
                asset.remove(mesh)
    for element in root.iter("compiler"):
        for name in ("meshdir", "assetdir", "texturedir", "strippath"):
            element.attrib.pop(name, None)
    return missing


def _replace_missing_meshes(
    root: LineElement, missing: dict[str, str], defaults: _Defaults, assumed: Assumptions
) -> str:
    """Replace the shapes of missing meshes; return what was done."""
    for default in root.iter("default"):
        for geom in children(default, "geom"):
            if geom.get("mesh") in missing:
                geom.attrib.pop("mesh")
                if geom.get("type") == "mesh":
                    geom.attrib.update(type="sphere", size=_MARK_M)
    replaced = 0
    for parent, geom, childclass in list(_geoms(root)):
        absent = defaults.value(geom, "mesh", childclass)
        if absent not in missing or defaults.value(geom, "type", childclass) not in (None, "mesh"):
            continue
        replaced += 1
        _replace(parent, geom, defaults.value(geom, "mass", childclass), absent or "", assumed)
    files = ", ".join(sorted(set(missing.values()))[:3])
    return (
        f"{replaced} shapes are left out, their mass is kept: missing mesh files: {files}"
        f"{', ...' if len(missing) > 3 else ''}"
    )


def _replace(
    parent: LineElement, geom: LineElement, mass: str | None, mesh: str, assumed: Assumptions
) -> None:
    is_static = parent.tag == "worldbody"
    has_inertia = parent.find("inertial") is not None
    if is_static or has_inertia:
        mass = "0"
    if mass is None:
        body = parent.get("name", "")
        value = assumed.number(
            f"{mesh}.mass_kg",
            1e-4,
            1e3,
            f"body {body}, {geom.where}: the mesh {mesh} is missing, and the model does not state "
            "its mass",
            likely=0.1,
        )
        mass = repr(value)
    keys = ("name", "pos", "friction")
    kept: dict[str, str] = {key: geom.attrib[key] for key in keys if key in geom.attrib}
    geom.attrib.clear()
    geom.attrib.update(kept, type="sphere", size=_MARK_M, mass=mass)


def _massless(root: LineElement, defaults: _Defaults) -> Iterator[str]:
    """Names of geoms without mass, which get one if they have none."""
    names = {named_geom.get("name") for named_geom in root.iter("geom")}
    number = 0
    for _, geom, childclass in _geoms(root):
        is_looks = any(
            (numbers(defaults.value(geom, key, childclass), 1) or [1.0])[0] == 0.0
            for key in ("mass", "density")
        )
        small = geom.get("size") == _MARK_M
        if not (is_looks or small):
            continue
        if "name" not in geom.attrib:
            while f"_drawn{number}" in names:
                number += 1
            geom.set("name", f"_drawn{number}")
            names.add(f"_drawn{number}")
        yield geom.attrib["name"]
