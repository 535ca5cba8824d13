"""The drawn robot: its skin lies on the ground, its eyes look ahead, and a waypoint is a pole."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from snakewalk.config.heightfield import HeightField
from snakewalk.config.loader import load_robot, load_world
from snakewalk.config.robot import RobotConfig
from snakewalk.config.robot.links import LinkConfig
from snakewalk.sim.rendering.looks import (
    AHEAD,
    BACK,
    CONTOURS,
    EYE,
    GRASS,
    HEAD,
    HIDDEN,
    HIGHLAND,
    LOWLAND,
    PUPIL,
    REACHED,
    RING_PARTS,
    ROCK,
    SHALLOW,
    SURFACE,
    TEXELS,
    TONGUE,
    FloorPrint,
    Marks,
    Scene,
    SkinLook,
    dressed_model,
    mark_reached,
)

ROBOT = load_robot("yaw16")
BOX, CAPSULE, CYLINDER, ELLIPSOID, SPHERE = (
    int(kind)
    for kind in (
        mujoco.mjtGeom.mjGEOM_BOX,
        mujoco.mjtGeom.mjGEOM_CAPSULE,
        mujoco.mjtGeom.mjGEOM_CYLINDER,
        mujoco.mjtGeom.mjGEOM_ELLIPSOID,
        mujoco.mjtGeom.mjGEOM_SPHERE,
    )
)


def drawn(robot: RobotConfig = ROBOT, marks: Marks | None = None) -> mujoco.MjModel:
    scene = Scene(robot, load_world("flat"), None)
    return dressed_model(scene) if marks is None else dressed_model(scene, marks=marks)


def of_colours(model: mujoco.MjModel, kind: int, *colours: tuple[float, ...]) -> np.ndarray:
    same = [np.abs(model.geom_rgba - np.array(colour)).max(axis=1) < 1e-6 for colour in colours]
    return np.flatnonzero(np.any(same, axis=0) & (model.geom_type == kind))


def skin(model: mujoco.MjModel) -> np.ndarray:
    return of_colours(model, CAPSULE, *BACK)


def test_the_skin_swells_to_the_middle_tapers_to_the_tail_and_lies_on_the_ground() -> None:
    model = drawn()
    geoms = skin(model)
    radius = np.array(ROBOT.link_radii_m)[1:]
    thick = model.geom_size[geoms, 0]
    assert len(geoms) == ROBOT.link_count - 1
    assert (thick <= radius + 1e-12).all()
    along = np.arange(1, ROBOT.link_count) / (ROBOT.link_count - 1)
    widest = int(np.argmax(thick / radius))
    assert along[widest] == pytest.approx(0.55, abs=0.07)
    share = thick / radius
    assert (np.diff(share)[:widest] > 0.0).all()
    assert (np.diff(share)[widest:] < 0.0).all()
    assert share[-1] == pytest.approx(0.45, abs=0.01)
    for link, geom in enumerate(geoms, start=1):
        near, far = ends(model, geom)
        np.testing.assert_allclose(near[:2], 0.0, atol=1e-9)
        np.testing.assert_allclose(far[:2], [-ROBOT.link_lengths_m[link], 0.0], atol=1e-9)
        assert near[2] == pytest.approx(far[2])
    # the lower edge is where that of the link itself is
    np.testing.assert_allclose(model.geom_pos[geoms, 2] - thick, -radius, atol=1e-9)


def test_a_link_without_a_length_has_no_skin() -> None:
    lengths_m = [0.07, 0.0, 0.07, 0.0, 0.07]
    links = [{"length_m": length_m} for length_m in lengths_m]
    robot = RobotConfig.model_validate({"name": "crossed", "joint_axes": "ypyp", "links": links})
    assert robot.link_lengths_m == tuple(lengths_m)
    assert len(skin(drawn(robot))) == 2


def test_two_eyes_look_to_both_sides_of_the_front() -> None:
    model = drawn()
    left, right = sorted(of_colours(model, SPHERE, EYE), key=lambda geom: -model.geom_pos[geom, 1])
    one, other = model.geom_pos[left], model.geom_pos[right]
    np.testing.assert_allclose(one * [1.0, -1.0, 1.0], other, atol=1e-12)
    assert (one > 0.0).all()
    assert one[1] < ROBOT.link_radii_m[0]
    pupils = of_colours(model, SPHERE, PUPIL)
    assert len(pupils) == 2
    for pupil, eye in zip(
        sorted(pupils, key=lambda k: -model.geom_pos[k, 1]), (left, right), strict=True
    ):
        off = model.geom_pos[pupil] - model.geom_pos[eye]
        small, large = model.geom_size[[pupil, eye], 0]
        assert small < large
        assert large - small < np.linalg.norm(off) < large, "it shows, and does not come off"
        assert off[0] > 0.0


def ends(model: mujoco.MjModel, geom: int) -> np.ndarray:
    """(2, 3) ends of the axis of a capsule, in its body, in the order of their distance from 0."""
    turn = np.empty(9)
    mujoco.mju_quat2Mat(turn, model.geom_quat[geom])
    half = turn.reshape(3, 3)[:, 2] * model.geom_size[geom, 1]
    both = model.geom_pos[geom] + np.array([[-1.0], [1.0]]) * half
    return both[np.argsort(np.linalg.norm(both, axis=1))]


def test_the_skin_is_thinnest_at_the_tail_and_bent_nowhere() -> None:
    """Among many links the profile shows: a neck, its full radius, and a slope that begins at 0."""
    robot = RobotConfig(name="long", joint_axes="y" * 160)
    model = drawn(robot)
    share = model.geom_size[skin(model), 0] / np.array(robot.link_radii_m)[1:]
    along = np.arange(1, robot.link_count) / (robot.link_count - 1)
    assert np.interp(0.55 / 2, along, share) == pytest.approx(0.8 + 0.2 * np.sqrt(0.5), abs=1e-3)
    assert np.interp([0.0, 0.55, 1.0], along, share) == pytest.approx([0.8, 1.0, 0.45], abs=0.004)
    slope = np.diff(share) / np.diff(along)
    assert np.abs(np.diff(slope)).max() < 0.1 * np.abs(slope).max()
    assert np.interp(0.775, along, share) == pytest.approx(1.0 - 0.55 / 2.0**1.5, abs=2e-3)


def test_head_neck_and_tongue_fit_together_over_the_ground() -> None:
    links = [{"length_m": 0.1}, *4 * [{"length_m": 0.07}]]
    robot = RobotConfig.model_validate({"name": "big-headed", "joint_axes": "yyyy", "links": links})
    model = drawn(robot)
    radius_m = robot.link_radii_m[0]
    half_m = 0.05
    (skull,) = of_colours(model, ELLIPSOID, HEAD)
    size, middle = model.geom_size[skull], model.geom_pos[skull]

    def depth(point: np.ndarray) -> float:
        """1 on the skull, less in it."""
        return float(np.linalg.norm((point - middle) / size))

    assert middle[1] == 0.0
    assert middle[2] - size[2] == pytest.approx(-radius_m, rel=0.05)
    assert size[1] == pytest.approx(radius_m, rel=0.05)
    assert half_m < middle[0] + size[0] < 2.0 * half_m
    eyes = of_colours(model, SPHERE, EYE)
    assert all(0.8 < depth(model.geom_pos[eye]) < 1.0 for eye in eyes), "half in the skull"
    (neck,) = of_colours(model, CAPSULE, HEAD)
    front, back = ends(model, neck)
    assert back[0] == pytest.approx(-half_m), "it ends at the first joint"
    assert depth(front) < 1.0
    assert np.linalg.norm(front - back) < half_m
    assert back[2] - model.geom_size[neck, 0] == pytest.approx(-radius_m)
    assert back[2] == pytest.approx(front[2])
    assert 0.5 * radius_m < model.geom_size[neck, 0] < radius_m
    tongue = of_colours(model, CAPSULE, TONGUE)
    stem, *forks = sorted(tongue, key=lambda geom: abs(model.geom_pos[geom, 1]))
    root, split = ends(model, stem)
    assert 0.8 < depth(root) < 1.0 < depth(split), "it comes out of the mouth"
    assert root[1] == pytest.approx(0.0, abs=1e-12)
    assert (root[2], split[1]) == pytest.approx((split[2], 0.0), abs=1e-9)
    tips = []
    for fork in forks:
        start, tip = ends(model, fork)
        np.testing.assert_allclose(start, split, atol=1e-9)
        assert 0.0 < tip[0] - split[0] < half_m
        assert abs(tip[2] - split[2]) < 0.1 * radius_m
        assert 0.0 < model.geom_size[fork, 0] < model.geom_size[stem, 0] < 0.1 * radius_m
        tips.append(tip)
    np.testing.assert_allclose(tips[0] * [1.0, -1.0, 1.0], tips[1], atol=1e-9)
    assert 0.0 < abs(tips[0][1]) < 0.5 * radius_m


@pytest.mark.parametrize("link", [0, 3])
def test_the_lenses_are_at_the_front_of_a_bar_on_a_mast(link: int) -> None:
    robot = load_robot("alternating16-stereo")
    assert robot.stereo_head is not None
    head = robot.stereo_head.model_copy(update={"link": link})
    robot = robot.model_copy(update={"stereo_head": head})
    model = drawn(robot)
    mast, bar = sorted(of_colours(model, CAPSULE, PUPIL), key=lambda geom: model.geom_size[geom, 0])
    body = model.body(f"link{link}").id
    assert model.geom_bodyid[[mast, bar]].tolist() == [body, body]
    foot, top = ends(model, mast)
    right, left = sorted(ends(model, bar), key=lambda end: end[1])
    lens_m = 0.0 if link == 0 else -0.5 * robot.link_lengths_m[link]
    before_m = lens_m - foot[0] - model.geom_size[bar, 0]
    assert 0.0 < before_m < 0.005
    np.testing.assert_allclose(foot, [foot[0], 0.0, 0.0], atol=1e-9)
    np.testing.assert_allclose(top, [foot[0], 0.0, head.height_m], atol=1e-9)
    np.testing.assert_allclose(right, left * [1.0, -1.0, 1.0], atol=1e-9)
    np.testing.assert_allclose(0.5 * (right + left), top, atol=1e-9)
    assert head.baseline_m < left[1] - right[1] < head.baseline_m + 0.03
    assert 0.0 < model.geom_size[mast, 0] < model.geom_size[bar, 0] < 0.02


def test_legs_have_balls_over_their_seams_and_feet_at_their_ends() -> None:
    robot = load_robot("salamander")
    model = drawn(robot)
    visible = model.geom_group == 1
    kinds = [joint.place for joint in robot.limb_joints]
    assert {joint.has_foot for joint in robot.limb_joints} == {False, True}
    for k, joint in enumerate(robot.limb_joints):
        pair = robot.limbs[joint.pair]
        here = visible & (model.geom_bodyid == model.body(f"link{robot.link_count + k}").id)
        (rod,) = np.flatnonzero(here & (model.geom_type == CAPSULE))
        start, end = ends(model, rod)
        np.testing.assert_allclose(start, 0.0, atol=1e-9)
        np.testing.assert_allclose(
            end, (0.0, joint.outward * pair.segments_m[joint.place], 0.0), atol=1e-9
        )
        assert model.geom_size[rod, 0] == pytest.approx(pair.foot_radius_m)
        assert model.geom_rgba[rod] == pytest.approx(BACK[joint.place % 2])
        balls = np.flatnonzero(here & (model.geom_type == SPHERE))
        assert len(balls) == (joint.place > 0) + joint.has_foot
        over = model.geom_size[balls, 0] / pair.foot_radius_m
        assert ((over > 1.0) & (over < 1.1)).all()
        for ball in balls:
            is_foot = model.geom_rgba[ball] == pytest.approx(HEAD)
            np.testing.assert_allclose(model.geom_pos[ball], end if is_foot else start, atol=1e-9)
            assert is_foot or model.geom_rgba[ball] == pytest.approx(BACK[joint.place % 2])
    assert len(set(kinds)) > 1


def test_what_touches_the_ground_is_drawn_by_other_geoms() -> None:
    model = drawn(load_robot("salamander"))
    names = [model.geom(k).name for k in range(model.ngeom)]
    touching = [name.startswith(("belly", "foot")) for name in names]
    assert any(touching)
    assert (model.geom_group[touching] == 4).all()
    assert set(model.geom_group[np.logical_not(touching)].tolist()) == {0, 1}
    assert model.geom("ground").group[0] == 0
    look = model.geom_group == 1
    assert not model.geom_contype[look].any()
    assert not model.geom_conaffinity[look].any()
    assert model.body_mass.sum() == pytest.approx(load_robot("salamander").mass_kg)


def test_flat_ground_is_checked_and_has_no_border() -> None:
    model = drawn()
    assert (model.geom("ground").size[:2] <= 0.0).all()
    assert bool(model.mat("ground").texuniform[0])
    checks = texture(model, "ground").reshape(-1, 3)
    assert len(np.unique(checks @ [1, 256, 65536])) == 3, "two fields and their edges"
    assert np.ptp(checks.astype(int), axis=1).max() < 15, "grey"
    assert checks.min() > 140


@pytest.mark.parametrize("fine", [False, True])
def test_a_fine_model_is_smoother_under_the_same_sun(fine: bool) -> None:
    model = dressed_model(Scene(ROBOT, load_world("flat"), None), fine=fine)
    quality = model.vis.quality
    assert (quality.offsamples > 0) == fine
    assert (quality.numslices > 24, quality.numstacks > 12) == (fine, fine)
    assert model.nlight == 1
    np.testing.assert_allclose(model.light("sun").dir, [0.48, 0.52, -0.7071], atol=1e-3)
    assert not model.light("sun").castshadow[0]
    brightest = model.light("sun").diffuse + model.vis.headlight.ambient
    assert (brightest + model.vis.headlight.diffuse <= 1.35).all()
    assert (brightest > 0.95).all()
    assert not np.any(model.vis.headlight.specular)
    assert model.stat.extent == pytest.approx(ROBOT.length_m)
    assert 0.0 < model.vis.map.znear * model.stat.extent < 0.05


def texture(model: mujoco.MjModel, name: str) -> np.ndarray:
    """(rows, columns, 3) texels."""
    found = model.tex(name)
    shape = int(found.height[0]), int(found.width[0]), 3
    start = int(found.adr[0])
    return np.asarray(model.tex_data[start : start + int(np.prod(shape))]).reshape(shape)


def test_ground_is_coloured_by_its_height_with_lines_of_a_constant_width() -> None:
    x, y = np.meshgrid(np.linspace(-1.0, 1.0, 41), np.linspace(0.0, 3.0, 61))
    slope = HeightField(0.2 * np.maximum(y - 1.0, 0.0) + 0.0 * x, 0.05, -1.0, 0.0)
    model = dressed_model(Scene(ROBOT, load_world("flat"), slope))
    texels = texture(model, "ground")
    assert texels.shape == (TEXELS, TEXELS, 3)
    np.testing.assert_array_equal(texels, np.repeat(texels[:, :1], TEXELS, axis=1))
    rows = texels[::-1, 0].astype(float)  # from low y on
    share = np.clip(1.5 * (np.arange(TEXELS) + 0.5) / TEXELS - 0.5, 0.0, 1.0)
    plain = LOWLAND + (HIGHLAND - LOWLAND) * share[:, None]
    dark = (rows / plain).mean(axis=1)
    level = np.arange(TEXELS) < TEXELS / 3 - 2
    np.testing.assert_allclose(rows[level], np.broadcast_to(LOWLAND, rows[level].shape), atol=1.0)
    lines = np.flatnonzero(dark < 0.98)
    starts = lines[np.flatnonzero(np.diff(lines, prepend=-9) > 1)]
    assert len(starts) == CONTOURS + 1
    assert np.diff(starts) == pytest.approx(TEXELS / 1.5 / CONTOURS, abs=2)
    assert ((dark[lines] > 0.7) & (dark[lines] < 0.98)).all()
    widths = np.diff([*np.flatnonzero(np.diff(lines, prepend=-9) > 1), len(lines)])
    assert set(widths[1:-1].tolist()) <= {2, 3}
    between = (dark >= 0.98) & ~level
    np.testing.assert_allclose(rows[between], plain[between], atol=3.0)


def test_ground_has_the_colours_of_its_map() -> None:
    colour = np.random.default_rng(1).integers(0, 255, (5, 9, 3)).astype(np.uint8)
    field = HeightField(np.zeros((5, 9)), 0.5, -2.0, 1.0, colour=colour)
    texels = texture(dressed_model(Scene(ROBOT, load_world("flat"), field)), "ground")
    row = np.linspace(TEXELS - 1, 0, 5).astype(int)
    column = np.linspace(0, TEXELS - 1, 9).astype(int)
    np.testing.assert_array_equal(texels[row[:, None], column[None]], colour)
    # a sample colours the ground up to half way to its neighbours
    half = TEXELS // 16
    np.testing.assert_array_equal(texels[-1, half - 2], colour[0, 0])
    np.testing.assert_array_equal(texels[-1, half + 2], colour[0, 1])
    np.testing.assert_array_equal(texels[TEXELS - TEXELS // 8 + 2, 0], colour[0, 0])
    np.testing.assert_array_equal(texels[TEXELS - TEXELS // 8 - 2, 0], colour[1, 0])


def test_water_is_a_clear_surface_over_a_blue_floor() -> None:
    world = load_world("pool")
    model = dressed_model(Scene(ROBOT, world, None))
    (surface,) = of_colours(model, BOX, SURFACE)
    place, size = model.geom_pos[surface], model.geom_size[surface]
    np.testing.assert_allclose(place, [0.0, 0.0, world.ground.depth_m])
    np.testing.assert_allclose(size[:2], 0.5 * world.ground.size_m)
    assert 0.0 < size[2] < 0.01
    floor = texture(model, "ground")[::32, ::32].reshape(-1, 3) / 255.0
    for tone in SHALLOW:
        assert np.abs(floor - tone).max(axis=1).min() < 0.01
    assert not len(of_colours(drawn(), BOX, SURFACE))


def test_a_print_lies_just_over_the_floor() -> None:
    picture = np.arange(64, dtype=np.uint8).reshape(8, 8)
    sheets = [FloorPrint((0.5, -0.25), 0.3, picture), FloorPrint((2.0, 1.0), 0.1, 255 - picture)]
    model = dressed_model(Scene(ROBOT, load_world("flat"), None), prints=sheets)
    for k, sheet in enumerate(sheets):
        geom = model.geom(f"print{k}")
        np.testing.assert_allclose(geom.pos[:2], sheet.place_m)
        assert 0.0 < geom.pos[2] < 0.002
        np.testing.assert_allclose(geom.size[:2], 0.5 * sheet.side_m)
        assert geom.group[0] == 0, "a camera sees it without the body"
        assert geom.matid[0] == model.mat(f"print{k}").id
        expected = np.repeat(sheet.picture[..., None], 3, axis=2)
        np.testing.assert_array_equal(texture(model, f"print{k}"), expected)
        material = model.mat(f"print{k}")
        assert material.texid[mujoco.mjtTextureRole.mjTEXROLE_RGB] == model.tex(f"print{k}").id
        assert material.specular[0] == material.reflectance[0] == 0.0


def test_a_skin_hangs_on_bones_that_float() -> None:
    vertices = np.array([[0.0, 0.0, 0.0], [0.0, 0.1, 0.0], [-0.5, 0.0, 0.0], [-0.5, 0.1, 0.1]])
    link = np.array([[0, 1], [0, 1], [0, 1], [1, 0]])
    share = np.array([[1.0, 0.0], [0.75, 0.25], [0.5, 0.5], [1.0, 0.0]])
    look = SkinLook(
        vertices,
        np.array([[0.0, 0.0], [0.0, 1.0], [1.0, 0.25], [1.0, 1.0]]),
        np.array([[0, 1, 2], [1, 2, 3]]),
        link,
        share,
        np.array([[0.0, 0.0, 0.0], [-0.4, 0.0, 0.0]]),
        np.arange(36, dtype=np.uint8).reshape(3, 4, 3),
        free=True,
    )
    model = dressed_model(Scene(ROBOT, load_world("flat"), None), look=look)
    assert (model.nq, model.nbody, model.nskin) == (14, 3, 1)
    np.testing.assert_allclose(model.skin_vert, vertices, atol=1e-7)
    np.testing.assert_allclose(model.skin_texcoord, look.uv * [1.0, -1.0] + [0.0, 1.0])
    np.testing.assert_array_equal(model.skin_face, look.faces)
    np.testing.assert_allclose(model.skin_bonebindpos, look.rest_m, atol=1e-7)
    np.testing.assert_allclose(model.skin_bonebindquat, [[1.0, 0.0, 0.0, 0.0]] * 2)
    assert model.skin_bonebodyid.tolist() == [model.body("link0").id, model.body("link1").id]
    assert model.skin_bonevertid.tolist() == [0, 1, 2, 1, 2, 3]
    np.testing.assert_allclose(model.skin_bonevertweight, [1.0, 0.75, 0.5, 0.25, 0.5, 1.0])
    np.testing.assert_array_equal(texture(model, "animal"), look.texture)
    np.testing.assert_allclose(model.skin_rgba, [[1.0, 1.0, 1.0, 1.0]])
    assert not len(skin(model)), "no capsules"
    plain = dressed_model(
        Scene(ROBOT, load_world("flat"), None), look=replace(look, texture=None, free=False)
    )
    np.testing.assert_allclose(plain.skin_rgba, [BACK[0]])
    assert plain.nbody == 1 + ROBOT.link_count
    assert plain.skin_matid[0] == -1


@pytest.mark.parametrize("hollow", [False, True])
def test_a_waypoint_is_a_pole_on_the_ground_in_a_ring(hollow: bool) -> None:
    marks = Marks([(1.0, 2.0)], 0.25, hollow=hollow)
    model = drawn(marks=marks)
    pole = model.geom("waypoint0")
    assert int(pole.type[0]) == CYLINDER
    assert pole.pos[2] == pytest.approx(pole.size[1])  # from the ground on
    assert 0.2 < 2.0 * pole.size[1] < 0.5
    assert 0.0 < pole.size[0] < 0.02
    np.testing.assert_allclose(pole.pos[:2], (1.0, 2.0))
    np.testing.assert_allclose(pole.rgba, HIDDEN if hollow else AHEAD, atol=1e-6)
    for part in range(RING_PARTS):
        geom = model.geom(f"waypoint0ring{part}")
        both = ends(model, geom.id)
        np.testing.assert_allclose(np.hypot(*(both[:, :2] - pole.pos[:2]).T), 0.25, rtol=1e-6)
        np.testing.assert_allclose(both[:, 2], 0.004, atol=1e-9)
        is_hidden = hollow and part % 2 == 1
        np.testing.assert_allclose(geom.rgba, HIDDEN if is_hidden else AHEAD, atol=1e-6)
        turned = np.arctan2(*(geom.pos[1::-1] - pole.pos[1::-1]))
        expected = 2.0 * np.pi * (part + 0.5) / RING_PARTS
        assert np.exp(1j * turned) == pytest.approx(np.exp(1j * expected), abs=1e-6)


@pytest.mark.parametrize("hollow", [False, True])
def test_what_is_seen_of_a_reached_waypoint_turns_green(hollow: bool) -> None:
    model = drawn(marks=Marks([(1.0, 2.0), (2.0, 2.0)], 0.25, hollow=hollow))
    before = model.geom_rgba.copy()
    mark_reached(model, 1)
    names = [model.geom(k).name for k in range(model.ngeom)]
    green = np.array([name.startswith("waypoint1") for name in names]) & (before[:, 3] > 0.0)
    assert green.sum() == (RING_PARTS // 2 if hollow else RING_PARTS + 1)
    np.testing.assert_allclose(model.geom_rgba[green], [REACHED] * green.sum(), atol=1e-6)
    np.testing.assert_array_equal(model.geom_rgba[~green], before[~green])


def test_a_waypoint_on_a_hill_stands_on_it() -> None:
    x, y = np.meshgrid(*2 * [np.linspace(-2.0, 2.0, 41)])
    hill = HeightField(0.1 * x + 0.2 * y, 0.1, -2.0, -2.0)
    model = dressed_model(Scene(ROBOT, load_world("flat"), hill), Marks([(1.0, 0.5)], 0.25))
    pole = model.geom("waypoint0")
    ground = model.geom("ground").pos
    assert pole.pos[2] - pole.size[1] == pytest.approx(0.2)
    for part in range(RING_PARTS):
        for east, north, up in ends(model, model.geom(f"waypoint0ring{part}").id):
            assert up == pytest.approx(0.1 * east + 0.2 * north + 0.004, abs=1e-6)
    assert ground[2] <= 0.0


def test_marks_are_as_large_as_the_body_and_beside_a_long_body_no_larger() -> None:
    def radius_m(link_length_m: float) -> float:
        robot = ROBOT.model_copy(update={"link_length_m": link_length_m})
        scene = Scene(robot, load_world("flat"), None)
        pole = dressed_model(scene, Marks([(1.0, 0.0)])).geom("waypoint0")
        assert pole.pos[2] == pytest.approx(pole.size[1])
        return float(pole.size[0]) / robot.length_m

    lengths_m = (0.01, 0.03)
    assert radius_m(lengths_m[0]) == pytest.approx(radius_m(lengths_m[1])) == pytest.approx(0.008)
    assert radius_m(0.3) < 0.5 * radius_m(0.03)


def test_ground_without_marks_is_grass_where_it_is_level_and_rock_where_it_is_steep() -> None:
    east_m = np.linspace(0.0, 4.0, 81)
    elevation_m = np.broadcast_to(np.maximum(east_m - 2.0, 0.0), (81, 81))
    ground = HeightField(elevation_m, 0.05, 0.0, 0.0)

    def colours(marks: Marks | None) -> np.ndarray:
        model = dressed_model(Scene(ROBOT, load_world("flat"), ground), marks)
        texture = model.tex("ground")
        rows, columns = int(texture.height[0]), int(texture.width[0])
        pixels = model.tex_data[int(texture.adr[0]) :][: rows * columns * 3]
        return pixels.reshape(rows, columns, 3).astype(float)

    natural = colours(None)
    for part, colour in ((natural[:, :500], GRASS), (natural[:, 530:], ROCK)):
        np.testing.assert_allclose(part.mean(axis=(0, 1)), colour, atol=4.0)
    # a contour line has the same colour along a level line, and nature has not
    assert np.ptp(colours(Marks())[:, 900], axis=0).max() < 2.0
    assert np.ptp(natural[:, 900], axis=0).max() > 20.0


def test_a_floor_without_marks_has_no_lines_a_metre() -> None:
    model = dressed_model(Scene(ROBOT, load_world("flat"), None), None)
    texture = model.tex("ground")
    pixels = model.tex_data[int(texture.adr[0]) :][: int(texture.width[0]) ** 2 * 3]
    np.testing.assert_allclose(pixels.reshape(-1, 3).mean(axis=0), GRASS, atol=4.0)


def test_the_head_is_as_thick_as_the_first_link() -> None:
    links = [LinkConfig(radius_m=0.02 + 0.001 * k) for k in range(ROBOT.link_count)]
    robot = ROBOT.model_copy(update={"links": links})
    model = drawn(robot)
    (head,) = of_colours(model, int(mujoco.mjtGeom.mjGEOM_ELLIPSOID), HEAD)
    assert model.geom_size[head, 1] == pytest.approx(1.02 * 0.02)


def test_bright_spots_are_of_rock() -> None:
    """Half a slope of rock everywhere: the spots alone decide between grass and rock."""
    east_m = np.linspace(0.0, 4.0, 81)
    ground = HeightField(np.broadcast_to(0.5 * east_m, (81, 81)), 0.05, 0.0, 0.0)
    model = dressed_model(Scene(ROBOT, load_world("flat"), ground), None)
    texture = model.tex("ground")
    size = int(texture.height[0])
    pixels = model.tex_data[int(texture.adr[0]) :][: size * size * 3].reshape(-1, 3).astype(float)
    redness = pixels[:, 0] / pixels[:, 1]
    assert np.corrcoef(redness, pixels[:, 1])[0, 1] > 0.5
