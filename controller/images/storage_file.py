"""Values in a file of OpenCV's FileStorage, which allocates any stated size."""

from typing import Any

import cv2

_MOST_NUMBERS = 10_000
"""Numbers of a matrix of a calibration (ours)."""


def child(file: str) -> tuple[dict[str, Any], dict[str, Any]]:
    """Matrices by name, and numbers or None by name; the separate process's work."""
    store = cv2.FileStorage(file, cv2.FILE_STORAGE_READ)
    matrices = {}
    others = {}
    for name in store.root().keys():  # noqa: SIM118  no dict
        node = store.getNode(name)
        if node.isMap():
            matrices[name] = node.mat()
        else:
            others[name] = node.real() if node.isReal() or node.isInt() else None
    if any(matrix is not None and matrix.size > _MOST_NUMBERS for matrix in matrices.values()):
        raise ValueError(f"a matrix has more than {_MOST_NUMBERS} numbers")
    return {name: matrix for name, matrix in matrices.items() if matrix is not None}, others
