"""The file formats of recordings, recognised by their first bytes."""

from typing import Literal

KNOWN = (
    "a CSV of midlines (t, frame, point, x_m, y_m), a SLEAP CSV (frame_idx, <keypoint>.x, "
    "<keypoint>.y) or analysis HDF5, a DeepLabCut CSV or HDF5, a WCON (JSON), an .npz or MATLAB "
    ".mat (points or angles_rad or x and y, with rate_hz; or skeletons) or an .npy of joint angles "
    "(frames, joints)"
)
"""What a file of a recording may be, for faults and help."""

Format = Literal["zip", "npy", "hdf5", "mat", "json", "csv", "empty", "binary"]
"""``zip`` is an .npz or a zipped WCON; ``binary`` and ``empty`` are no recordings."""

HEAD_BYTES = 128
"""First bytes of a file that ``format_of`` needs."""


def format_of(head: bytes) -> Format:
    """Recognise a file by its first bytes."""
    if head.startswith(b"PK\x03\x04"):
        return "zip"
    if head.startswith(b"\x93NUMPY"):
        return "npy"
    if head.startswith((b"\x89HDF\r\n\x1a\n", b"MATLAB 7.3 MAT-file")):
        return "hdf5"
    if head.startswith(b"MATLAB 5.0 MAT-file"):
        return "mat"
    if not head:
        return "empty"
    if b"\x00" in head:
        return "binary"
    return "json" if head.removeprefix(b"\xef\xbb\xbf").lstrip().startswith(b"{") else "csv"
