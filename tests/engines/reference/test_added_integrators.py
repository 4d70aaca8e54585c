"""Integrators of one's own: `sandbox.add_integrator`."""

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sandbox
from sandbox.arrays import FloatArray
from sandbox.engines.reference.integrators import INTEGRATORS
from sandbox.scene.description.world import ADDED_INTEGRATORS

pytestmark = pytest.mark.usefixtures("own_integrators")


def midpoint(f: Any, t: float, x: FloatArray, u: Any, h: float) -> FloatArray:
    return np.asarray(x + h * f(t + h / 2, x + h / 2 * f(t, x, u), u))


def kick_drift(f: Any, t: float, x: FloatArray, u: Any, h: float) -> FloatArray:
    velocity = x[1] + h * f(t, x, u)[1]
    return np.stack((x[0] + h * velocity, velocity))


def drift_kick(f: Any, t: float, x: FloatArray, u: Any, h: float) -> FloatArray:
    return np.asarray(x + h * f(t, x, u))


def test_order_and_fraction_are_measured() -> None:
    for step, order, fraction in ((midpoint, 2, 0.5), (kick_drift, 1, 1.0), (drift_kick, 1, 0.0)):
        found = INTEGRATORS[sandbox.add_integrator(step)]
        assert (found.order, found.fraction) == (order, fraction)


def taylor(order: int) -> Any:
    """Return the Taylor method of this order for linear equations."""

    def step(f: Any, t: float, x: FloatArray, u: Any, h: float) -> FloatArray:
        constant = f(t, np.zeros_like(x), u)
        term = f(t, x, u) * h
        moved = x + term
        for k in range(2, order + 1):
            term = (f(t, term, u) - constant) * h / k
            moved = moved + term
        return np.asarray(moved)

    return step


def test_orders_whose_errors_are_soon_those_of_rounding_are_measured() -> None:
    for order in range(1, 13):
        assert INTEGRATORS[sandbox.add_integrator(taylor(order), "taylor")].order == order
    with pytest.raises(ValueError, match="cannot be measured"):
        sandbox.add_integrator(taylor(20), "exact_to_rounding")


@pytest.mark.parametrize("scene", ["spring", "bounce", "kepler"])
def test_a_copy_of_a_built_in_integrator_gives_its_run(scene: str) -> None:
    settings: Any = {"engine": "reference", "audit": False}
    loaded = sandbox.load(scene, ["world.duration=2"])
    name = sandbox.add_integrator(kick_drift)
    own = sandbox.run(loaded, integrator=name, **settings)
    built_in = sandbox.run(loaded, integrator="semi_implicit_euler", **settings)
    np.testing.assert_allclose(own.position, built_in.position, rtol=0.0, atol=1e-12)  # rounding of a few hundred steps


def test_error_of_the_midpoint_method_in_a_scene_is_of_second_order() -> None:
    name = sandbox.add_integrator(midpoint)
    rows = sandbox.compare(
        "spring", ("reference",), sweep={"solver.integrator": [name], "solver.dt": [0.02, 0.01]}
    ).rows
    coarse, fine = (row.score.max_position or 0.0 for row in rows)
    assert np.log2(coarse / fine) == pytest.approx(2.0, abs=0.1)  # fitted at finite steps


def test_file_of_a_run_is_read_where_its_integrator_has_been_added(tmp_path: Path) -> None:
    name = sandbox.add_integrator(midpoint)
    run = sandbox.run("spring", engine="reference", integrator=name)
    run.save(tmp_path / "run.npz")
    assert sandbox.Trajectory.load(tmp_path / "run.npz").info["settings"]["integrator"] == name
    ADDED_INTEGRATORS.remove(name)
    del INTEGRATORS[name]  # as in another process
    with pytest.raises(ValueError, match=r"add_integrator first"):
        sandbox.Trajectory.load(tmp_path / "run.npz")


def test_integrate_takes_it() -> None:
    name = sandbox.add_integrator(midpoint, "my_midpoint")
    found = sandbox.integrate(lambda t, x, u: -x, [1.0], np.linspace(0.0, 1.0, 101), name)
    assert float(found.x[-1, 0]) == pytest.approx(np.exp(-1.0), abs=1e-5)  # h²/6


def test_the_function_may_be_changed_and_added_again() -> None:
    sandbox.add_integrator(drift_kick, "mine")
    sandbox.add_integrator(midpoint, "mine")
    assert INTEGRATORS["mine"].order == 2  # type: ignore[index]  # added at run time


@pytest.mark.parametrize(
    ("step", "problem"),
    [
        (lambda f, t, x, u, h: x + f(t, x, u), "does not converge"),
        (lambda f, t, x, u, h: x, "does not converge"),
        (lambda f, t, x, u, h: x[0], "an array of shape"),
        (lambda f, t, x, u, h: None, "an array of shape"),
        (lambda f, t, x, u, h: x + h * (1 + 0j) * f(t, x, u), "type float64"),
        (lambda f, t, x, u, h: np.float32(x + h * f(t, x, u)), "type float64"),
        (lambda f, t, x, u, h: x / 0.0 if h else x, "finite"),
        (lambda f, t, x, u, h: np.add(x, h * f(t, x, u), out=x), "changes x"),
    ],
)
@pytest.mark.filterwarnings("ignore:(divide by zero|invalid value)")
def test_a_faulty_function_is_refused(step: Any, problem: str) -> None:
    with pytest.raises(ValueError, match=problem):
        sandbox.add_integrator(step, "faulty")
    assert "faulty" not in INTEGRATORS
    with pytest.raises(sandbox.SettingsError):
        sandbox.run("spring", engine="reference", integrator="faulty")  # type: ignore[arg-type]  # unknown name


@pytest.mark.parametrize("name", ["rk4", "two words", "", 3])
def test_names_of_built_in_integrators_and_no_names_are_refused(name: Any) -> None:
    with pytest.raises(ValueError, match="choose another name"):
        sandbox.add_integrator(midpoint, name)


def test_functions_without_a_name_need_one() -> None:
    nameless: Any = partial(midpoint)
    with pytest.raises(ValueError, match="choose another name"):
        sandbox.add_integrator(nameless)
    assert sandbox.add_integrator(nameless, "part") == "part"
