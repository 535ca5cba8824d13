"""``pose calibrate``: a served robot swings its head, and its source is found."""

import numpy as np
import pytest

from benchmarks.pose_mounts import LIMITS, contains, drawn, errors, found, wrong
from snakewalk.config.errors import InputError
from snakewalk.controller.run.deviation import NO_DEVIATION, Deviation
from tests.helpers.command import snakewalk


@pytest.mark.slow
def test_a_drawn_mount_is_found() -> None:
    off = errors(found(4, NO_DEVIATION, lambda sample, time_s: sample)[0], drawn(4))
    assert all(each <= most for each, most in zip(off, LIMITS, strict=True)), off


@pytest.mark.slow
def test_a_scale_that_friction_hides_is_not_written() -> None:
    """Stiff pitch joints: each friction explains the poses by another scale."""
    with pytest.raises(InputError, match="friction hides the scale") as refused:
        found(2, NO_DEVIATION, lambda sample, time_s: sample, "alternating16")
    assert contains(str(refused.value), drawn(2).scale)


@pytest.mark.slow
def test_a_stated_scale_is_kept_and_another_friction_moves_no_mount() -> None:
    """With the stated scale alone, the fit is 12 mm off."""
    friction = Deviation(along=0.77, across=0.64, law="ellipse")
    config, _ = found(
        21, friction, lambda sample, time_s: sample, "alternating16", states_scale=True
    )
    assert config.scale == pytest.approx(drawn(21).scale, abs=1e-4)
    off_m = np.linalg.norm(np.subtract(config.offset_m, drawn(21).offset_m))
    assert off_m < 0.005


@pytest.mark.slow
def test_another_body_is_rejected() -> None:
    name, change = wrong(1)
    assert name == "circles"
    with pytest.raises(InputError, match="another body"):
        found(1, NO_DEVIATION, change)


def test_a_picture_of_a_board_belongs_to_another_command() -> None:
    ended = snakewalk("pose", "calibrate", "joints", "--port", "sim")
    assert ended.returncode == 2
    assert "snakewalk pose lens" in ended.stderr


@pytest.mark.slow
def test_a_lifted_head_shows_a_mirrored_vertical() -> None:
    name, change = wrong(4)
    assert name == "mirrored"
    with pytest.raises(InputError, match="the head was lifted"):
        found(4, NO_DEVIATION, change, "alternating16", states_scale=True)
