"""Drawn bars beyond, beside and behind a body: which of them belong to it, and which are ghosts."""

import cv2
import numpy as np
import pytest

from snakewalk.config.arrays import Image
from snakewalk.controller.images.medial_axis import Skeleton, in_equal_chords
from snakewalk.controller.images.residual import check_residual, is_ghost
from snakewalk.controller.images.silhouette import Polarity, Silhouette
from snakewalk.controller.track.frame_status import FrameStatus

GROUND, LEVEL = 150, 100
SHAPE = (120, 200)
BODY = (50, 60, 10, 80)
"""Top, left, rows, columns: 10 px wide, its tips at x = 60 and 139."""
Bar = tuple[int, int, int, int]


def plate(*bars: tuple[Bar, int]) -> Image:
    """Ground with bars of a contrast; a darker one is positive."""
    image = np.full(SHAPE, GROUND, dtype=np.uint8)
    for (top, left, rows, columns), level in bars:
        image[top : top + rows, left : left + columns] = GROUND - level
    return image


def cut_out(bar: Bar, noise_level: float = 8.0) -> Silhouette:
    """The silhouette of a bar, cut out with a margin as far as the image goes."""
    level = np.full(SHAPE, GROUND, np.float32) - plate((bar, LEVEL))
    top, left = max(0, bar[0] - 4), max(0, bar[1] - 4)
    window = (slice(top, bar[0] + bar[2] + 4), slice(left, bar[1] + bar[3] + 4))
    origin_px = (float(left), float(top))
    return Silhouette(
        level[window], 0.5 * LEVEL, noise_level, origin_px, 1.0, 0.0, FrameStatus.GOOD
    )


def check(
    image: Image,
    ground: Image,
    polarity: Polarity = Polarity.DARK,
    *,
    body: Bar = BODY,
    ghosts: bool = True,
    noise_level: float = 8.0,
) -> FrameStatus:
    """Check a lying bar."""
    top, left, rows, columns = body
    line = np.column_stack(
        [np.linspace(left, left + columns - 1, 101), np.full(101, top + 0.5 * (rows - 1))]
    )
    skeleton = Skeleton(line, np.full(101, 0.5 * rows), columns - 1.0, FrameStatus.GOOD)
    return check_residual(
        image, ground, polarity, cut_out(body, noise_level), skeleton, ghosts=ghosts
    )


def turned(*images: Image) -> list[tuple[Image, ...]]:
    """The images as they are, and upside down, and from right to left; the body in its place."""
    (top, left, rows, columns), (high, wide) = BODY, SHAPE
    shift = 2 * top + rows - high, 2 * left + columns - wide
    return [
        images,
        tuple(np.roll(image[::-1], shift[0], axis=0) for image in images),
        tuple(np.roll(image[:, ::-1], shift[1], axis=1) for image in images),
    ]


@pytest.mark.parametrize(
    ("bar", "level", "expected"),
    [
        ((50, 140, 10, 40), 100, FrameStatus.PART),  # the tail that the silhouette left out
        ((50, 140, 10, 11), 100, FrameStatus.GOOD),  # nearer than 1.2 widths: a shadow
        ((50, 140, 10, 40), 22, FrameStatus.PART),
        ((50, 140, 10, 40), 18, FrameStatus.GOOD),  # below a fifth of the contrast
        ((50, 155, 10, 20), 100, FrameStatus.PART),  # begins within 1.5 widths of the tip
        ((50, 159, 10, 20), 100, FrameStatus.GOOD),  # apart: another animal
        ((72, 90, 10, 20), 100, FrameStatus.GOOD),  # beside the body, far from both tips
        ((54, 140, 2, 30), 100, FrameStatus.PART),  # 36 px beyond 12 px: more than 2 % of the body
        ((54, 140, 1, 24), 100, FrameStatus.GOOD),  # less
    ],
)
def test_a_residual_that_starts_at_a_tip_and_leads_away_is_a_part(
    bar: Bar, level: int, expected: FrameStatus
) -> None:
    for image, ground in turned(plate((BODY, LEVEL), (bar, level)), plate()):
        assert check(image, ground) is expected
    light = plate((BODY, -LEVEL), (bar, -level))
    assert check(light, plate(), Polarity.LIGHT) is expected


def test_noise_that_alone_reaches_a_level_is_no_part() -> None:
    image = plate((BODY, LEVEL), ((50, 140, 10, 40), 22))
    assert check(image, plate(), noise_level=30.0) is FrameStatus.GOOD


