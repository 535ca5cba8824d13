"""Array types by name, for all packages."""

import numpy as np
from numpy.typing import NDArray

AnyInts = NDArray[np.integer]
Bools = NDArray[np.bool_]
Bytes = NDArray[np.uint8]
Complexes = NDArray[np.complex128]
DeepImage = NDArray[np.uint8 | np.float32]
"""An ``Image``, or a picture of more than 8 bit as float32 on about the same scale."""
Floats = NDArray[np.float64]
Image = NDArray[np.uint8]
Indices = NDArray[np.intp]
Int32s = NDArray[np.int32]
Ints = NDArray[np.int64]
SignedInts = NDArray[np.signedinteger]
Singles = NDArray[np.float32]
