"""Made grounds have the shape that their numbers say: slope, RMS slope, risers, trenches."""

import numpy as np
import pytest

from snakewalk.config.errors import ConfigError
from snakewalk.config.ground import build_ground
from snakewalk.config.heightfield import HeightField
from snakewalk.config.loader import checked, load_run, load_world, locate, shipped
from snakewalk.config.world import WorldConfig


def world(**ground: object) -> WorldConfig:
    return checked(WorldConfig, {"name": "made", "ground": ground}, "made")


def made(**ground: object) -> HeightField:
    field = build_ground(world(**ground))
    assert field is not None
    assert field.z_m.min() == 0.0
    assert field.x0_m == pytest.approx(-field.size_m[0] / 2)
    return field


def triangle_gradients(field: HeightField) -> np.ndarray:
    """(n, 2) gradient of every triangle, by looking inside each."""
    rows, columns = field.z_m.shape
    row, column = np.mgrid[0 : rows - 1, 0 : columns - 1]
    found = []
    for du, dv in ((0.7, 0.3), (0.3, 0.7)):
        x = field.x0_m + (column + du) * field.spacing_m
        y = field.y0_m + (row + dv) * field.spacing_m
        found.append(np.stack(field.gradient(x, y), axis=-1).reshape(-1, 2))
    return np.concatenate(found)


@pytest.mark.parametrize("degrees", [10.0, 15.0, 35.0])
def test_a_ramp_has_its_slope_between_level_ends(degrees: float) -> None:
    slope = float(np.radians(degrees))
    field = made(kind="ramp", slope_rad=slope, length_m=4.0, level_m=2.0, width_m=3.0)
    assert field.size_m == pytest.approx((8.0, 3.0))
    y = np.linspace(-1.4, 1.4, 9)
    np.testing.assert_allclose(field.slope_rad(np.linspace(-1.99, 1.99, 9), y), slope, atol=1e-12)
    np.testing.assert_allclose(field.elevation_m(np.linspace(-4, -2, 9), y), 0.0, atol=1e-12)
    top = 4.0 * np.tan(slope)
    np.testing.assert_allclose(field.elevation_m(np.linspace(2, 4, 9), y), top, atol=1e-12)


def test_a_shore_has_its_waterline_at_zero_between_level_bottom_and_level_land() -> None:
    """A kink lies between samples and is blunt by less than one spacing."""
    slope = 0.15
    field = build_ground(world(kind="shore", slope_rad=slope, depth_m=0.4, rise_m=0.1))
    assert field is not None
    steep, y = np.tan(slope), np.linspace(-2.9, 2.9, 9)
    assert field.elevation_m(0.0, 0.0) == pytest.approx(0.4, abs=1e-9)
    beach = np.linspace(-0.4 / steep, 0.1 / steep, 9)
    np.testing.assert_allclose(
        field.elevation_m(beach, y), 0.4 + steep * beach, atol=0.5 * steep * field.spacing_m
    )
    np.testing.assert_allclose(field.slope_rad(0.9 * beach, y), slope, atol=1e-12)
    assert field.x0_m == pytest.approx(-0.4 / steep - 2.0)
    np.testing.assert_allclose(field.elevation_m(field.x0_m + np.array([0.0, 1.9]), 0.0), 0.0)
    np.testing.assert_allclose(field.elevation_m(0.1 / steep + np.array([0.1, 1.9]), 0.0), 0.5)
    assert field.y0_m == pytest.approx(-3.0)


@pytest.mark.parametrize("seed", range(20))
def test_a_random_field_has_the_rms_slope_that_is_asked(seed: int) -> None:
    slope = float(np.radians(10.0))
    field = made(
        kind="random", rms_slope_rad=slope, correlation_m=0.3, seed=seed, size_m=4.0, spacing_m=0.05
    )
    gradient = triangle_gradients(field)
    assert np.sqrt((gradient**2).sum(axis=1).mean()) == pytest.approx(np.tan(slope), rel=1e-9)


def test_a_random_field_is_gaussian_with_its_correlation_length() -> None:
    """On 30 m square: 1/e at the asked length, RMS height tan(slope) * length / 2, isotropic."""
    field = made(
        kind="random", rms_slope_rad=0.2, correlation_m=0.3, seed=4, size_m=30.0, spacing_m=0.06
    )
    z = field.z_m - field.z_m.mean()
    assert z.std() == pytest.approx(np.tan(0.2) * 0.3 / 2, rel=0.03)
    assert (z[:, :-5] * z[:, 5:]).mean() / z.var() == pytest.approx(np.exp(-1), abs=0.03)
    assert (z[:-5] * z[5:]).mean() / z.var() == pytest.approx(np.exp(-1), abs=0.03)
    along_x, along_y = np.sqrt((triangle_gradients(field) ** 2).mean(axis=0))
    assert along_x == pytest.approx(along_y, rel=0.03)
    assert (z**4).mean() / z.var() ** 2 == pytest.approx(3.0, abs=0.2)


