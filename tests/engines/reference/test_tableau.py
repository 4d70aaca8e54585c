"""Tableaus: order conditions of Runge–Kutta methods (Butcher's rooted trees)."""

import numpy as np
import pytest

from sandbox.engines.reference.integrators import CLASSIC_4, EULER, Inputs, Tableau, runge_kutta

TABLES = {"euler": (EULER, 1), "classic": (CLASSIC_4, 4)}


def matrix(table: Tableau) -> np.ndarray:
    """Return the weights of the stages as a square matrix."""
    size = len(table.b)
    return np.array([[*row, *[0.0] * (size - len(row))] for row in table.a])


@pytest.mark.parametrize("name", TABLES)
def test_rows_sum_to_the_time_of_their_stage(name):
    table, _ = TABLES[name]
    assert matrix(table).sum(axis=1).tolist() == list(table.c)


@pytest.mark.parametrize("name", TABLES)
def test_tableau_is_explicit(name):
    table, _ = TABLES[name]
    assert [len(row) for row in table.a] == list(range(len(table.b)))


@pytest.mark.parametrize("name", TABLES)
def test_order_conditions_hold_up_to_the_order_and_not_beyond(name):
    table, order = TABLES[name]
    a, b, c = matrix(table), np.array(table.b), np.array(table.c)
    trees = {
        1: [(b.sum(), 1)],
        2: [(b @ c, 1 / 2)],
        3: [(b @ c**2, 1 / 3), (b @ a @ c, 1 / 6)],
        4: [(b @ c**3, 1 / 4), ((b * c) @ a @ c, 1 / 8), (b @ a @ c**2, 1 / 12), (b @ a @ a @ c, 1 / 24)],
    }
    for upto in range(1, order + 1):
        for weight, expected in trees[upto]:
            assert weight == pytest.approx(expected, abs=1e-15)  # some additions of numbers near 1
    if order < 4:
        assert all(weight != pytest.approx(expected) for weight, expected in trees[order + 1])


def test_runge_kutta_runs_any_tableau():
    heun = Tableau(a=((), (1.0,)), b=(0.5, 0.5), c=(0.0, 1.0))
    x = np.array([[[2.0]], [[0.0]]])
    moved = runge_kutta(heun)(lambda t, x, u: t + x, 1.0, x, Inputs(np.zeros((1, 1))), 0.5)
    # k₁ = 1 + 2, k₂ = 1.5 + (2 + 0.5·3); x + h/2 (k₁ + k₂): exact in binary
    assert moved[0, 0, 0] == 2.0 + 0.25 * (3.0 + 5.0)


def test_step_does_not_modify_its_arguments():
    x = np.ones((2, 3, 2))
    runge_kutta(CLASSIC_4)(lambda t, x, u: -x, 0.0, x, Inputs(np.zeros((3, 2))), 0.1)
    assert (x == 1.0).all()
