"""Types of numpy arrays, one definition for the package. Shapes are given where they are used, as in (N, 2)."""

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]
ComplexArray = npt.NDArray[np.complex128]
"""2-vectors as complex numbers"""
