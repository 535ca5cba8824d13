"""A skin by name: of a shipped animal, of a recording's widths, or of anybody's mesh."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from snakewalk.config.animal import FinConfig, SkinConfig
from snakewalk.config.arrays import Floats, Image
from snakewalk.config.errors import InputError
from snakewalk.config.loader import load, locate, shipped
from snakewalk.controller.animals.fish.model import PECTORAL, fish_model
from snakewalk.controller.animals.fish.postures import holds_fish, load_postures
from snakewalk.controller.animals.mesh.body_model import (
    BodyModel,
    body_model,
    read_silhouettes,
    spindle,
)
from snakewalk.controller.animals.mesh.cross_sections import (
    CURVES,
    CrossSections,
    cut,
    ellipses,
    skin_model,
)
from snakewalk.controller.animals.mesh.mesh import picture_around
from snakewalk.controller.animals.mesh.patches import Tube, fins
from snakewalk.controller.animals.mesh.skin import Skin, carried, pde_skin
from snakewalk.controller.animals.mesh.skin_texture import ACROSS, ALONG, painted
from snakewalk.controller.images.mesh import Mesh
from snakewalk.controller.images.mesh_files import MESH_ENDINGS, read_mesh
from snakewalk.controller.track.readers.generated import EMBEDDED, embedded

SKINS = shipped("skins")
"""Names of the shipped skins."""
_DEFAULT_ANIMAL = "snake"
"""Animal whose colours a body without a picture has."""


@dataclass(frozen=True, slots=True)
class Cut:
    """How the curves of a PDE skin are taken."""

    curves: int = CURVES
    order: int = 2
    forward: str | None = None
    up: str | None = None
    surface: bool = False
    """Whether a given mesh is replaced by the surface through its curves."""


@dataclass(frozen=True, slots=True)
class BodySkin:
    """A skin and its texture."""

    name: str
    skin: Skin
    texture: Image | None
    both_sides: bool
    """Whether the inside is drawn, too: a mesh may have holes."""
    facts: dict[str, object]


def is_skin(name: str) -> bool:
    """Whether ``body_skin`` accepts this alone: a shipped skin, a mesh, a matched fish."""
    path = Path(name)
    return name in SKINS or path.suffix.lower() in (*MESH_ENDINGS, ".toml") or holds_fish(path)


def body_skin(name: str, how: Cut | None = None) -> BodySkin:
    """Make the skin of a shipped name, a skin's TOML, a mesh, a fish, or a recording with widths.

    Raises:
        InputError: none of these, or a fault inside it.

    """
    how = Cut() if how is None else how
    if Path(name).suffix.lower() in MESH_ENDINGS:
        return _skin_of_mesh(Path(name), how)
    if holds_fish(Path(name)):
        return shipped_skin(fish_skin(Path(name)), how)
    if is_skin(name):
        return shipped_skin(load(locate("skins", name), SkinConfig), how)
    if name in EMBEDDED:
        return model_skin(spindle(embedded(name).length_m), None, name, how)
    if Path(name).suffix != ".npz":
        raise InputError(
            f"{name}: no such body; shipped skins are {', '.join(SKINS)}, shipped recordings "
            f"{', '.join(EMBEDDED)}; a file is an .npz with widths, .obj, .glb or a skin's .toml"
        )
    return model_skin(body_model(read_silhouettes(Path(name))), None, Path(name).stem, how)


def model_skin(
    model: BodyModel, texture: Image | None, name: str, how: Cut, *, around: bool = False
) -> BodySkin:
    """Cover the ellipses of a body model; without a picture it is painted.

    ``around``: the texture shows the whole skin, not its upper half.
    """
    sections = ellipses(model, curves=how.curves)
    plain = load(locate("skins", _DEFAULT_ANIMAL), SkinConfig)
    worn = _paint(plain, model) if texture is None else texture
    skin = _covered_sections(sections, how.order)[1]
    if around:
        mesh, source = picture_around(skin.mesh)
        skin = replace(skin, mesh=mesh, along=skin.along[source])
    return BodySkin(name, skin, worn, False, {"curves": how.curves})


def shipped_skin(config: SkinConfig, how: Cut) -> BodySkin:
    """Cover the sections of a skin's file, with its fins."""
    model, lift = skin_model(config)
    sections = ellipses(model, lift, how.curves)
    tube, _ = _covered_sections(sections, how.order)
    skin = pde_skin(sections, tube, fins(tube, config.all_fins))
    facts: dict[str, object] = {"curves": how.curves, "fins": len(config.all_fins)}
    return BodySkin(config.name, skin, _paint(config, model), False, facts)


