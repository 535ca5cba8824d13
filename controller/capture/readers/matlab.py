"""MATLAB files up to version 7: the same variables as in an .npz. Version 7.3 is HDF5."""

from pathlib import Path

import numpy as np
from scipy.io import loadmat

from snakewalk.config.errors import InputError
from snakewalk.controller.capture.readers.arrays import track_from_arrays
from snakewalk.controller.capture.readers.kinds import KNOWN
from snakewalk.controller.capture.track import Track


def load_mat(file: Path, rate_hz: float | None, least_score: float | None) -> Track:
    """Load ``points``, ``angles_rad``, ``skeletons`` or ``x`` and ``y``: ``formats.load_file``."""
    try:
        held = loadmat(file)
    except Exception as error:
        reason = (str(error).splitlines() or [type(error).__name__])[0]
        raise InputError(
            f"{file}: is no MAT file that can be read: {reason}; known: {KNOWN}"
        ) from None
    arrays = {name: np.asarray(data) for name, data in held.items() if not name.startswith("__")}
    return track_from_arrays(file, arrays, rate_hz, least_score)
