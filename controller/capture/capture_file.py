"""A capture as a file: a track that everything else loads, with what each frame was found to be."""

from pathlib import Path

import numpy as np

from snakewalk.controller.capture.capture import Capture


def save_capture(
    path: Path,
    captured: Capture,
    *,
    name: str,
    m_per_px: float | None = None,
    source: str = "not stated",
    licence: str = "not stated",
) -> None:
    """Write an .npz that ``load_track`` reads, and more.

    ``points`` (T, 101, 2) head first, m (pixels where there is no scale), y upwards; ``rate_hz``,
    ``length_m`` (NaN: no scale), ``name``, ``source``, ``licence`` are the track. Of every frame,
    used or not: ``verdict`` (T,) in words, ``points_px`` (T, 101, 2) as in the image,
    ``radius_px`` (T, 101), ``length_px`` (T,), ``head_margin`` (T,), ``expected_px`` (T,), the
    error of a point, ``company`` (T,), the size of the next largest thing. Once: ``m_per_px``
    (NaN: no scale), ``head_by``, ``head_sure``.
    """
    scale = 1.0 if m_per_px is None else m_per_px
    length_m = np.nan if m_per_px is None else float(np.nanmedian(captured.length_px)) * scale
    with path.open("wb") as stream:
        np.savez_compressed(
            stream,
            points=captured.points_px * [scale, -scale],
            rate_hz=captured.rate_hz,
            length_m=length_m,
            name=name,
            source=source,
            licence=licence,
            verdict=np.array([str(one) for one in captured.verdict]),
            points_px=captured.points_px,
            radius_px=captured.radius_px,
            length_px=captured.length_px,
            head_margin=captured.margin,
            expected_px=captured.expected_px,
            company=captured.company,
            m_per_px=np.nan if m_per_px is None else m_per_px,
            head_by=captured.head_by,
            head_sure=captured.head_sure,
        )
