"""Looks of the body and its ground in pictures, without effect on the physics."""

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from numpy.typing import ArrayLike
from scipy.ndimage import gaussian_filter

from snakewalk.config import colours
from snakewalk.config.arrays import Floats, Image, Ints
from snakewalk.config.colours import rgb, rgba
from snakewalk.config.errors import InputError
from snakewalk.config.ground import water_surface_m
from snakewalk.config.heightfield import HeightField
from snakewalk.config.robot import RobotConfig
from snakewalk.config.world import WorldConfig
from snakewalk.sim.physics.body import finish, mjcf
from snakewalk.sim.rendering.shade import SUN_DIRECTION

Rgba = tuple[float, float, float, float]
BACK: tuple[Rgba, Rgba] = ((0.80, 0.56, 0.20, 1), (0.36, 0.22, 0.11, 1))
HEAD: Rgba = (0.25, 0.15, 0.08, 1)
EYE: Rgba = (0.95, 0.80, 0.25, 1)
PUPIL: Rgba = (0.02, 0.02, 0.02, 1)
TONGUE: Rgba = (0.75, 0.10, 0.15, 1)
AHEAD: Rgba = rgba(colours.TO_COME)
REACHED: Rgba = rgba(colours.REACHED)
HIDDEN: Rgba = (0.0, 0.0, 0.0, 0.0)
"""Colour of hidden objects."""
RING_PARTS = 32
LOWLAND, HIGHLAND = (np.array(rgb(colour), float) for colour in (colours.LOWLAND, colours.HIGHLAND))
SHALLOW = [0.30, 0.56, 0.66], [0.26, 0.51, 0.62]
SURFACE: Rgba = (0.55, 0.80, 0.92, 0.13)
CONTOURS = 12
GRASS, ROCK = (np.array(colour, float) for colour in ((122, 128, 78), (142, 124, 100)))
"""Colours of ground without marks, level and steep (ours)."""
ROCK_SLOPE = 0.5
"""Slope at which ground without marks is half rock (ours)."""
TEXELS = 1024
_CAPSULE = mujoco.mjtGeom.mjGEOM_CAPSULE
_ELLIPSOID = mujoco.mjtGeom.mjGEOM_ELLIPSOID
_SPHERE = mujoco.mjtGeom.mjGEOM_SPHERE
_CYLINDER = mujoco.mjtGeom.mjGEOM_CYLINDER


@dataclass(frozen=True, slots=True)
class SkinLook:
    """An animal's skin on the links, in place of capsules; the body at rest lies along -x."""

    vertices_m: Floats
    """(V, 3) corners of the skin at rest, m."""
    uv: Floats
    """(V, 2) places of the corners in the texture, 0 to 1."""
    faces: Ints
    """(F, 3) triangles of the skin, as numbers of corners."""
    link: Ints
    """(V, B) links that carry a corner."""
    share: Floats
    """(V, B) shares of the links in each corner; they sum to 1."""
    rest_m: Floats
    """(L, 3) origins of the links' bodies at rest: the middle of the head, then the joints."""
    texture: Image | None
    """(H, W, 3), first row at v = 1; None is the colour of ``BACK``."""
    free: bool = False
    """Whether each link floats by itself, as the bones of a motion that no robot makes: a pose is
    then (7 L,), place and unit quaternion of each."""
    spine: int = 0
    """Number of bones of the spine, which come first; 0: all."""


@dataclass(frozen=True, slots=True)
class FloorPrint:
    """A printed sheet on level ground, its upper edge to the north."""

    place_m: tuple[float, float]
    """Position of the middle of the print."""
    side_m: float
    picture: Image
    """(N, N) grey picture of the print."""


@dataclass(frozen=True, slots=True)
class Marks:
    """Marks drawn on the ground."""

    waypoints_m: Sequence[tuple[float, float]] = ()
    """Waypoints that a film draws as rings."""
    waypoint_radius_m: float = 0.3
    reached_s: Sequence[float] = ()
    """Times at which the rings of the waypoints turn green, in order."""
    paths: Sequence[tuple[float, Floats]] = ()
    """Paths that a film draws as dots: the time from which each is in force, and (P, 2) points."""
    hollow: bool = False
    """Whether the arrivals are not measured: rings are dashed then, without poles."""


