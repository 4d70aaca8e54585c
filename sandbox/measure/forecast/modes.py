"""Modes: the least and the largest eigenvalue of what joints or springs make of the bodies they hold."""

from collections.abc import Callable

import numpy as np

from sandbox.arrays import FloatArray, IntArray

DENSE = 400
"""Rows up to which a matrix is written out and solved at once."""
STEPS = 160
"""Of the Lanczos iteration, for larger ones: both ends of the spectrum come first."""

Product = Callable[[FloatArray], FloatArray]


def extremes(product: Product, size: int, null: FloatArray | None = None) -> tuple[float, float]:
    """Return the least and the largest eigenvalue of a symmetric matrix that is known by its product with a vector.

    Exact to rounding up to `DENSE` rows. Above, by C. Lanczos 1950 with full orthogonalisation: the least is then
    too large and the largest too small, if by anything.

    Args:
        product: of the matrix with a vector (size,).
        size: how many rows.
        null: (size,) of length 1, an eigenvector of 0 that does not count.
    """
    if size <= DENSE:
        matrix = np.column_stack([product(column) for column in np.eye(size)])
        values = np.linalg.eigvalsh(0.5 * (matrix + matrix.T))
        return float(values[0 if null is None else min(1, size - 1)]), float(values[-1])
    vector = np.random.default_rng(1).normal(size=size)  # any start will do, but always the same
    basis = np.empty((STEPS + 1, size))
    begin = known = 0
    if null is not None:
        basis[0] = null
        begin = known = 1
    diagonal: list[float] = []
    beside: list[float] = []
    while known < len(basis):
        for _ in range(2):  # once is not enough for rounding
            vector = vector - basis[:known].T @ (basis[:known] @ vector)
        length = float(np.linalg.norm(vector))
        if length < 1e-12:  # there are no more
            break
        if known > begin:
            beside.append(length)
        basis[known] = vector / length
        vector = product(basis[known])
        diagonal.append(float(vector @ basis[known]))
        known += 1
    values = np.linalg.eigvalsh(np.diag(diagonal) + np.diag(beside, 1) + np.diag(beside, -1))
    return float(values[0]), float(values[-1])


def groups(first: IntArray, second: IntArray, count: int) -> IntArray:
    """Number connected bodies alike, (count,): by the lowest of each group.

    Args:
        first: (J,) number of one end of each joint, negative for none.
        second: (J,) number of the other.
        count: of bodies.
    """
    label = np.arange(count)
    both = (first >= 0) & (second >= 0)
    a, b = first[both], second[both]
    while len(a):
        lower = np.minimum(label[a], label[b])
        before = label.copy()
        np.minimum.at(label, a, lower)
        np.minimum.at(label, b, lower)
        label = label[label]  # pointers to pointers: long chains take a logarithm of their length
        if np.array_equal(label, before):
            break
    return label