def fish_skin(file: Path) -> SkinConfig:
    """Skin of a matched fish: its widths and height, and the fins of its build ([TH] 3.2.2).

    Pectoral fins have the length seen from above; their angle is not searched, as in the paper.
    """
    fish = load_postures(file).model
    if fish is None:
        raise InputError(
            f"{file}: holds no fish; snakewalk animal fish match writes one from a film"
        )
    plain = fish_model(fish.build)
    config = load(locate("skins", fish.build), SkinConfig)
    higher = float(np.median(fish.half_height / plain.half_height))
    station = np.linspace(0.0, 1.0, len(fish.half_width))
    sections = tuple(
        section.model_copy(
            update={
                "half_width": float(np.interp(section.at, station, fish.half_width)),
                "half_height": higher * section.half_height,
            }
        )
        for section in config.sections
    )
    fins = tuple(_fin(fin, higher, fish.fin) for fin in config.fins)
    changed = {"name": file.stem, "source": f"{file.name} and {config.source}"}
    return config.model_copy(update=changed | {"sections": sections, "fins": fins})


def _fin(plain: FinConfig, higher: float, pectoral: float) -> FinConfig:
    if not (plain.paired and pectoral > 0.0 and PECTORAL[0] <= plain.at <= PECTORAL[1]):
        return plain.model_copy(update={"span": higher * plain.span})
    side = plain.span * float(np.cos(np.radians(plain.around_deg)))
    longer = pectoral / float(np.hypot(side, plain.sweep))
    return plain.model_copy(update={"span": longer * plain.span, "sweep": longer * plain.sweep})


def _skin_of_mesh(file: Path, how: Cut) -> BodySkin:
    """Cut the curves from a mesh, cover them, and hang the mesh on that surface."""
    given = read_mesh(file, how.forward, how.up)
    low, high = given.mesh.vertices.min(axis=0), given.mesh.vertices.max(axis=0)
    start = np.array([high[0], 0.5 * (low[1] + high[1]), 0.0])
    given.solid.apply_translation(-start)
    mesh = replace(given.mesh, vertices=given.mesh.vertices - start)
    sections = cut(given.solid, how.curves, str(file))
    tube, surface = _covered_sections(sections, how.order)
    side = tube.spine_m(sections.stations)[:, 1] / sections.length_m
    facts: dict[str, object] = {
        "forward": given.forward,
        "up": given.up,
        "curves": how.curves,
        "surface_off_mesh_mean": round(_distance(mesh.vertices, surface), 5),
        "spine_off_axis_most": round(float(np.abs(side).max()), 5),
    }
    if how.surface:
        worn = None if given.texture is None else _copied_colours(mesh, given.texture, tube)
        return BodySkin(file.stem, surface, worn, False, facts)
    return BodySkin(file.stem, carried(mesh, surface), given.texture, True, facts)


def _copied_colours(mesh: Mesh, texture: Image, tube: Tube) -> Image:
    """Strip for a tube, in the colours of the nearest corners of the mesh that it replaces."""
    s = np.interp(np.arange(ALONG) / (ALONG - 1), [0.0, 1.0], tube.stations[[0, -1]])
    over = np.arccos(np.linspace(1.0, -1.0, ACROSS))
    nearest = cKDTree(mesh.vertices).query(tube.points_m(s, over))[1]
    u, v = mesh.uv[nearest.T].transpose(2, 0, 1)
    rows = np.rint((1.0 - np.clip(v, 0.0, 1.0)) * (texture.shape[0] - 1)).astype(int)
    columns = np.rint(np.clip(u, 0.0, 1.0) * (texture.shape[1] - 1)).astype(int)
    return np.asarray(texture[rows, columns])


def _covered_sections(sections: CrossSections, order: int) -> tuple[Tube, Skin]:
    tube = Tube.through(sections.curves_m, sections.stations, order)
    return tube, pde_skin(sections, tube)


def _distance(corners_m: Floats, surface: Skin) -> float:
    off = cKDTree(surface.mesh.vertices).query(corners_m)[0]
    return float(np.mean(off)) / surface.length_m


def _paint(config: SkinConfig, model: BodyModel) -> Image:
    high = np.interp(
        config.eye_at, np.linspace(0.0, 1.0, len(model.half_height)), model.half_height
    )
    radius = config.eye_radius, config.eye_radius / max(float(high), config.eye_radius)
    return painted(config.back_rgb, config.band_rgb, config.bands, config.eye_at, radius)