@dataclass(frozen=True, slots=True)
class Scene:
    """A body and its ground."""

    robot: RobotConfig
    world: WorldConfig
    ground: HeightField | None
    """Height field of the world; None on a flat floor."""


def dressed_model(
    scene: Scene,
    marks: Marks | None = Marks(),
    *,
    look: SkinLook | None = None,
    fine: bool = False,
    prints: Sequence[FloorPrint] = (),
    additions: Sequence[Callable[[mujoco.MjSpec], None]] = (),
) -> mujoco.MjModel:
    """Build the model with skin, floor, sky, and waypoints (poles and rings).

    ``marks`` None is natural ground, without waypoints and contour lines. ``look`` None is a
    capsule per link. ``fine`` smooths edges, at three times the cost of a software renderer.
    ``additions`` change the model before it is compiled.

    Raises:
        InputError: the installed MuJoCo cannot edit models.

    """
    if not hasattr(mujoco.MjSpec, "geom"):
        raise InputError(
            f"films and drawn views need MuJoCo 3.3 or newer, and {mujoco.__version__} is "
            "installed; install it with pip install 'mujoco>=3.3'"
        )
    robot, world, ground = scene.robot, scene.world, scene.ground
    spec = mujoco.MjSpec.from_string(mjcf(robot, world, ground, 0.002))
    if look is not None and look.free:
        _replace_robot(spec, len(look.rest_m))
    for geom in spec.geoms:
        geom.group = 4 if geom.name.startswith(("belly", "foot")) else 0  # other geoms draw it
    _light(spec, robot, fine)
    _floor(spec, ground)
    if look is None:
        _skin(spec, robot)
    else:
        _animal(spec, look)
    for add in additions:
        add(spec)
    _water(spec, world, ground)
    for k, sheet in enumerate(prints):
        _print(spec, f"print{k}", sheet)
    if marks is not None:
        for k, (x, y) in enumerate(marks.waypoints_m):
            _mark(spec, f"waypoint{k}", ground, (x, y), marks, mark_size(robot))
    model = finish(spec.compile(), ground)
    if ground is not None or (marks is None and water_surface_m(world, ground) is None):
        _paint(model, ground, marks is None)
    return model


def mark_size(robot: RobotConfig) -> float:
    """Size of marks relative to those of a body of 1 m, at most 1."""
    return min(1.0, robot.length_m)


def _mark(
    spec: mujoco.MjSpec,
    name: str,
    ground: HeightField | None,
    at_m: tuple[float, float],
    marks: Marks,
    size: float,
) -> None:
    """Add a waypoint: a pole and a ring."""
    x, y = at_m
    hollow = marks.hollow
    z = 0.0 if ground is None else float(ground.elevation_m(x, y))
    half_m = 0.15 * size
    pole = _add(spec.worldbody, _CYLINDER, (0.008 * size, half_m, 0), AHEAD, pos=(x, y, z + half_m))
    pole.name = name
    if hollow:
        pole.rgba = HIDDEN
    ring = _ring(ground, x, y, marks.waypoint_radius_m)
    for part, (before, other) in enumerate(itertools.pairwise(ring)):
        piece = _rod(spec.worldbody, 0.007 * size, AHEAD, (*before, *other))
        piece.name = f"{name}ring{part}"
        if hollow and part % 2:
            piece.rgba = HIDDEN


def _replace_robot(spec: mujoco.MjSpec, bones: int) -> None:
    robot = spec.body("link0")
    if hasattr(spec, "delete"):
        spec.delete(robot)
    else:  # the first versions of MuJoCo 3.3
        spec.detach_body(robot)
    for k in range(bones):
        bone = spec.worldbody.add_body(name=f"link{k}", mass=1.0, inertia=[1.0, 1.0, 1.0])
        bone.explicitinertial = True
        bone.add_freejoint()


def mark_reached(model: mujoco.MjModel, waypoint: int) -> None:
    """Turn the visible parts of a waypoint green."""
    for name in (f"waypoint{waypoint}", *(f"waypoint{waypoint}ring{n}" for n in range(RING_PARTS))):
        if model.geom(name).rgba[3] > 0.0:
            model.geom(name).rgba = REACHED


