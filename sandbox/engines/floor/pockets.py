"""Pockets: who stands in one."""

import numpy as np

from sandbox.scene.model import Scene
from sandbox.trajectory import FloatArray, IntArray


def caught(scene: Scene, position: FloatArray) -> IntArray:
    """Return the number of the pocket that each of N centres (N, 2), m, lies in, (N,); −1 for none.

    Where pockets overlap it is the first of them.
    """
    found = np.full(len(position), -1, dtype=np.int64)
    for k, pocket in enumerate(scene.pockets):
        apart = position - np.asarray(pocket.position)
        found[(found < 0) & (np.einsum("nk,nk->n", apart, apart) < pocket.radius**2)] = k
    return found
