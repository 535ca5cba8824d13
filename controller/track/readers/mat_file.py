"""Arrays of a MATLAB file up to version 7, whose packed parts may ask for any memory."""

from typing import Any

import numpy as np
import scipy


def child(file: str) -> tuple[dict[str, Any], dict[str, Any]]:
    """Arrays of numbers and texts; the separate process's work."""
    arrays = {name: np.asarray(value) for name, value in scipy.io.loadmat(file).items()}
    return {
        name: value
        for name, value in arrays.items()
        if not (name.startswith("__") or value.dtype.hasobject)
    }, {}