def _ring(ground: HeightField | None, x: float, y: float, radius_m: float) -> Floats:
    """Corners (RING_PARTS + 1, 3) of a circle on the ground."""
    turn = np.linspace(0.0, 2.0 * np.pi, RING_PARTS + 1)
    east, north = x + radius_m * np.cos(turn), y + radius_m * np.sin(turn)
    z = np.zeros_like(turn) if ground is None else ground.elevation_m(east, north)
    return np.stack([east, north, z + 0.004], axis=1)


def _add(
    body: mujoco.MjsBody,
    kind: mujoco.mjtGeom,
    size: ArrayLike,
    rgba: Rgba,
    **place: Sequence[float],
) -> mujoco.MjsGeom:
    return body.add_geom(
        type=kind, size=size, rgba=rgba, contype=0, conaffinity=0, mass=0, group=1, **place
    )


def _rod(
    body: mujoco.MjsBody, radius_m: float, rgba: Rgba, ends: Sequence[float]
) -> mujoco.MjsGeom:
    return _add(body, _CAPSULE, np.full(3, radius_m), rgba, fromto=ends)


def _ball(
    body: mujoco.MjsBody, radius_m: float, rgba: Rgba, place: Sequence[float] = (0, 0, 0)
) -> None:
    _add(body, _SPHERE, np.full(3, radius_m), rgba, pos=place)


def _light(spec: mujoco.MjSpec, robot: RobotConfig, fine: bool) -> None:
    spec.visual.quality.offsamples = 4 if fine else 0
    spec.visual.quality.numslices, spec.visual.quality.numstacks = (28, 16) if fine else (20, 10)
    spec.visual.headlight.ambient = [0.32, 0.32, 0.34]
    spec.visual.headlight.diffuse = [0.25, 0.25, 0.25]
    spec.visual.headlight.specular = [0.0, 0.0, 0.0]
    spec.visual.map.znear = 0.02
    spec.stat.extent = robot.length_m
    spec.worldbody.add_light(
        name="sun",
        **_directional(),
        pos=list(-3.0 * SUN_DIRECTION),
        dir=list(SUN_DIRECTION),
        diffuse=[0.75, 0.73, 0.68],
        specular=[0.25, 0.25, 0.25],
        castshadow=False,
    )


def _directional() -> dict[str, Any]:
    """Return the type of a light in this version of MuJoCo."""
    types = getattr(mujoco, "mjtLightType", None)  # from 3.3.2
    return {"directional": True} if types is None else {"type": types.mjLIGHT_DIRECTIONAL}


def _floor(spec: mujoco.MjSpec, ground: HeightField | None) -> None:
    spec.add_texture(
        name="sky",
        type=mujoco.mjtTexture.mjTEXTURE_SKYBOX,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT,
        rgb1=[0.78, 0.86, 0.93],
        rgb2=[0.42, 0.58, 0.76],
        width=256,
        height=256,
    )
    texture = spec.add_texture(
        name="ground",
        type=mujoco.mjtTexture.mjTEXTURE_2D,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_CHECKER,
        mark=mujoco.mjtMark.mjMARK_EDGE,
        rgb1=[0.66, 0.68, 0.70],
        rgb2=[0.60, 0.62, 0.645],
        markrgb=[0.72, 0.74, 0.76],
    )
    texture.width = texture.height = 512 if ground is None else TEXELS
    material = spec.add_material(name="ground", texuniform=ground is None)
    material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = "ground"
    material.specular = 0.05
    material.shininess = 0.1
    material.reflectance = 0.0
    floor = spec.geom("ground")
    floor.material = "ground"
    if ground is None:
        floor.size = [0.0, 0.0, 0.1]


def _print(spec: mujoco.MjSpec, name: str, sheet: FloorPrint) -> None:
    side = len(sheet.picture)
    texture = spec.add_texture(
        name=name, type=mujoco.mjtTexture.mjTEXTURE_2D, width=side, height=side, nchannel=3
    )
    texture.data = np.repeat(sheet.picture[..., None], 3, axis=2).tobytes()
    material = spec.add_material(name=name, specular=0.0, reflectance=0.0)
    material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = name
    size = 0.5 * sheet.side_m, 0.5 * sheet.side_m, 0.001
    place = *sheet.place_m, 0.001
    geom = _add(spec.worldbody, mujoco.mjtGeom.mjGEOM_PLANE, size, (1, 1, 1, 1), pos=place)
    geom.name = name
    geom.material = name
    geom.group = 0


