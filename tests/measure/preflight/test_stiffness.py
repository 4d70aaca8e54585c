"""Eigenmodes: ends of spectra against formulas, and connected groups of bodies."""

import numpy as np
import pytest

from sandbox.measure.preflight.stiffness import MAX_DENSE, connected_groups, extreme_eigenvalues


def path(vector: np.ndarray) -> np.ndarray:
    """Return the product with the Laplacian of a path; its eigenvalues are 2 − 2·cos(kπ/n), k = 0 … n − 1."""
    padded = np.concatenate((vector[:1], vector, vector[-1:]))
    return 2.0 * vector - padded[:-2] - padded[2:]


@pytest.mark.parametrize("size", [2, 30, MAX_DENSE])
def test_ends_of_a_small_spectrum_are_exact(size: int) -> None:
    least, largest = extreme_eigenvalues(path, size)
    assert least == pytest.approx(0.0, abs=1e-13)  # rounding of numbers near 4
    assert largest == pytest.approx(2.0 - 2.0 * np.cos(np.pi * (size - 1) / size), rel=1e-13)  # likewise
    flat = np.full(size, size**-0.5)
    assert extreme_eigenvalues(path, size, flat)[0] == pytest.approx(
        2.0 - 2.0 * np.cos(np.pi / size), abs=1e-13
    )  # likewise


def test_ends_of_a_large_spectrum_are_approached_from_within() -> None:
    size = 3 * MAX_DENSE
    least, largest = extreme_eigenvalues(path, size, np.full(size, size**-0.5))
    expected = 2.0 - 2.0 * np.cos(np.pi / size), 2.0 - 2.0 * np.cos(np.pi * (size - 1) / size)
    assert expected[0] * (1 - 1e-9) <= least < 2e-3  # one of the 20 lowest of 1200: a path is the hardest case
    assert expected[1] * (1 - 1e-3) <= largest <= expected[1] * (1 + 1e-12)  # as above, and rounding


def test_iteration_ends_when_the_subspace_is_exhausted() -> None:
    size = MAX_DENSE + 1
    values = np.where(np.arange(size) % 2 == 0, 1.0, 3.0)
    assert extreme_eigenvalues(lambda v: values * v, size) == pytest.approx((1.0, 3.0), rel=1e-13)  # rounding


def test_connected_bodies_have_the_same_group() -> None:
    first, second = np.array([4, 3, -1, 7]), np.array([3, 1, 2, 8])
    assert connected_groups(first, second, 9).tolist() == [0, 1, 2, 1, 1, 5, 6, 7, 7]
    chain = np.random.default_rng(2).permutation(500)
    assert set(connected_groups(chain[:-1], chain[1:], 500).tolist()) == {0}
