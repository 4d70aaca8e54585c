"""Orders of convergence, of integrators with known ones and of errors that do not fall steadily."""

from dataclasses import replace

import pytest

import sandbox
from sandbox.measure.tradeoff.configuration import Configuration, Evaluation
from sandbox.measure.tradeoff.convergence import convergence_orders
from sandbox.scene.files.load import load
from sandbox.scene.files.shipped_scenes import find
from tests.measure.tradeoff.evaluations_by_hand import point_of


def series(*errors: float, **more: object) -> list[Evaluation]:
    """Return a method with 1, 2, 4 … substeps and these errors."""
    points = [point_of(1.0, error, dt=0.01, substeps=2**k) for k, error in enumerate(errors)]
    return [replace(each, configuration=replace(Configuration.of("pymunk", each.settings), **more)) for each in points]


@pytest.mark.fail_slow(60)  # a search
@pytest.mark.parametrize(
    ("integrator", "order"), [("explicit_euler", 1), ("semi_implicit_euler", 1), ("velocity_verlet", 2), ("rk4", 4)]
)
def test_orders_of_integrators_on_a_spring(integrator: str, order: int) -> None:
    scene = load(find("spring"), ["world.duration=1.0"])
    found = sandbox.tradeoff(
        scene, "reference", tolerance=1e-9, integrator=integrator, dt=0.01, effort=2.0, repeats=1, starts=1,
        is_explained=False,
    )  # fmt: skip
    (own,) = [each for each in found.orders if not each.changes]
    assert own.order == pytest.approx(order, abs=0.2)  # higher terms of the error at the coarsest of these steps
    assert len(own.points) >= 3
    assert {found.points[k].settings.integrator for k in own.points} == {integrator}
    assert found.document()["orders"][found.orders.index(own)]["order"] == own.order


def test_only_errors_that_fall_steadily_have_an_order() -> None:
    assert [each.order for each in convergence_orders(series(0.4, 0.1, 0.025), 1.0)] == [pytest.approx(2.0)]
    assert not convergence_orders(series(0.4, 0.1), 1.0), "two substeps lie on any line"
    assert not convergence_orders(series(0.4, 0.3, 0.02), 1.0), "slopes of 0.4 and 3.9"
    assert not convergence_orders(series(0.4, 0.4, 0.4), 1.0), "no convergence"
    assert not convergence_orders(series(4e-7, 1e-7, 0.25e-7), 1.0), "below a millionth of the tolerance"


def test_coarse_substeps_that_do_not_show_the_order_are_left_out() -> None:
    (found,) = convergence_orders(series(0.9, 0.8, 0.4, 0.2, 0.1), 1.0)
    assert found.order == pytest.approx(1.0)
    assert (found.points, found.coarsest) == ((1, 2, 3, 4), 0.005)


def test_methods_have_orders_of_their_own() -> None:
    points = [*series(0.4, 0.2, 0.1), *series(0.4, 0.1, 0.025, iterations=20)]
    assert [each.order for each in convergence_orders(points, 1.0)] == [pytest.approx(1.0), pytest.approx(2.0)]
