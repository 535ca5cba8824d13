"""Results of a captured film that do not depend on the number of its animals."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from snakewalk.controller.capture.capture import Capture, CaptureFile
from snakewalk.controller.capture.film.film_options import CaptureOptions
from snakewalk.controller.capture.image_file import scaled
from snakewalk.controller.capture.opened_film import OpenedFilm
from snakewalk.controller.capture.plots.capture import contact_sheet, overlay_film
from snakewalk.controller.capture.review import review_page
from snakewalk.controller.console.progress import ProgressBar
from snakewalk.controller.console.result_files import write_result


def in_whole_film(options: CaptureOptions, film: OpenedFilm, captured: Capture) -> Capture:
    """Return a capture with points in the whole images, and the times that the film states."""
    time_s, rate_hz = film.times(options.rate_hz, captured.time_s)
    corner = film.region.origin_px
    points_px = captured.points_px
    if corner != (0, 0):
        points_px = scaled(points_px, (1.0, 1.0), corner, options.output.parent)
    return replace(captured, points_px=points_px, time_s=time_s, rate_hz=rate_hz)


def write_looks(
    options: CaptureOptions,
    film: OpenedFilm,
    animals: Sequence[CaptureFile],
    tracks: Sequence[Path],
    bar: ProgressBar,
    scale: float,
) -> None:
    """Write the contact sheet, the overlay film and the review page if the options name them.

    Args:
        options: of the command.
        film: is read once for each.
        animals: those with a track.
        tracks: their files, which the page names.
        bar: shows the progress.
        scale: of the page's pictures: ``picture_scale``.

    """
    footage = film.footage
    region = film.region
    if options.sheet is not None:
        contact_sheet(options.sheet, footage.read(), [animal.captured for animal in animals])
    if options.overlay is not None:
        bar.update(0, footage.count, description="overlay film")
        captures = [animal.captured for animal in animals]
        overlay_film(options.overlay, footage.read(), captures, bar.advance)
    if options.review is not None:
        bar.update(0, footage.count, description="review page")
        text = review_page(
            animals,
            map(region.cut, footage.read()),
            scale=scale,
            tracks=tracks,
            origin_px=region.origin_px,
            on_progress=bar.advance,
        )
        write_result(options.review, text)
