"""Eq. 1 to 4, and pictures of a morphing model."""

import numpy as np
import pytest

from snakewalk.controller.mapping.mosaic.local_model import cells, sampled
from snakewalk.controller.mapping.mosaic.morph import MorphableModel, morphable
from snakewalk.controller.mapping.mosaic.rasteriser import Canvas, SecondTexture, draw
from snakewalk.controller.mapping.mosaic.relative_pose import RelativePose
from snakewalk.controller.mapping.mosaic.scale_flow import flow_problem, solve_flow
from tests.controller.mapping.mosaic.test_relative_pose import K, nearer, wall

VIEW = K @ np.eye(3, 4)


def approach(ahead_m: float = 0.5) -> MorphableModel:
    first = wall()
    second = nearer(first, ahead_m)
    pose = RelativePose(np.eye(3), np.array([0.0, 0.0, -ahead_m]), np.ones(1, bool))
    return morphable(first, second, pose, solve_flow(flow_problem(first, second, pose)))


@pytest.mark.costs("morphs a whole model")
def test_the_morph_begins_at_one_model_and_ends_at_the_next() -> None:
    morph = approach()
    common, places = morph.common, morph.counterpart_px
    assert common.mean() > 0.4
    np.testing.assert_array_equal(morph.points_m(0.0), morph.first.points_m)  # Eq. 1
    there = sampled(morph.second.points_m.astype(np.float32), places)
    met = morph.pose.back(there)  # Eq. 3
    np.testing.assert_allclose(morph.points_m(1.0)[common], met[common], atol=1e-6)
    half = 0.5 * (morph.points_m(0.0) + morph.points_m(1.0))
    np.testing.assert_allclose(morph.points_m(0.5), half)


@pytest.mark.slow
def test_the_flow_of_a_wall_is_its_growth() -> None:
    morph = approach()
    rows, columns = np.nonzero(morph.common)
    truth = (np.stack([columns, rows], -1) - K[:2, 2]) * (2.0 / 1.5) + K[:2, 2]
    off = np.linalg.norm(morph.counterpart_px[rows, columns] - truth, axis=1)
    assert np.median(off) < 0.4
    assert np.quantile(off, 0.95) < 1.5


def test_flow_at_one_scale_is_worse() -> None:
    """Fig. 4 (c)."""
    first = wall()
    second = nearer(first, 1.0)
    pose = RelativePose(np.eye(3), np.array([0.0, 0.0, -1.0]), np.ones(1, bool))
    exact = {}
    for name, scales in (("all", (1.0, 1.25, 1.67, 2.0, 2.5)), ("one", (1.0,))):
        flow = solve_flow(flow_problem(first, second, pose, scales))
        v, u = np.meshgrid(flow.rows, flow.columns, indexing="ij")
        truth = np.stack([u - K[0, 2], v - K[1, 2]], -1)  # the wall becomes twice as large
        off = np.linalg.norm(flow.flow_px - truth, axis=-1)
        exact[name] = float((off < 1.0).sum() / np.isfinite(off).sum())
    assert exact["all"] > 0.85
    assert exact["one"] < 0.6


@pytest.mark.slow
def test_the_printed_potts_term_is_less_exact() -> None:
    first = wall()
    second = nearer(first, 0.5)
    pose = RelativePose(np.eye(3), np.array([0.0, 0.0, -0.5]), np.ones(1, bool))
    problem = flow_problem(first, second, pose)
    exact = []
    for printed in (False, True):
        flow = solve_flow(problem, 0.5, printed)
        v, u = np.meshgrid(flow.rows, flow.columns, indexing="ij")
        truth = np.stack([u - K[0, 2], v - K[1, 2]], -1) / 3.0
        off = np.linalg.norm(flow.flow_px - truth, axis=-1)
        exact.append(float((off < 1.0).sum() / np.isfinite(off).sum()))
    assert exact[0] > exact[1] + 0.1


