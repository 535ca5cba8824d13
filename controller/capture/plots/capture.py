"""Pictures of a capture: a contact sheet, a film with the skeleton on it, single steps."""

from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from pathlib import Path
from textwrap import wrap
from typing import Any

import cv2
import numpy as np

from snakewalk.config.arrays import DeepImage, Floats, Image, Int32s
from snakewalk.config.colours import HEAD, rgb
from snakewalk.config.errors import InputError
from snakewalk.controller.capture.capture import Capture
from snakewalk.controller.capture.staged_film import evenly_chosen
from snakewalk.controller.console.result_files import atomic_write
from snakewalk.controller.images.body_detector import BodyDetector
from snakewalk.controller.images.silhouette import Polarity
from snakewalk.controller.images.video import in_8_bits
from snakewalk.controller.track.frame_status import FrameStatus

_BODY = (60, 200, 255)
_HEAD = rgb(HEAD)[::-1]
_TEXT = (255, 255, 255)
_BAD_COLOUR = (80, 80, 255)
_BACKGROUND_GREY = 32
_TILE_PX = 200
_LINE_PX = 14
_TEXT_PX = 3 * _LINE_PX + 4
"""Height of the text below a tile."""
_LETTERS = 32  # of the text on a tile
_STEP_PX = 300
_FILM_PX = 480
"""Smaller frames are enlarged to this, so that the line does not hide the animal."""


def drawn(
    image: DeepImage, points_px: Floats, status: FrameStatus, wide_px: int, high_px: int
) -> Image:
    """(high, wide, 3) the frame enlarged or shrunk to fit, the skeleton, its head, its status."""
    canvas = np.full((high_px, wide_px, 3), _BACKGROUND_GREY, dtype=np.uint8)
    factor = min(wide_px / image.shape[1], (high_px - 18) / image.shape[0])
    size = (max(1, round(image.shape[1] * factor)), max(1, round(image.shape[0] * factor)))
    how = cv2.INTER_AREA if factor < 1.0 else cv2.INTER_NEAREST
    plain = in_8_bits(image)
    colour = plain if plain.ndim == 3 else cv2.cvtColor(plain, cv2.COLOR_GRAY2BGR)
    canvas[: size[1], : size[0]] = cv2.resize(colour, size, interpolation=how)
    if status.has_points:
        draw_body(canvas, image, points_px)
    return canvas


def draw_body(canvas: Image, image: DeepImage, points_px: Floats) -> Int32s:
    """Draw a body of a frame onto its canvas; returns its line there, sixteenths of a pixel."""
    high_px, wide_px = canvas.shape[:2]
    factor = min(wide_px / image.shape[1], (high_px - 18) / image.shape[0])
    line = np.rint(((points_px + 0.5) * factor - 0.5) * 16.0).astype(np.int32)
    thick = 2 if max(canvas.shape) > 2 * _TILE_PX else 1
    _draw_line(canvas, line, thick, 4)
    return np.asarray(line, dtype=np.int32)


def _draw_line(canvas: Any, line: Int32s, thick: int, head_px: int) -> None:
    """Draw a line in sixteenths of a pixel, and its head."""
    cv2.polylines(canvas, [line], False, _BODY, thick, cv2.LINE_AA, 4)
    cv2.circle(canvas, tuple(int(v) for v in line[0]), head_px * 16, _HEAD, -1, cv2.LINE_AA, 4)


def _put(canvas: Image, text: str, place: tuple[int, int], tint: tuple[int, int, int]) -> None:
    cv2.putText(canvas, text, place, cv2.FONT_HERSHEY_SIMPLEX, 0.36, tint, 1, cv2.LINE_AA)


def _write_line(canvas: Image, text: str, good: bool, line: int = 0) -> None:
    """Write a line of text; ``line`` counts from the lower edge."""
    low = canvas.shape[0] - _LINE_PX * line
    canvas[low - _LINE_PX - 4 : low] = np.minimum(
        canvas[low - _LINE_PX - 4 : low], _BACKGROUND_GREY
    )
    _put(canvas, text, (4, low - 5), _TEXT if good else _BAD_COLOUR)