def test_half_a_length_around_the_body_is_looked_at() -> None:
    """The tail at the border of the picture is in it, and a part begins within the margin."""
    near = plate(((0, 0, 10, 80), LEVEL), ((0, 80, 10, 40), LEVEL))
    assert check(near, plate(), body=(0, 0, 10, 80)) is FrameStatus.PART
    end = plate(((110, 120, 10, 80), LEVEL), ((110, 80, 10, 40), LEVEL))
    assert check(end, plate(), body=(110, 120, 10, 80)) is FrameStatus.PART
    assert check(plate(((0, 0, 10, 80), LEVEL)), plate(), body=(0, 0, 10, 80)) is FrameStatus.GOOD


@pytest.mark.parametrize("gap_px", [3, 8, 10])
@pytest.mark.parametrize(
    ("faint", "expected"), [(0, FrameStatus.GOOD), (15, FrameStatus.GOOD), (36, FrameStatus.PART)]
)
def test_a_gap_between_a_tip_and_the_body_is_empty_or_holds_a_part(
    gap_px: int, faint: int, expected: FrameStatus
) -> None:
    """A hook 10 px wide; its tip ends above its own long arm, and blur fills a narrow gap."""
    tip_y = 60 - gap_px
    hook = np.array([[80, tip_y], [80, 20], [120, 20], [120, 65], [20, 65]])
    clear = np.zeros(SHAPE, dtype=np.float32)
    clear[15:60, 75:85] = faint
    for arm in (np.s_[15:tip_y, 75:85], np.s_[15:25, 75:125], np.s_[15:70, 115:125]):
        clear[arm] = LEVEL
    clear[60:70, 20:125] = LEVEL
    level = np.asarray(cv2.GaussianBlur(clear, (0, 0), 1.2), dtype=np.float32)
    silhouette = Silhouette(level, 0.5 * LEVEL, 8.0, (0.0, 0.0), 1.0, 0.0, FrameStatus.GOOD)
    skeleton = in_equal_chords(hook.astype(float), np.full(101, 5.0))
    assert skeleton is not None
    image = np.asarray(np.rint(GROUND - level), dtype=np.uint8)
    found = check_residual(image, plate(), Polarity.DARK, silhouette, skeleton, ghosts=False)
    assert found is (expected if gap_px > 3 else FrameStatus.GOOD)


GHOST = (62, 80, 10, 40)
"""Beside the body, where the film's background shows an animal that the frame does not."""


def test_a_shape_that_only_the_background_shows_is_a_ghost() -> None:
    for image, ground in turned(plate((BODY, LEVEL)), plate((GHOST, LEVEL))):
        assert check(image, ground) is FrameStatus.GHOST
        assert check(image, ground, ghosts=False) is FrameStatus.GOOD
    light = plate((BODY, -LEVEL)), plate((GHOST, -LEVEL))
    assert check(*light, Polarity.LIGHT) is FrameStatus.GHOST
    assert check(*light, Polarity.BOTH) is not FrameStatus.GHOST


@pytest.mark.parametrize(
    ("bar", "level", "expected"),
    [
        (GHOST, 34, FrameStatus.GHOST),
        (GHOST, 26, FrameStatus.GOOD),  # below 0.3 of the contrast
        ((72, 80, 10, 40), LEVEL, FrameStatus.GOOD),  # no edge within a width
        ((62, 90, 4, 8), LEVEL, FrameStatus.GOOD),  # less than a twentieth of the body
        ((62, 90, 10, 6), LEVEL, FrameStatus.GHOST),
    ],
)
def test_a_ghost_is_strong_near_and_large(bar: Bar, level: int, expected: FrameStatus) -> None:
    assert check(plate((BODY, LEVEL)), plate((bar, level))) is expected


def test_bare_ground_that_is_lighter_than_its_background_is_no_ghost() -> None:
    """The background is darker over a wide area: it shows no shape like the body's."""
    assert check(plate((BODY, LEVEL)), plate(((0, 0, *SHAPE), 40))) is FrameStatus.GOOD


def test_an_outline_that_only_the_background_has_is_a_ghost() -> None:
    shown, empty = plate((BODY, LEVEL)), plate()
    assert not is_ghost(shown, empty, cut_out(BODY))
    assert is_ghost(empty, shown, cut_out(BODY))


@pytest.mark.parametrize("levels", [(LEVEL, -LEVEL), (-LEVEL, LEVEL)])
@pytest.mark.parametrize(("rows", "columns"), [(20, 26), (26, 20)])
def test_an_outline_is_a_ghost_if_the_background_has_more_than_half_of_its_edges(
    rows: int, columns: int, levels: tuple[int, int]
) -> None:
    """The frame has the edges above and below, and the background those left and right."""
    body = cut_out((40, 60, rows, columns))
    image = plate(((40, 0, rows, SHAPE[1]), levels[0]))
    ground = plate(((0, 60, SHAPE[0], columns), levels[1]))
    assert is_ghost(image, ground, body) == (rows > columns)
    coloured = [np.stack([plate(), each, plate()], axis=2) for each in (image, ground)]
    assert is_ghost(*coloured, body) == (rows > columns)
