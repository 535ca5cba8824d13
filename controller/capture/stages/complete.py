"""Stage that completes bodies: steady tails, the second fit of small bodies, errors of the tips."""

from dataclasses import replace

import numpy as np

from snakewalk.controller.capture.identity import margins
from snakewalk.controller.capture.small_body.film_fit import (
    fit_film,
    with_tip_errors,
)
from snakewalk.controller.capture.staged_film import StagedFilm, with_statuses
from snakewalk.controller.capture.verification.steady_tails import with_steady_tails


class Complete:
    """Lines from tip to tip, with the errors that their fits leave."""

    def run(self, film: StagedFilm) -> StagedFilm:
        """Return the film with complete lines; the head is known."""
        detections = film.detections
        steady, tips_px = with_steady_tails(film.skeletons, detections.tips)
        expected = film.expected_px.copy()
        for k, tip_px in tips_px.items():
            # blur moves the head only; the points between share the errors of both ends
            expected[k] = 0.5 * np.hypot(expected[k], tip_px)
        crops = detections.crops.without(set(np.flatnonzero(film.solved).tolist()))
        fitted = fit_film(steady, crops, margins(film.skeletons), expected, fixed=film.fixed)
        fitted = with_tip_errors(fitted, detections.ends_px, film.solved)
        expected = fitted.expected_px
        for k, least in detections.least_error_px.items():
            expected[k] = np.maximum(expected[k], least)
        skeletons = with_statuses(fitted.skeletons, expected)
        return replace(film, skeletons=skeletons, expected_px=expected)
