"""Numbers behind the warnings: ends of a spectrum of springs, and iterations that chains and stacks need."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.measure.preflight import run_preflight
from sandbox.measure.preflight.diagnostic import required_iterations
from sandbox.measure.preflight.stiffness import MAX_DENSE, connected_groups, extreme_eigenvalues
from sandbox.scene.description.world import Settings
from sandbox.scene.files.load import loads


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
    # likewise
    assert extreme_eigenvalues(path, size, flat)[0] == pytest.approx(2.0 - 2.0 * np.cos(np.pi / size), abs=1e-13)


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


CHAIN = """
[world]
gravity = [0, -9.81]
[solver]
dt = 0.02
iterations = 5
[[rope]]
start = [0, 0]
end = [12, 0]
links = 24
fix = ["start"]
"""


@given(st.floats(1.0, 1e6), st.floats(1e-4, 0.1), st.integers(1, 20), st.integers(1, 100))
def test_each_of_both_reaches_the_required_rate(needed: float, dt: float, substeps: int, iterations: int) -> None:
    settings = Settings(dt=dt, substeps=substeps, iterations=iterations)
    more, shorter = required_iterations(needed, settings)
    assert more / settings.h >= needed * (1.0 - 1e-6)  # a margin for rounding
    assert iterations / (shorter / substeps) == pytest.approx(needed)


def test_advised_dt_of_a_chain_is_enough_and_not_much_too_short() -> None:
    scene = loads(CHAIN)
    (found,) = [each for each in run_preflight(scene, cover=0).warnings if each.kind == "chain"]
    dt = float(found.details["safe_dt"])

    def kinds(factor: float) -> set[str]:
        varied = loads(CHAIN.replace("dt = 0.02", f"dt = {factor * dt}"))
        return {each.kind for each in run_preflight(varied, cover=0).warnings}

    assert "chain" not in kinds(0.999)
    assert "chain" in kinds(1.2)