def test_a_seed_gives_the_same_hills_and_another_seed_others() -> None:
    shape = {"kind": "random", "rms_slope_rad": 0.2, "correlation_m": 0.3, "size_m": 3.0}
    one, again, other = (made(**shape, seed=seed) for seed in (1, 1, 2))
    np.testing.assert_array_equal(one.z_m, again.z_m)
    assert abs(np.corrcoef(one.z_m.ravel(), other.z_m.ravel())[0, 1]) < 0.3


@pytest.mark.parametrize(
    ("pattern", "levels"), [("up", (0, 1, 2, 3, 4)), ("up-down", (0, 1, 0, 1, 0))]
)
def test_steps_are_level_treads_and_flanks_one_sample_wide(
    pattern: str, levels: tuple[int, ...]
) -> None:
    field = made(kind="steps", height_m=0.04, tread_m=0.5, count=4, pattern=pattern, level_m=1.0)
    middle = field.x0_m + field.size_m[0] / 2 + 0.5 * (np.arange(5) - 2)
    np.testing.assert_allclose(field.elevation_m(middle, 0.3), 0.04 * np.array(levels), atol=1e-12)
    slope = field.slope_rad(np.linspace(-1.7, 1.7, 34001), 0.0)
    assert slope.max() == pytest.approx(np.arctan(0.04 / 0.01))
    assert (slope > 0.0).mean() * 3.4 == pytest.approx(4 * 0.01, rel=0.02)
    assert field.size_m[0] == pytest.approx(2 * 1.0 + 3 * 0.5 - 0.01)


def test_trenches_have_their_width_at_the_edges_and_their_distance() -> None:
    field = made(kind="gaps", width_m=0.08, depth_m=0.1, distance_m=0.6, count=5, level_m=1.0)
    x = np.linspace(-1.9, 1.9, 38001)
    below = field.elevation_m(x, -0.2) < 0.1 - 1e-9
    edges = x[1:][np.diff(below.astype(int)) != 0]
    assert len(edges) == 10
    np.testing.assert_allclose(edges[1::2] - edges[::2], 0.08, atol=2e-3)
    np.testing.assert_allclose((edges[1::2] + edges[::2]) / 2, 0.6 * (np.arange(5) - 2), atol=2e-3)
    floor = field.elevation_m(x, 0.0) < 1e-9
    assert floor.mean() * 3.8 == pytest.approx(5 * 0.06, rel=0.02)
    assert field.size_m[0] == pytest.approx(2 * 1.0 + 4 * 0.6 + 0.08)


@pytest.mark.parametrize(
    ("ground", "words"),
    [
        ({"kind": "random", "rms_slope_rad": 0.2, "correlation_m": 0.05}, "at least 3 spacing_m"),
        (
            {"kind": "steps", "height_m": 0.04, "tread_m": 0.015, "count": 3},
            "at least 2 spacing_m",
        ),
        (
            {"kind": "gaps", "width_m": 0.02, "depth_m": 0.1, "distance_m": 0.6, "count": 2},
            "at least 3 spacing_m",
        ),
        (
            {"kind": "gaps", "width_m": 0.3, "depth_m": 0.1, "distance_m": 0.3, "count": 2},
            "trenches merge",
        ),
        ({"kind": "ramp"}, "slope_rad: is required"),
    ],
)
def test_ground_that_a_grid_cannot_hold_is_refused(ground: dict[str, object], words: str) -> None:
    with pytest.raises(ConfigError, match=words):
        world(**ground)


@pytest.mark.parametrize("name", ["ramp-15", "random-10", "steps-4cm", "gaps-8cm", "shore"])
def test_relief_scales_heights_and_limits_alike(name: str) -> None:
    plain = load_world(name)
    field, half = build_ground(plain), build_ground(plain.with_relief(0.5))
    assert field is not None
    assert half is not None
    np.testing.assert_allclose(half.z_m, 0.5 * field.z_m, atol=1e-9)
    limits = plain.planner, plain.with_relief(0.5).planner
    assert limits[1].variance_limit_m2 == pytest.approx(0.25 * limits[0].variance_limit_m2)


def test_shipped_runs_start_and_end_on_their_ground() -> None:
    """The head's waypoints, and a body length behind the start, are on the field."""
    for name in shipped("runs"):
        run = load_run(name)
        ground = load_world(run.world).ground
        if ground.kind in {"flat", "elevation"}:
            continue
        field = build_ground(load_world(run.world))
        assert field is not None
        points = np.vstack([run.start_m, run.waypoints_m])
        away = (points[0] - points[1]) / np.hypot(*(points[0] - points[1]))
        behind = points[0] + 1.2 * away
        assert field.contains(*points.T).all(), name
        assert field.contains(*behind), name


@pytest.mark.parametrize("name", shipped("worlds"))
def test_a_shipped_world_names_its_law_and_the_reason(name: str) -> None:
    assert load_world(name).friction.law is not None
    text = locate("worlds", name).read_text(encoding="utf-8")
    (line,) = (line for line in text.splitlines() if line.startswith("law ="))
    assert len(line.partition("#")[2].split()) >= 4
