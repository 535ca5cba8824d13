"""Small least squares with the same bits on every processor.

numpy uses BLAS, whose kernels and order of sums depend on the processor; runs would then diverge.
These loops have one order. They are next to ``compiling`` because simulation and controller need
them.
"""

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.drivers.compiling import compiled, readonly_array


@compiled("void(float64[:, ::1], float64[::1], float64[::1])")
def solve_positive_definite(a: Floats, b: Floats, x: Floats) -> None:
    """Solve ``a`` x = b by Cholesky into ``x`` (N,); reads the lower half of ``a``.

    ``a`` (N, N) must be positive definite; it is overwritten.
    """
    n = len(b)
    for i in range(n):
        for j in range(i + 1):
            for k in range(j):
                a[i, j] -= a[i, k] * a[j, k]
            a[i, j] = np.sqrt(a[i, i]) if i == j else a[i, j] / a[j, j]
    for i in range(n):
        x[i] = b[i]
        for k in range(i):
            x[i] -= a[i, k] * x[k]
        x[i] /= a[i, i]
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            x[i] -= a[k, i] * x[k]
        x[i] /= a[i, i]


_MATRIX = readonly_array(dimensions=2, layout="C")
_VECTOR = readonly_array(layout="C")


@compiled(f"float64[::1]({_MATRIX}, {_VECTOR}, {_VECTOR})")
def _least_squares(rows: Floats, target: Floats, damping: Floats) -> Floats:
    count = rows.shape[1]
    normal = np.zeros((count, count))
    right = np.zeros(count)
    x = np.empty(count)
    for i in range(count):
        normal[i, i] = damping[i] * damping[i]
    for k in range(len(rows)):
        for i in range(count):
            right[i] += rows[k, i] * target[k]
            for j in range(i + 1):
                normal[i, j] += rows[k, i] * rows[k, j]
    solve_positive_definite(normal, right, x)
    return x


def least_squares(rows: Floats, target: Floats, damping: Floats) -> Floats:
    """The x (N,) that minimises ``|rows x - target|^2 + |damping x|^2``.

    It uses the normal equations, so the condition must be far below 1e8, and rows and damping must
    determine x. Shapes: ``rows`` (M, N), ``target`` (M,), ``damping`` (N,), one weight per unknown.
    """
    return _least_squares(
        np.ascontiguousarray(rows), np.ascontiguousarray(target), np.ascontiguousarray(damping)
    )
