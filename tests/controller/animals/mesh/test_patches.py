"""Patches join without a crease, and fins stand on the skin."""

import numpy as np
import pytest
from numpy.typing import NDArray

from snakewalk.config.animal import FinConfig, SkinConfig
from snakewalk.config.errors import InputError
from snakewalk.config.loader import load, locate, shipped
from snakewalk.controller.animals.mesh.cross_sections import ellipses, skin_model
from snakewalk.controller.animals.mesh.patches import Tube, fin, fins
from snakewalk.controller.animals.mesh.pde_surface import TURN, PdeSurface

Floats = NDArray[np.float64]
V = np.arange(24) * TURN / 24


def rings(count: int = 7) -> Floats:
    """A body whose rings change shape along it, and whose middle bends."""
    s = np.linspace(0.0, 1.0, count)[:, None]
    wide = 0.03 + 0.05 * np.sin(np.pi * s) * (1.0 + 0.3 * np.cos(2 * V))
    return np.stack(
        [np.repeat(-s, 24, axis=1), wide * np.cos(V) + 0.1 * s**2, 1.5 * wide * np.sin(V)], axis=-1
    )


def step(tube: Tube, at: int, along: int) -> float:
    """Largest difference of a derivative by the way over the skin, where two patches meet."""
    way = np.linalg.norm(np.diff(rings(), axis=0), axis=-1).mean(axis=1)
    before = tube.patches[at].points_m(1.0, V, along) / way[at] ** along
    after = tube.patches[at + 1].points_m(0.0, V, along) / way[at + 1] ** along
    return float(np.abs(before - after).max())


@pytest.mark.parametrize("order", [1, 2, 3])
def test_every_curve_is_met(order: int) -> None:
    curves, s = rings(), np.linspace(0.0, 1.0, 7)
    tube = Tube.through(curves, s, order)
    np.testing.assert_allclose(tube.points_m(s, V), curves, atol=1e-10)
    np.testing.assert_allclose(tube.spine_m(s), curves.mean(axis=1), atol=1e-10)


def test_patches_have_one_slope_where_they_meet_and_at_order_three_one_curvature() -> None:
    s = np.linspace(0.0, 1.0, 7)
    for order, smooth in ((2, 1), (3, 2)):
        tube = Tube.through(rings(), s, order)
        for along in range(smooth + 1):
            assert max(step(tube, at, along) for at in range(5)) < 1e-7


def test_patches_through_four_curves_each_meet_in_a_crease() -> None:
    """[GC] 2.1 as printed: curves 1-4 and 4-7 share a curve, and no tangent plane."""
    curves = rings()
    first, second = PdeSurface.through(curves[:4]), PdeSurface.through(curves[3:])
    before, after = first.points_m(1.0, V, along=1)[0], second.points_m(0.0, V, along=1)[0]
    cosine = (before * after).sum(axis=1) / np.linalg.norm(before, axis=1)
    crease_deg = np.degrees(np.arccos(np.clip(cosine / np.linalg.norm(after, axis=1), -1, 1)))
    assert crease_deg.max() > 2.0


def test_between_curves_a_cone_stays_a_cone_within_a_thousandth() -> None:
    s = np.linspace(0.0, 1.0, 9)
    wide = (0.02 + 0.08 * s)[:, None]
    cone = np.stack([-np.repeat(s[:, None], 24, 1), wide * np.cos(V), wide * np.sin(V)], -1)
    at = np.linspace(0.0, 1.0, 81)
    points = Tube.through(cone, s).points_m(at, V)
    radius = np.hypot(points[..., 1], points[..., 2])
    np.testing.assert_allclose(radius, np.repeat((0.02 + 0.08 * at)[:, None], 24, 1), atol=1e-3)


def body(name: str) -> tuple[SkinConfig, Tube]:
    config = load(locate("skins", name), SkinConfig)
    model, lift = skin_model(config)
    sections = ellipses(model, lift)
    return config, Tube.through(sections.curves_m, sections.stations)


@pytest.mark.fast_cases(4)
@pytest.mark.parametrize("name", shipped("skins"))
def test_a_fins_first_curve_lies_on_the_skin_and_its_tip_outside(name: str) -> None:
    config, tube = body(name)
    for build, grown in zip(config.all_fins, fins(tube, config.all_fins), strict=True):
        turn = np.arange(len(grown.root_s)) * TURN / len(grown.root_s)
        root = grown.surface.points_m(0.0, turn)[0]
        for k in range(0, len(turn), 5):
            on = tube.points_m(grown.root_s[k : k + 1], grown.root_v[k : k + 1])[0, 0]
            np.testing.assert_allclose(root[k], on, atol=1e-9)
        out = grown.surface.points_m(1.0, turn)[0].mean(axis=0) - root.mean(axis=0)
        around = np.radians(build.around_deg)
        assert out @ [0.0, np.cos(around), np.sin(around)] == pytest.approx(build.span, rel=0.25)


def test_paired_fins_are_mirror_images() -> None:
    config, tube = body("trout")
    left = next(f for f in config.fins if f.paired)
    right = left.model_copy(update={"around_deg": 180.0 - left.around_deg})
    turn = np.linspace(0.0, TURN, 13)
    one = fin(tube, left).surface.points_m([0.0, 0.5, 1.0], turn)
    other = fin(tube, right).surface.points_m([0.0, 0.5, 1.0], -turn)
    np.testing.assert_allclose(one * [1.0, -1.0, 1.0], other, atol=1e-9)


def test_useless_patches_are_refused() -> None:
    with pytest.raises(InputError, match="4 or more at increasing stations"):
        Tube.through(rings()[:3], np.linspace(0, 1, 3))
    with pytest.raises(InputError, match="order 1"):
        Tube.through(rings(), np.linspace(0, 1, 7), order=4)
    with pytest.raises(InputError, match="leaves the body"):
        fin(body("trout")[1], FinConfig(at=0.98, chord=0.2, around_deg=90, span=0.1))
