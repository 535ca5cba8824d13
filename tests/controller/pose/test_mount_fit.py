"""A level motion shows axes, mount, scale and delay of a source."""

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.config.pose import PoseConfig
from snakewalk.controller.pose.mount_fit import MOUNT_OFF, fit_mount
from snakewalk.controller.pose.sample import PoseSample, turned
from snakewalk.controller.pose.tracked_body import tracked_link
from snakewalk.drivers.attitude import about_up

TIMES_S = np.arange(0.0, 12.0, 0.02)
CONFIG = PoseConfig(
    world_m=(0.7, -0.4, 0.0),
    world_deg=(90.0, 0.0, 35.0),
    offset_m=(0.02, -0.03, 0.05),
    offset_deg=(10.0, -20.0, 130.0),
    scale=1.25,
    latency_s=0.12,
)


def way(time_s: Floats) -> Floats:
    heading = 0.6 * np.sin(2.5 * time_s) + 0.4 * np.sin(1.5 * time_s + 0.7)
    x, y = 0.02 * np.cos(2.5 * time_s), 0.12 * np.sin(1.5 * time_s + 0.3)
    return np.column_stack([x, y, heading])


def poses(config: PoseConfig = CONFIG, noise: float = 1.0) -> tuple[Floats, Floats, Floats]:
    rng = np.random.default_rng(3)
    places, rotations = [], []
    delay_s = config.latency_s or 0.0
    for x, y, heading in way(TIMES_S - delay_s):
        link = about_up(heading)
        body_m = np.array([x, y, 0.0]) + link @ config.offset_m
        world = turned(config.world_deg)
        place_m = world.T @ (body_m - config.world_m) / config.scale
        axes = world.T @ link @ turned(config.offset_deg)
        places.append(place_m + noise * 0.003 * rng.standard_normal(3))
        turn = Rotation.from_rotvec(noise * 0.02 * rng.standard_normal(3)).as_matrix()
        rotations.append(turn @ axes)
    return TIMES_S, np.array(places), np.array(rotations)


def test_the_fit_finds_the_source() -> None:
    found = fit_mount(TIMES_S, way(TIMES_S), *poses()).config
    for key in ("world_deg", "offset_deg"):
        off = turned(getattr(found, key)).T @ turned(getattr(CONFIG, key))
        assert np.degrees(Rotation.from_matrix(off).magnitude()) < 1.0
    assert found.scale == pytest.approx(CONFIG.scale, rel=0.02)
    np.testing.assert_allclose(found.offset_m, CONFIG.offset_m, atol=0.005)
    np.testing.assert_allclose(found.world_m, CONFIG.world_m, atol=0.02)
    assert found.latency_s == pytest.approx(0.12, abs=0.01)
    assert found.world_sd_deg == 1.0


@pytest.mark.parametrize("factor", [0.1, 0.5, 0.8, 1.0, 1.2, 2.0, 3.0])
def test_another_friction_mirrors_nothing_and_the_stated_error_contains_the_mount(
    factor: float,
) -> None:
    # with another friction the link moves ``factor`` times as far as the joints predict
    predicted = way(TIMES_S) * [factor, factor, 1.0]
    found = fit_mount(TIMES_S, predicted, *poses(), CONFIG.scale)
    off_m = np.linalg.norm(np.subtract(found.config.offset_m, CONFIG.offset_m))
    assert off_m < MOUNT_OFF * found.residual_m


def test_the_found_source_places_the_link() -> None:
    stamps, places, rotations = poses(noise=0.0)
    found = fit_mount(TIMES_S, way(TIMES_S), stamps, places, rotations).config
    k = 300
    sample = PoseSample(k, stamps[k], places[k], rotations[k], "lab")
    link_m, axes = tracked_link(sample, found)
    x, y, heading = way(stamps[k : k + 1] - 0.12)[0]
    np.testing.assert_allclose(link_m, [x, y, 0.0], atol=2e-3)
    np.testing.assert_allclose(axes, about_up(heading), atol=2e-3)


def _still(places: Floats, rotations: Floats) -> tuple[Floats, Floats]:
    return places, np.tile(rotations[:1], (len(rotations), 1, 1))


def _mirrored(places: Floats, rotations: Floats) -> tuple[Floats, Floats]:
    mirror: Any = np.diag([1.0, -1.0, 1.0])
    return places @ mirror, mirror @ rotations @ mirror


@pytest.mark.parametrize(
    ("change", "words"), [(_still, "another body"), (_mirrored, "mirrored axes")]
)
def test_another_body_and_a_left_handed_frame_are_rejected(change: Any, words: str) -> None:
    stamps, places, rotations = poses()
    with pytest.raises(InputError, match=words):
        fit_mount(TIMES_S, way(TIMES_S), stamps, *change(places, rotations))
