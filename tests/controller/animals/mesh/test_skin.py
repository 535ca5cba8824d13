"""The skin that moves: shares, rest, rigid motions, joints, and what fails as printed."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from snakewalk.controller.animals.mesh.body_model import spindle
from snakewalk.controller.animals.mesh.cross_sections import AROUND, CrossSections, ellipses
from snakewalk.controller.animals.mesh.patches import Tube
from snakewalk.controller.animals.mesh.pde_surface import TURN, PdeSurface
from snakewalk.controller.animals.mesh.rig import posed_m, spine_rig
from snakewalk.controller.animals.mesh.skin import Skin, carried, pde_skin, weights
from snakewalk.controller.gaits.registry import GAITS
from snakewalk.controller.gaits.spine import SpineGait
from snakewalk.controller.images.mesh import Mesh
from snakewalk.controller.track.bone_motion import BoneMotion, from_points, swimming
from tests.oracles.carried_mesh import carry_over

Floats = NDArray[np.float64]
LENGTH_M = 1.2


def sections() -> CrossSections:
    return ellipses(spindle(LENGTH_M))


@pytest.fixture(scope="module")
def skin() -> Skin:
    found = sections()
    return pde_skin(found, Tube.through(found.curves_m, found.stations))


def bent(joint_rad: float, links: int = 12) -> BoneMotion:
    """Two frames: straight, and every joint bent to the left by the same angle."""
    link = LENGTH_M / links
    frames = []
    for bend in (0.0, joint_rad):
        heading = -bend * np.arange(links)
        step = link * np.stack([np.cos(heading), np.sin(heading), 0 * heading], axis=1)
        frames.append(np.concatenate([np.zeros((1, 3)), -np.cumsum(step, axis=0)]))
    return from_points(np.array(frames) + np.array([0.0, 0.0, 0.05]), np.array([0.0, 1.0]))


def test_shares_sum_to_one_and_are_continuous(skin: Skin) -> None:
    uneven = np.array([0.1, 0.3, 0.05, 0.25, 0.3, 0.2])
    held = weights(skin, uneven)
    np.testing.assert_allclose(held.shares.sum(axis=1), 1.0, atol=1e-15)
    assert held.shares.min() >= 0.0
    even = replace(skin, along=np.linspace(0.0, 1.0, 4001))
    held = weights(even, uneven)
    each = np.zeros((4001, 6))
    for k in range(3):
        np.add.at(each, (np.arange(4001), held.bones[:, k]), held.shares[:, k])
    steepest = 1.0 / (uneven.min() / uneven.sum()) / 4000
    assert np.abs(np.diff(each, axis=0)).max() < 1.01 * steepest


def test_the_bind_pose_is_the_rest_pose(skin: Skin) -> None:
    placed = replace(skin, axis_m=0.05)
    np.testing.assert_allclose(
        posed_m(spine_rig(placed, bent(0.3).bone_m), bent(0.3), 0), skin.mesh.vertices, atol=1e-14
    )


def test_a_rigid_motion_of_the_bones_is_one_of_the_skin(skin: Skin) -> None:
    motion = bent(0.4)
    turn = Rotation.from_rotvec([0.4, 1.0, -2.0]).as_matrix()
    moved = replace(
        motion,
        front_m=motion.front_m @ turn.T + [3.0, -1.0, 2.0],
        rotation=turn @ motion.rotation,
    )
    expected = posed_m(spine_rig(skin, motion.bone_m), motion, 1) @ turn.T + [3.0, -1.0, 2.0]
    np.testing.assert_allclose(
        posed_m(spine_rig(skin, moved.bone_m), moved, 1), expected, atol=1e-13
    )


@pytest.mark.parametrize("bend", [0.1, 0.5, 1.0])
def test_the_spine_runs_through_every_joint_and_passes_links_on_the_outside(bend: float) -> None:
    """Closed form at a link's middle: an eighth of the link's length times the sine of the bend."""
    links, motion = 12, bent(bend)
    place = (np.arange(2 * links - 3) + 2) / (2 * links)  # joints and middles, not at the ends
    line = np.stack([-place * LENGTH_M, 0 * place, 0 * place + 0.05], axis=1)
    none = np.zeros((0, 3), np.int64)
    axis = Skin(Mesh(line, line, line[:, :2], none), place, LENGTH_M, 0.05)
    found = posed_m(spine_rig(axis, motion.bone_m), motion, 1)
    joints = motion.front_m[1, 1:]
    np.testing.assert_allclose(found[::2], joints[: len(found[::2])], atol=1e-14)
    for k, point in enumerate(found[1::2], start=1):
        middle = motion.front_m[1, k] - 0.5 * motion.bone_m[k] * motion.rotation[1, k, :, 0]
        beside = motion.rotation[1, k].T @ (point - middle)
        off = motion.bone_m[k] / 8.0 * np.sin(bend)
        assert abs(abs(beside[1]) - off) < 1e-14
        np.testing.assert_allclose(beside[[0, 2]], 0.0, atol=1e-14)


def quarter_turn() -> tuple[Floats, Floats, PdeSurface]:
    """A tube, the places of its spine on a quarter circle, and the surface."""
    v = np.arange(24) * TURN / 24
    u = np.linspace(0.0, 1.0, 31)
    ring = np.stack([0 * v, 0.05 * np.cos(v), 0.05 * np.sin(v)], axis=1)
    surface = PdeSurface.through(np.array([ring - [a, 0, 0] for a in np.linspace(0, 1, 4)]))
    radius = 2.0 / np.pi
    arc = np.stack([-radius * np.sin(u / radius), radius * (1 - np.cos(u / radius)), 0 * u], axis=1)
    return u, arc, surface


def test_a_radial_part_that_does_not_turn_flattens_the_body() -> None:
    """[GC] 2.3 as printed: where the spine has turned by 90 degrees no width across it is left."""
    u, arc, surface = quarter_turn()
    v = np.arange(24) * TURN / 24
    printed = surface.moved_m(u, v, arc - surface.spine_m(u))
    across = np.array([1.0, 0.0, 0.0])  # at the tail, which now runs along y
    assert np.ptp(printed[-1] @ across) < 1e-9
    chords = np.concatenate([arc, arc[-1:] + (arc[-1:] - arc[-2:-1])])
    motion = from_points(np.array([chords, chords]), np.array([0.0, 1.0]))
    points = surface.points_m(u, v).reshape(-1, 3)
    mesh = Mesh(points, points, points[:, :2], np.zeros((0, 3), np.int64))
    ours = Skin(mesh, np.repeat(u, 24) / motion.length_m, motion.length_m, 0.0)
    turned = posed_m(spine_rig(ours, motion.bone_m), motion, 1).reshape(31, 24, 3)
    assert np.ptp(turned[-1] @ across) == pytest.approx(0.1, rel=0.01)


def test_a_mesh_off_the_surface_turns_with_it_and_as_printed_it_does_not(skin: Skin) -> None:
    """[GC] 2.4 adds displacements: in a rigid turn the distance to the surface is not kept."""
    ring = np.flatnonzero(np.abs(skin.along - 0.5) < 0.1)
    off = skin.mesh.vertices[ring] + 0.02 * skin.mesh.normals[ring]
    given = Mesh(off, skin.mesh.normals[ring], skin.mesh.uv[ring], np.zeros((0, 3), np.int64))
    hung = carried(given, skin)
    motion = bent(0.0)
    turn = Rotation.from_rotvec([0.0, 0.0, 0.5 * np.pi]).as_matrix()
    moved = replace(motion, front_m=motion.front_m @ turn.T, rotation=turn @ motion.rotation)
    level = [0.0, 0.0, 0.05 - skin.axis_m]
    np.testing.assert_allclose(
        posed_m(spine_rig(hung, moved.bone_m), moved, 1), (off + level) @ turn.T, atol=1e-12
    )
    surface = posed_m(spine_rig(skin, moved.bone_m), moved, 1)
    printed = carry_over(off, skin.mesh.vertices, surface)
    wrong = np.linalg.norm(printed - (off + level) @ turn.T, axis=1)
    assert wrong.max() > 0.8 * 0.02 * np.sqrt(2.0)


def test_a_mesh_that_is_the_surface_moves_as_the_surface(skin: Skin) -> None:
    hung = carried(skin.mesh, skin)
    np.testing.assert_allclose(
        posed_m(spine_rig(hung, bent(0.5).bone_m), bent(0.5), 1),
        posed_m(spine_rig(skin, bent(0.5).bone_m), bent(0.5), 1),
        atol=1e-12,
    )


def test_the_moved_skin_is_nearly_the_surface_solved_anew_from_moved_curves(skin: Skin) -> None:
    """[GC] 2.2.1 hangs the curves on the bones and solves again; linear in the curves, so near."""
    found = sections()
    motion = swimming(GAITS["anguilliform"](), LENGTH_M)  # type: ignore[arg-type]
    rest = found.curves_m.reshape(-1, 3)
    curves = Mesh(rest, rest, rest[:, :2], np.zeros((0, 3), np.int64))
    hung = Skin(curves, np.repeat(found.stations, AROUND), LENGTH_M, found.axis_m)
    frame = 7
    again = Tube.through(
        posed_m(spine_rig(hung, motion.bone_m), motion, frame).reshape(found.curves_m.shape),
        found.stations,
    )
    solved = pde_skin(found, again).mesh.vertices
    thick = found.curves_m[..., 1].max()
    assert (
        np.abs(solved - posed_m(spine_rig(skin, motion.bone_m), motion, frame)).max() < 0.02 * thick
    )


@pytest.mark.parametrize("name", [n for n, g in GAITS.items() if issubclass(g, SpineGait)])
def test_a_cycle_closes_and_keeps_the_spines_length(name: str) -> None:
    gait = GAITS[name]()
    assert isinstance(gait, SpineGait)
    motion = swimming(gait, 2.0)
    assert motion.time_s[-1] == pytest.approx(1.0 / gait.params.frequency_hz)
    np.testing.assert_allclose(motion.front_m[-1], motion.front_m[0], atol=1e-12)
    np.testing.assert_allclose(motion.rotation[-1], motion.rotation[0], atol=1e-9)
    chord = np.linalg.norm(np.diff(motion.front_m, axis=1), axis=-1)
    np.testing.assert_allclose(chord, 0.02, rtol=1e-3)


def test_the_dolphins_printed_cycle_does_not_close() -> None:
    """[GC] Eq. 11 over t from 0 to 1 with omega = 1.3: the last frame is not the first."""
    p = GAITS["thunniform-dolphin"]().params
    u = np.linspace(0.0, TURN, 50)

    def spine(t: float) -> Floats:
        wave = p.tail * np.cos(p.waves * u + p.phase_rad) * np.sin(TURN * p.frequency_hz * t)
        return np.asarray(wave)

    assert np.abs(spine(1.0) - spine(0.0)).max() > 0.9
    assert np.abs(spine(1.0 / p.frequency_hz) - spine(0.0)).max() < 1e-12


def test_the_printed_travelling_wave_beats_at_another_frequency() -> None:
    """[GC] Eq. 12: with omega = 2 pi f under the bracket a point beats f 2 pi / lambda times."""
    f, lam, u = 1.5, 4.0, 0.3
    period = lam / (TURN * f)
    t = np.linspace(0.0, 1.0, 400)

    def printed(t: Floats) -> Floats:
        return np.asarray(np.sin(TURN / lam * (u - TURN * f * t)))

    np.testing.assert_allclose(printed(t), printed(t + period), atol=1e-9)
    assert np.abs(printed(t) - printed(t + 1.0 / f)).max() > 0.5