def _water(spec: mujoco.MjSpec, world: WorldConfig, ground: HeightField | None) -> None:
    """Tint the floor below water, and draw the transparent surface."""
    water = water_surface_m(world, ground)
    if water is None:
        return
    if ground is None:
        spec.texture("ground").rgb1, spec.texture("ground").rgb2 = SHALLOW
    middle_m, size_m = water
    surface = *(0.5 * size_m).tolist(), 0.001
    _add(spec.worldbody, mujoco.mjtGeom.mjGEOM_BOX, surface, SURFACE, pos=middle_m.tolist())


def _paint(model: mujoco.MjModel, ground: HeightField | None, is_natural: bool) -> None:
    """Colour the ground by the map's colours, else naturally or by elevation with contour lines."""
    texture = model.tex("ground")
    size = int(texture.width[0]) * int(texture.height[0]) * 3
    start = int(texture.adr[0])
    if ground is None:
        colour = _natural_colours(np.zeros((int(texture.height[0]), int(texture.width[0]))))
    else:
        colour = _ground_colours(ground, is_natural)
    # the first row of a texture has the largest y, that of a height field the smallest
    model.tex_data[start : start + size] = colour[::-1].clip(0, 255).astype(np.uint8).ravel()


def _ground_colours(ground: HeightField, is_natural: bool) -> Floats:
    """Colours (TEXELS, TEXELS, 3) of a height field, 0 to 255."""
    w, h = ground.size_m
    x = ground.x0_m + (np.arange(TEXELS) + 0.5) / TEXELS * w
    y = ground.y0_m + (np.arange(TEXELS) + 0.5) / TEXELS * h
    z = ground.elevation_m(*np.meshgrid(x, y))
    if ground.colour is not None:
        column = np.rint((x - ground.x0_m) / ground.spacing_m).astype(int)
        row = np.rint((y - ground.y0_m) / ground.spacing_m).astype(int)
        return np.asarray(ground.colour[row[:, None], column[None]])
    if is_natural:
        return _natural_colours(np.hypot(*np.gradient(z, h / TEXELS, w / TEXELS)))
    level = (z - z.min()) / max(float(np.ptp(z)), 1e-9)
    colour = LOWLAND + (HIGHLAND - LOWLAND) * level[..., None]
    colour *= 1.0 - 0.28 * _contours(level * CONTOURS)[..., None]
    return np.asarray(colour)


def _natural_colours(slope: Floats) -> Floats:
    """Colours (n, m, 3) of grass with spots of several sizes, and of rock where it is steep."""
    rng = np.random.default_rng(0)
    spots = np.zeros_like(slope)
    for size in (1, 4, 16, 64):
        noise = rng.standard_normal(slope.shape)
        spots += size * gaussian_filter(noise, size, mode="wrap")
    rock = np.clip(0.5 + (slope - ROCK_SLOPE) / ROCK_SLOPE + 0.3 * spots, 0.0, 1.0)[..., None]
    return np.asarray((GRASS + (ROCK - GRASS) * rock) * (1.0 + 0.25 * spots[..., None]))


def _contours(level: Floats) -> Floats:
    """Share (n, m) of each texel that a line of whole ``level`` covers, of constant width."""
    rise = np.hypot(*np.gradient(level))
    flat = rise < 1e-6
    texels = np.abs(level - np.round(level)) / np.where(flat, 1.0, rise)
    covered: Floats = np.where(flat, 0.0, np.clip(1.5 - texels, 0.0, 1.0))
    return covered


def _skin(spec: mujoco.MjSpec, robot: RobotConfig) -> None:
    """A capsule per link; a broad head with eyes and a forked tongue."""
    links = robot.link_count
    lengths_m = robot.link_lengths_m
    radii_m = robot.link_radii_m
    thickness = _thickness_m(robot)
    for i in range(1, links):
        if lengths_m[i] == 0.0:
            continue
        body = spec.body(f"link{i}")
        thick = thickness[i]
        low = thick - radii_m[i]  # the belly stays on the ground
        ends = (0.0, 0.0, low, -lengths_m[i], 0.0, low)
        _rod(body, thick, BACK[i % 2], ends)
    _legs(spec, robot)
    _mast(spec, robot)
    head = spec.body("link0")
    r = radii_m[0]
    half = lengths_m[0] / 2
    skull = (half * 1.25, r * 1.02, r * 0.78)
    _add(head, _ELLIPSOID, skull, HEAD, pos=(half * 0.2, 0, -0.2 * r))
    _rod(head, r * 0.8, HEAD, (-0.6 * half, 0, -0.2 * r, -half, 0, -0.2 * r))
    for side in (-1.0, 1.0):
        _ball(head, r * 0.24, EYE, (half * 0.62, side * r * 0.62, r * 0.30))
        _ball(head, r * 0.14, PUPIL, (half * 0.72, side * r * 0.74, r * 0.36))
        fork = (half * 1.9, 0, -0.35 * r, half * 2.2, side * r * 0.3, -0.3 * r)
        _rod(head, r * 0.05, TONGUE, fork)
    _rod(head, r * 0.06, TONGUE, (half * 1.3, 0, -0.35 * r, half * 1.9, 0, -0.35 * r))


