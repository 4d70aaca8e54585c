"""Every pair of materials uses exactly its own coefficients of restitution and friction."""

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.engines.common.pair_factors import TOLERANCE, factors, wrong_pairs
from sandbox.engines.registry import start
from sandbox.scene.files.load import from_document


def rebound_ratios(document: dict[str, object], balls: int) -> np.ndarray:
    """Run a scene of balls that each hit a wall and return −v_after / v_before of each, (N,)."""
    simulation = start(from_document(document))
    before = simulation.frame().velocity[:, 1].copy()
    for _ in range(20):
        simulation.step()
    return -simulation.frame().velocity[:, 1] / before


def test_restitution_set_on_one_side_both_sides_or_neither():
    document = {
        "solver": {"dt": 0.01},
        "material": [{"name": "half", "restitution": 0.5}, {"name": "nothing"}],
        "wall": [
            {"points": [[-1, 0], [1, 0]], "material": "half"},
            {"points": [[9, 0], [11, 0]]},
            {"points": [[19, 0], [21, 0]], "material": "half"},
            {"points": [[29, 0], [31, 0]]},
            {"points": [[39, 0], [41, 0]], "restitution": 0.25, "material": "half"},
        ],
        "ball": [
            {"position": [0, 1], "velocity": [0, -10], "radius": 0.5, "restitution": 0.8},
            {"position": [10, 1], "velocity": [0, -10], "radius": 0.5, "restitution": 0.8},
            {"position": [20, 1], "velocity": [0, -10], "radius": 0.5, "material": "nothing"},
            {"position": [30, 1], "velocity": [0, -10], "radius": 0.5},
            {"position": [40, 1], "velocity": [0, -10], "radius": 0.5, "restitution": 0.8},
        ],
    }
    # One contact each, solved independently: one or two roundings.
    assert np.allclose(rebound_ratios(document, 5), [0.4, 0.8, 0.5, 0.0, 0.2], rtol=0, atol=1e-15)


MATERIALS = ("a", "b", "c")


@given(st.lists(st.floats(0, 1), min_size=6, max_size=6))
def test_any_table_of_pair_coefficients_is_realised(values):
    """Six coefficients for the pairs of three materials cannot be products of three factors."""
    pairs = list(itertools.combinations_with_replacement(MATERIALS, 2))
    document = {
        "solver": {"dt": 0.01},
        "material": [{"name": m} for m in MATERIALS],
        "pair": [{"between": list(p), "restitution": e} for p, e in zip(pairs, values, strict=True)],
        "wall": [],
        "ball": [],
    }
    for k, (a, b) in enumerate(pairs):
        document["wall"].append({"points": [[10 * k - 1, 0], [10 * k + 1, 0]], "material": a})
        document["ball"].append({"position": [10 * k, 1], "velocity": [0, -10], "radius": 0.5, "material": b})
        # Only walls and balls of a pair collide here; pairs of two balls are tested below.
    measured = rebound_ratios(document, 6)
    # The impulse (1 + e)·10 is rounded: a few ulps of 20, divided by 10.
    assert np.allclose(measured, values, rtol=0, atol=1e-15)


@given(st.floats(0, 1), st.floats(0, 1))
def test_balls_rebound_with_the_restitution_of_their_pair(e, between):
    document = {
        "solver": {"dt": 0.01},
        "material": [{"name": "x", "restitution": 0.3}, {"name": "y"}],
        "pair": [
            {"between": ["x", "x"], "restitution": e},
            {"between": ["y", "x"], "restitution": between},
        ],
        "ball": [
            {"position": [-1, 0], "velocity": [10, 0], "radius": 0.5, "material": "x"},
            {"position": [1, 0], "velocity": [-10, 0], "radius": 0.5, "material": "x"},
            {"position": [-1, 9], "velocity": [10, 0], "radius": 0.5, "material": "x"},
            {"position": [1, 9], "velocity": [-10, 0], "radius": 0.5, "material": "y"},
        ],
    }
    simulation = start(from_document(document))
    for _ in range(20):
        simulation.step()
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


def test_friction_of_a_pair_decelerates_a_sliding_ball():
    """A ball that still slides decelerates by μ·g: its slip starts at v₀ and shrinks by 3μg a second (disc)."""
    document = {
        "world": {"gravity": [0, -9.81]},
        "solver": {"dt": 0.001, "slop": 0.0},
        "material": [{"name": "ice"}, {"name": "disc"}, {"name": "third"}],
        "pair": [
            {"between": ["ice", "disc"], "friction": 0.1},
            {"between": ["disc", "disc"], "friction": 0.7},
            {"between": ["third", "disc"], "friction": 0.9},
            {"between": ["third", "ice"], "friction": 0.05},
            {"between": ["third", "third"], "friction": 0.6},
        ],
        "plane": [{"point": [0, 0], "normal": [0, 1], "material": "ice"}],
        "ball": [
            {"position": [0, 0.5], "velocity": [5, 0], "radius": 0.5, "material": "disc"},
            {"position": [100, 0.5], "velocity": [5, 0], "radius": 0.5, "material": "third"},
        ],
    }
    simulation = start(from_document(document))
    for _ in range(500):
        simulation.step()
    v = simulation.frame().velocity[:, 0]
    # The first contact is at most a step late: μ·g·h = 1e-3 m/s.
    assert v[0] == pytest.approx(5 - 0.1 * 9.81 * 0.5, abs=2e-3)
    assert v[1] == pytest.approx(5 - 0.05 * 9.81 * 0.5, abs=2e-3)
