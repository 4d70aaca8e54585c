"""`integrate` of a user's f(t, x, u): orders of convergence, inputs, shapes and errors."""

import math
from collections.abc import Callable

import numpy as np
import pytest

import sandbox
from sandbox.arrays import FloatArray
from sandbox.engines.reference.integrate import SPLIT

METHODS = tuple(sandbox.INTEGRATORS)
OMEGA = 2.0


def oscillator(t: float, x: FloatArray, u: float | None) -> FloatArray:
    return np.stack((x[1], -(OMEGA**2) * x[0]))


def driven_and_damped(t: float, x: FloatArray, u: FloatArray) -> FloatArray:
    """Return ẋ of a driven oscillator; the input u is chosen such that the solution is sin(t)."""
    return np.stack((x[1], u - 0.3 * x[1] - x[0]))


def slope(method: str, error_of: "object") -> float:
    counts = np.asarray([200, 400, 800, 1600] if sandbox.INTEGRATORS[method].order == 1 else [40, 80, 160, 320])
    errors = [error_of(method, int(n)) for n in counts]  # type: ignore[operator]
    return float(-np.polyfit(np.log(counts), np.log(errors), 1)[0])


def driven_error(method: str, steps: int) -> float:
    def u(t: float) -> float:  # -sin t + 0.3 cos t + sin t: the solution is sin t
        return 0.3 * math.cos(t)

    found = sandbox.integrate(driven_and_damped, [0.0, 1.0], np.linspace(0.0, 3.0, steps + 1), method, u)
    return float(np.abs(found.x[-1] - [math.sin(3.0), math.cos(3.0)]).max())


@pytest.mark.parametrize("method", METHODS)
def test_error_with_an_input_and_damping_falls_by_the_order(method: str) -> None:
    assert slope(method, driven_error) == pytest.approx(sandbox.INTEGRATORS[method].order, abs=0.2)


@pytest.mark.parametrize("method", ["explicit_euler", "rk4"])
def test_first_order_system_of_any_shape_is_integrated(method: str) -> None:
    def decay(t: float, x: FloatArray, rate: FloatArray) -> FloatArray:
        return -rate * x

    rates = np.arange(1.0, 7.0).reshape(2, 3)
    found = sandbox.integrate(decay, np.ones((2, 3)), np.linspace(0.0, 1.0, 10_001), method, rates)
    assert found.x.shape == (10_001, 2, 3)
    assert found.x[-1] == pytest.approx(np.exp(-rates), rel=0.01)


def test_result_has_times_states_order_and_calls() -> None:
    times = [0.0, 0.1, 0.3]
    found = sandbox.integrate(oscillator, [[1.0, 0.0], [0.0, 1.0]], times, "rk4")
    assert isinstance(found, sandbox.IntegrationResult)
    assert (found.t.tolist(), found.x.shape, found.method, found.order, found.evaluations) == (
        times, (3, 2, 2), "rk4", 4, 8,
    )  # fmt: skip
    assert repr(found).startswith("<IntegrationResult rk4: 2 steps, t = 0 to 0.3;")


def test_motion_back_in_time_returns_to_the_start() -> None:
    forward = sandbox.integrate(oscillator, [1.0, 0.5], np.linspace(0.0, 2.0, 101), "leapfrog")
    back = sandbox.integrate(oscillator, forward.x[-1], np.linspace(2.0, 0.0, 101), "leapfrog")
    assert back.x[-1] == pytest.approx([1.0, 0.5], abs=1e-12)  # leapfrog is reversible, but for rounding


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (([1.0, 0.0], [0.0, 1.0], "rk5"), "no integrator 'rk5'; .*integrators: explicit_euler"),
        (([1.0, 0.0], [0.0, 1.0, 0.5]), "strictly"),
        (([1.0, 0.0], [0.0, math.nan]), "finite"),
        (([1.0, 0.0], []), "T ≥ 1"),
        (([1.0, 0.0], 1.0), r"t: an array of times .* it is 1$"),
        (([1.0, 0.0], [[0.0, 1.0]]), r"the shape is \(1, 2\)"),
        (([1.0, 0.0, 0.0], [0.0, 1.0]), r"f returns the shape \(2,\); x has the shape \(3,\)"),
        ((1.0, [0.0, 1.0]), r"f fails at x0 of shape \(\): IndexError"),
        (([1.0], [0.0, 1.0]), r"f fails at x0 of shape \(1,\): IndexError"),
    ],
)
def test_invalid_arguments_raise_value_error(arguments: tuple[object, ...], reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        sandbox.integrate(oscillator, *arguments)  # type: ignore[arg-type]


@pytest.mark.parametrize("method", SPLIT)
def test_methods_for_second_order_systems_need_positions_and_velocities(method: str) -> None:
    with pytest.raises(ValueError, match="positions and velocities"):
        sandbox.integrate(lambda t, x, u: -x, np.ones(3), [0.0, 1.0], method)


@pytest.mark.parametrize(
    ("name", "suggestion"),
    [
        ("euler", "explicit_euler"),
        ("Forward Euler", "explicit_euler"),
        ("semi-implicit", "semi_implicit_euler"),
        ("symplectic_euler", "semi_implicit_euler"),
        ("verlet", "velocity_verlet"),
        ("leap_frog", "leapfrog"),
        ("RK4", "rk4"),
        ("rk45", "rk4"),
    ],
)
def test_similar_name_of_a_method_is_suggested(name: str, suggestion: str) -> None:
    with pytest.raises(ValueError, match=f"did you mean '{suggestion}'"):
        sandbox.integrate(oscillator, [1.0, 0.0], [0.0, 1.0], name)


@pytest.mark.parametrize("method", ["", "adams", 4, ["rk4"], None])
def test_unknown_method_is_refused_without_a_suggestion(method: object) -> None:
    with pytest.raises(ValueError, match=r"no integrator .*; integrators: "):
        sandbox.integrate(oscillator, [1.0, 0.0], [0.0, 1.0], method)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("f", "reason"),
    [
        (lambda t, x: x, r"f is called as f\(t, x, u\), with three arguments; it is <lambda>\(t, x\)"),
        (lambda t, x, u, extra: x, "with three arguments"),
        (1.0, "f: a function f"),
    ],
)
def test_function_with_the_wrong_signature_is_refused(f: Callable[..., object], reason: str) -> None:
    with pytest.raises(TypeError, match=reason):
        sandbox.integrate(f, [1.0, 0.0], [0.0, 1.0])  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("result", "reason"),
    [
        (None, "f returns None"),
        (1.0, r"f returns the shape \(\)"),
        ([1.0, [2.0, 3.0]], "f returns .*an array of shape"),
        ([[1.0, 0.0]], r"f returns the shape \(1, 2\)"),
    ],
)
def test_result_of_the_wrong_shape_is_refused(result: object, reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        sandbox.integrate(lambda t, x, u: result, [1.0, 0.0], [0.0, 1.0])  # type: ignore[arg-type, return-value]


def test_function_with_optional_arguments_is_called_with_three_arguments() -> None:
    def decay(t: float, x: FloatArray, u: object = None, rate: float = 1.0) -> FloatArray:
        return -rate * x

    assert sandbox.integrate(decay, 1.0, np.linspace(0.0, 1.0, 11)).x[-1] == pytest.approx(math.exp(-1.0), rel=1e-5)