def _mast(spec: mujoco.MjSpec, robot: RobotConfig) -> None:
    """A rod with a bar across; the lenses are at its front."""
    config = robot.stereo_head
    if config is None:
        return
    body = spec.body(f"link{config.link}")
    middle = 0.0 if config.link == 0 else -0.5 * robot.link_lengths_m[config.link]
    back = middle - 0.012
    top = config.height_m
    half = 0.5 * config.baseline_m + 0.008
    _rod(body, 0.004, PUPIL, (back, 0, 0, back, 0, top))
    _rod(body, 0.010, PUPIL, (back, -half, top, back, half, top))


def _legs(spec: mujoco.MjSpec, robot: RobotConfig) -> None:
    """A capsule per segment, a ball over each seam, and the feet.

    The geoms that touch the ground are not drawn, like bellies.
    """
    for k, joint in enumerate(robot.limb_joints):
        pair = robot.limbs[joint.pair]
        body = spec.body(f"link{robot.link_count + k}")
        end = pair.segments_m[joint.place] * joint.outward
        thick = pair.foot_radius_m
        colour = BACK[joint.place % 2]
        _rod(body, thick, colour, (0, 0, 0, 0, end, 0))
        if joint.place:  # the round ends of both segments overlap
            _ball(body, 1.04 * thick, colour)
        if joint.has_foot:
            _ball(body, 1.02 * thick, HEAD, (0, end, 0))


def _animal(spec: mujoco.MjSpec, look: SkinLook) -> None:
    """A skin that MuJoCo bends with the links' bodies."""
    links = len(look.rest_m)
    skin = spec.add_skin(name="animal", rgba=BACK[0])
    if look.texture is not None:
        high, wide = look.texture.shape[:2]
        texture = spec.add_texture(
            name="animal", type=mujoco.mjtTexture.mjTEXTURE_2D, width=wide, height=high, nchannel=3
        )
        texture.data = look.texture.tobytes()
        material = spec.add_material(name="animal")
        material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = "animal"
        material.specular = 0.2
        material.shininess = 0.3
        skin.material = "animal"
        skin.rgba = [1.0, 1.0, 1.0, 1.0]
    skin.vert = look.vertices_m.ravel()
    skin.texcoord = (look.uv * [1.0, -1.0] + [0.0, 1.0]).ravel()  # the first row is at 0
    skin.face = look.faces.ravel().tolist()
    skin.bodyname = [f"link{k}" for k in range(links)]
    skin.bindpos = look.rest_m.ravel()
    skin.bindquat = np.tile([1.0, 0.0, 0.0, 0.0], links)
    carried = [np.nonzero((look.link == k) & (look.share > 0.0)) for k in range(links)]
    skin.vertid = [rows.tolist() for rows, _ in carried]
    skin.vertweight = [look.share[both].tolist() for both in carried]


def _thickness_m(robot: RobotConfig) -> Floats:
    """Skin radius (L,) of each link: the robot's profile, or thinner at neck and tail."""
    links = robot.link_count
    if robot.body_profile is not None:
        return np.array(robot.radii_m(2 * links + 1))[1::2]  # at the links' middles
    along = np.arange(links) / (links - 1)
    thick = 0.80 + 0.20 * np.sin(np.pi * np.minimum(along / 0.55, 1.0) / 2)
    thick *= 1.0 - 0.55 * np.maximum(0.0, (along - 0.55) / 0.45) ** 1.5
    return np.array(robot.link_radii_m) * thick
