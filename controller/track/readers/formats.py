"""File formats of recordings, recognised by their first bytes."""

from typing import Literal

from snakewalk.controller.track.readers.bvh import is_bvh
from snakewalk.controller.track.readers.marker_tables import is_trc
from snakewalk.controller.track.readers.markers import is_qtm

KNOWN = (
    "a CSV of midlines (t, frame, point, x_m, y_m), a SLEAP CSV (frame_idx, <keypoint>.x, "
    "<keypoint>.y), analysis HDF5 or project (.slp), a DeepLabCut CSV or HDF5, "
    "HDF5 of Tierpsy (featuresN, skeletons). Also: a WCON "
    "(JSON), an .npz or MATLAB .mat (points or angles_rad or x and y, with rate_hz; or skeletons), "
    "an .npy of joint angles (frames, joints). Or markers: QTM's TSV, Vicon's or "
    "Motive's CSV, a TRC or a C3D. Or a BVH skeleton"
)
"""Supported files of a recording, for faults and help."""

Format = Literal[
    "zip", "npy", "hdf5", "mat", "json", "csv", "qtm", "c3d", "trc", "bvh", "empty", "binary"
]
"""``zip`` is an .npz or a zipped WCON; ``binary`` and ``empty`` cannot be recordings."""

_MARKS: tuple[tuple[bytes, Format], ...] = (
    (b"PK\x03\x04", "zip"),
    (b"\x93NUMPY", "npy"),
    (b"\x89HDF\r\n\x1a\n", "hdf5"),
    (b"MATLAB 7.3 MAT-file", "hdf5"),
    (b"MATLAB 5.0 MAT-file", "mat"),
)
HEAD_BYTES = 128
"""First bytes of a file that ``format_of`` needs."""


def format_of(head: bytes) -> Format:
    """Recognise a file by its first ``HEAD_BYTES``."""
    for mark, kind in _MARKS:
        if head.startswith(mark):
            return kind
    if not head:
        return "empty"
    if head[1:2] == b"\x50" and b"\x00" in head:
        return "c3d"
    if b"\x00" in head:
        return "binary"
    if is_qtm(head):
        return "qtm"
    if is_bvh(head):
        return "bvh"
    if is_trc(head):
        return "trc"
    return "json" if head.removeprefix(b"\xef\xbb\xbf").lstrip().startswith(b"{") else "csv"