def contact_sheet(
    path: Path,
    frames: Iterable[DeepImage],
    animals: Sequence[Capture],
    columns: int = 6,
    rows: int = 4,
) -> None:
    """Frames spread over the recording, every third place kept for frames that were not used.

    A bar on each tile is the scale, in pixels of the film. Each of several animals has half as
    many rows, with its number on every tile.
    """
    if len(animals) > 1:
        rows = max(1, rows // 2)
    chosen = [set(_chosen(captured, columns * rows)) for captured in animals]
    tiles: list[list[Image]] = [[] for _ in animals]
    high_px = text_px = 0
    for number, image in enumerate(frames):
        for k, captured in enumerate(animals):
            if number not in chosen[k]:
                continue
            status = captured.status[number]
            tile, tile_px = _tile(image, captured.points_px[number], status)
            high_px = max(high_px, tile_px)
            reason = "" if status is FrameStatus.GOOD else f": {status}"
            name = f"animal {k + 1}, " if len(animals) > 1 else ""
            lines = wrap(f"{name}{number}{reason}", _LETTERS)[::-1]
            text_px = max(text_px, _LINE_PX * len(lines) + 4)
            for line, text in enumerate(lines):
                _write_line(tile, text, status is FrameStatus.GOOD, line)
            tiles[k].append(tile)
    wide = min(columns, max(len(row) for row in tiles))
    placed = [
        tile
        for row in tiles
        for tile in [*row, *[np.full_like(row[0], _BACKGROUND_GREY)] * (-len(row) % wide)]
    ]
    placed = [np.delete(tile, slice(high_px, -text_px), axis=0) for tile in placed]
    sheet = np.vstack([np.hstack(placed[k : k + wide]) for k in range(0, len(placed), wide)])
    _write(path, sheet)


def trail_picture(
    path: Path, frames: Iterable[DeepImage], captured: Capture, polarity: Polarity
) -> None:
    """Draw all places of the animal as one picture ([PT] Fig. 4: maximum intensity over time).

    Each pixel has its brightest value over the used frames, or its darkest for a dark animal. For
    an animal with dark and light parts it is the extreme that is farther from the mean.
    Skeletons of twelve frames are drawn on it.
    """
    high = None
    low = None
    total = np.zeros(())
    for image, used in zip(frames, captured.used, strict=False):
        if used:
            plain = in_8_bits(image)
            high = plain.copy() if high is None else np.maximum(high, plain)
            low = plain.copy() if low is None else np.minimum(low, plain)
            total = total + plain
    if high is None or low is None:
        raise InputError(f"{path}: no frame of the film is used; nothing to draw")
    picture = low if polarity is Polarity.DARK else high
    if polarity is Polarity.BOTH:
        mean = total / captured.used.sum()
        picture = np.where(high - mean >= mean - low, high, low)
    canvas = picture if picture.ndim == 3 else cv2.cvtColor(picture, cv2.COLOR_GRAY2BGR)
    for number in np.unique(np.linspace(0, captured.used.sum() - 1, 12).astype(int)):
        points = captured.points_px[np.flatnonzero(captured.used)[number]]
        line = np.rint(points * 16.0).astype(np.int32)
        _draw_line(canvas, line, 1, 3)
    _write(path, np.asarray(canvas, dtype=np.uint8))


def _tile(image: DeepImage, points_px: Floats, status: FrameStatus) -> tuple[Image, int]:
    """The animal and a little around it; all of a frame in which it was not found.

    Returns the tile with a bar as scale, and the height of the image on it.
    """
    if status.has_points:
        rows, columns, points_px = _window_of_animal(points_px, is_square=True)
        image = image[rows, columns]
    picture = drawn(image, points_px, status, _TILE_PX, _TILE_PX)
    tile = np.pad(
        picture, ((0, _TEXT_PX - 18), (0, 0), (0, 0)), constant_values=_BACKGROUND_GREY
    )  # its text hides no part of the picture
    factor = min(_TILE_PX / image.shape[1], (_TILE_PX - 18) / image.shape[0])
    most = 0.4 * _TILE_PX / factor
    length = max((k for k in (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000) if k <= most), default=1)
    high = round(image.shape[0] * factor)
    cv2.line(tile, (4, high - 5), (4 + round(length * factor), high - 5), _TEXT, 2)
    _put(tile, f"{length} px", (4, high - 10), _TEXT)
    return tile, high


def _window_of_animal(points_px: Floats, *, is_square: bool = False) -> tuple[slice, slice, Floats]:
    """Rows and columns of the animal and a little around it; its points (n, 2) within them."""
    reach = 0.12 * float(np.hypot(*np.diff(points_px, axis=0).T).sum()) + 6.0
    low, high = points_px.min(axis=0) - reach, points_px.max(axis=0) + reach
    if is_square:
        low, high = (0.5 * (low + high + side * (high - low).max()) for side in (-1.0, 1.0))
    left, top = np.maximum(low, 0.0).astype(int)
    right, bottom = np.ceil(high).astype(int)
    return slice(top, bottom), slice(left, right), points_px - [left, top]


def _write(path: Path, image: Image) -> None:
    with atomic_write(path) as part, suppress(cv2.error):  # an ending that it does not know
        if cv2.imwrite(str(part), image):
            return
    raise InputError(f"{path}: a picture is a .png or .jpg")


def step_picture(path: Path, image: DeepImage, detector: BodyDetector, points_px: Floats) -> None:
    """The animal of one frame through all steps: image, silhouette, axis, equal chords, head.

    Raises:
        InputError: not a picture's ending.

    """
    body = detector.detect(image).silhouette
    mask = np.zeros(image.shape[:2], dtype=np.uint8)
    mask[body.window()] = body.mask * np.uint8(200)
    rows, columns, points_px = _window_of_animal(points_px)
    image = image[rows, columns]
    mask = mask[rows, columns]
    high, wide = image.shape[:2]
    factor = _STEP_PX / max(high, wide)
    tile_px = max(round(wide * factor), 120), round(high * factor) + 18
    no_points = np.empty((0, 2))
    bare = drawn(image, no_points, FrameStatus.NOTHING, *tile_px)
    shape = drawn(mask, no_points, FrameStatus.NOTHING, *tile_px)
    line = np.rint(((points_px + 0.5) * factor - 0.5) * 16.0).astype(np.int32)
    axis = shape.copy()
    chords = shape.copy()
    cv2.polylines(axis, [line], False, _BODY, 2, cv2.LINE_AA, 4)
    for number, (u, v) in enumerate(line.tolist()):
        size = 4 if number % 10 == 0 else 2
        cv2.circle(chords, (u, v), size * 16, _BAD_COLOUR, -1, cv2.LINE_AA, 4)
    skeleton_picture = drawn(image, points_px, FrameStatus.GOOD, *tile_px)
    named = {
        "image": bare,
        "silhouette": shape,
        "medial axis": axis,
        "100 equal chords": chords,
        "skeleton, head": skeleton_picture,
    }
    for name, tile in named.items():
        _write_line(tile, name, good=True)
    gap = np.full((tile_px[1], 8, 3), _BACKGROUND_GREY, dtype=np.uint8)
    sheet = np.hstack([part for tile in named.values() for part in (tile, gap)][:-1])
    _write(path, sheet)


def _chosen(captured: Capture, places: int) -> list[int]:
    good = captured.good
    bad = np.flatnonzero(~good).tolist()
    bad = evenly_chosen(bad, max(places // 3, places - int(good.sum())))
    return bad + evenly_chosen(np.flatnonzero(good).tolist(), places - len(bad))


def overlay_film(
    path: Path,
    frames: Iterable[DeepImage],
    animals: Sequence[Capture],
    on_progress: Callable[[], None],
) -> None:
    """The recording with the skeletons on it, every frame with its number and status.

    Several animals have numbers at their heads instead of a status.

    Raises:
        InputError: no film of this ending can be written here.

    """
    kind = "MJPG" if path.suffix.lower() == ".avi" else "mp4v"
    with atomic_write(path) as part:
        film: cv2.VideoWriter | None = None
        wide = high = 0
        for number, image in enumerate(frames):
            if film is None:
                factor = max(1, -(-_FILM_PX // max(image.shape)))
                wide, high = ((side * factor + 1) // 2 * 2 for side in image.shape[1::-1])
                high += 18
                code = cv2.VideoWriter.fourcc(*kind)
                film = cv2.VideoWriter(str(part), code, animals[0].rate_hz, (wide, high))
                if not film.isOpened():
                    raise InputError(f"{path}: this OpenCV cannot write such a film; try .avi")
            film.write(_film_frame(image, animals, number, (wide, high)))
            on_progress()
        if film is not None:
            film.release()


def _film_frame(
    image: DeepImage, animals: Sequence[Capture], number: int, size: tuple[int, int]
) -> Image:
    """One frame of an overlay film of (width, height)."""
    if len(animals) == 1:
        status = animals[0].status[number]
        canvas = drawn(image, animals[0].points_px[number], status, *size)
        _write_line(canvas, f"{number}: {status}", status is FrameStatus.GOOD)
        return canvas
    canvas = drawn(image, np.zeros((0, 2)), FrameStatus.NOTHING, *size)
    used = 0
    for name, animal in enumerate(animals, start=1):
        if animal.status[number].has_points:
            used += 1
            line = draw_body(canvas, image, animal.points_px[number])
            place = (int(line[0, 0]) // 16 + 6, int(line[0, 1]) // 16 - 6)
            _put(canvas, str(name), place, _TEXT)
    _write_line(canvas, f"{number}: {used} of {len(animals)} animals", used == len(animals))
    return canvas