def test_the_first_picture_is_the_photograph_and_holes_stay_holes() -> None:
    model = wall()
    points = model.points_m.copy()
    points[40:60, 80:120] = np.nan
    canvas = Canvas.blank(240, 180)
    draw(canvas, points, VIEW, cells(points), model.image)
    inside = canvas.drawn
    assert not inside[41:59, 81:119].any()
    assert inside.mean() > 0.95
    off = np.abs(canvas.colour[inside].astype(int) - model.image[inside])
    assert off.max() <= 1
    assert canvas.depth_m[inside] == pytest.approx(2.0)


def test_a_slanted_plane_is_drawn_in_perspective_and_the_nearer_surface_wins() -> None:
    """A colour ramp on a floor: the column of a pixel's texel follows from its own depth."""
    far, near = 8.0, 1.0
    z = np.linspace(far, near, 30)
    points = np.stack(np.broadcast_arrays(np.linspace(-1, 1, 5)[None], 0.5, z[:, None]), -1)
    ramp = np.repeat(np.linspace(0, 250, 30)[:, None, None], 5, axis=1)
    image = np.repeat(ramp, 3, axis=2).astype(np.uint8)
    canvas = Canvas.blank(240, 180)
    whole = np.ones((29, 4), bool)
    draw(canvas, points, VIEW, whole, image)
    rows = np.arange(110, 170)
    depth = 0.5 * 200.0 / (rows - K[1, 2])
    kept = (depth > near + 0.1) & (depth < far - 0.1)
    np.testing.assert_allclose(canvas.depth_m[rows[kept], 120], depth[kept], rtol=1e-6)
    wanted = 250 * (far - depth[kept]) / (far - near)
    np.testing.assert_allclose(canvas.colour[rows[kept], 120, 0], wanted, atol=2.0)
    across, down = np.meshgrid(np.linspace(-1, 1, 5), np.linspace(-1, 1, 30))
    wall_m = np.stack([across, down, np.full_like(down, 3.0)], -1)
    draw(canvas, wall_m, VIEW, whole, np.full_like(image, 77))
    assert canvas.colour[rows[depth > 3.1], 120, 0] == pytest.approx(77)
    assert (canvas.colour[rows[kept & (depth < 2.9)], 120, 0] > 77).all()


def test_the_second_texture_is_mixed_in_where_a_vertex_has_a_counterpart() -> None:
    """Eq. 2 to 4."""
    model = wall()
    tall, wide = model.valid.shape
    there_px = np.stack(np.meshgrid(np.arange(wide), np.arange(tall)), axis=-1) + 0.5
    there_px[:, 120:] = np.nan
    ramp = np.repeat(np.arange(wide, dtype=np.uint8)[None, :, None], tall, axis=0)
    second = np.ascontiguousarray(np.broadcast_to(ramp, (tall, wide, 3)))
    first = np.full((tall, wide, 3), 200, np.uint8)
    canvas = Canvas.blank(240, 180)
    draw(canvas, model.points_m, VIEW, model.cells, first, SecondTexture(second, there_px, 0.25))
    columns = np.arange(10, 110)
    expected = 0.75 * 200 + 0.25 * (columns + 0.5)
    np.testing.assert_allclose(canvas.colour[90, columns, 0], expected, atol=1.0)
    assert (canvas.colour[90, 125:230] == 200).all()


def test_what_no_camera_saw_is_grey() -> None:
    canvas = Canvas.blank(3, 6)
    canvas.colour[2:] = 90
    canvas.depth_m[2:] = 1.0
    canvas.depth_m[4, 1] = np.inf
    seen = canvas.with_unseen()
    assert (seen[:2] == 150).all()
    assert (seen[4, 1] == 150).all()
    assert (seen[2:4] == 90).all()


def test_blocked_pixels_do_not_change() -> None:
    model = wall()
    canvas = Canvas.blank(240, 180)
    canvas.colour[:, :100] = 7
    canvas.depth_m[:, :100] = 5.0  # farther than the wall
    canvas.blocked = canvas.drawn
    draw(canvas, model.points_m, VIEW, model.cells, model.image)
    assert (canvas.colour[:, :100] == 7).all()
    off = canvas.colour[5:-5, 105:-5].astype(int) - model.image[5:-5, 105:-5]
    assert np.abs(off).max() <= 1
