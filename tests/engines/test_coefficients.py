"""Every pair of materials uses exactly its own coefficients of restitution and friction."""

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.engines.common.pair_factors import TOLERANCE, factors, wrong_pairs
from sandbox.engines.registry import start
from sandbox.scene.files.load import from_document
from tests.engines.stepping import advance


@given(st.floats(0, 1), st.floats(0, 1))
def test_balls_rebound_with_the_restitution_of_their_pair(e, between):
    document = {
        "solver": {"dt": 0.01},
        "material": [{"name": "x", "restitution": 0.3}, {"name": "y"}],
        "pair": [{"between": ["x", "x"], "restitution": e}, {"between": ["y", "x"], "restitution": between}],
        "ball": [
            {"position": [-1, 0], "velocity": [10, 0], "radius": 0.5, "material": "x"},
            {"position": [1, 0], "velocity": [-10, 0], "radius": 0.5, "material": "x"},
            {"position": [-1, 9], "velocity": [10, 0], "radius": 0.5, "material": "x"},
            {"position": [1, 9], "velocity": [-10, 0], "radius": 0.5, "material": "y"},
        ],
    }
    simulation = start(from_document(document))
    advance(simulation, 20)
    v = simulation.frame().velocity[:, 0]
    # A single contact converges in one iteration; sums of speeds of 10 round at 1e-15.
    assert (v[1] - v[0]) / 20 == pytest.approx(e, abs=1e-14)
    assert (v[3] - v[2]) / 20 == pytest.approx(between, abs=1e-14)


@given(
    st.integers(1, 5).flatmap(
        lambda n: st.tuples(
            st.lists(st.floats(0, 1), min_size=n * n, max_size=n * n),
            st.lists(st.booleans(), min_size=n * n, max_size=n * n),
            st.just(n),
        )
    )
)
def test_factors_are_exact_except_for_the_listed_pairs(case):
    values, collides, n = case
    expected, colliding = np.array(values).reshape(n, n), np.array(collides).reshape(n, n)
    expected, colliding = np.maximum(expected, expected.T), colliding | colliding.T
    found = factors(expected, colliding, [None] * n)
    wrong = set(wrong_pairs(expected, colliding, found))
    for a, b in itertools.combinations_with_replacement(range(n), 2):
        if colliding[a, b] and (a, b) not in wrong:
            assert abs(found[a] * found[b] - expected[a, b]) <= TOLERANCE * expected[a, b]


def test_factors_realise_a_factorable_table():
    """A table that is a product of factors, such as that of pool balls and cushions, needs no collision handler."""
    expected = np.array([[0.95, 0.85], [0.85, 0.0]])
    colliding = np.array([[True, True], [True, False]])
    assert not wrong_pairs(expected, colliding, factors(expected, colliding, [None, None]))
