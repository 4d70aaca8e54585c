"""Integrate: ẋ = f(t, x, u) of one's own, by the fixed-step integrators of the reference engine.

import numpy as np
import sandbox

def oscillator(t, x, u):            # x[0] position, x[1] velocity
    return np.stack((x[1], u - 4.0 * x[0]))

found = sandbox.integrate(oscillator, [[1.0], [0.0]], np.linspace(0.0, 10.0, 1001), method="rk4", u=0.0)
found.t, found.x                    # (T,) and (T, 2, 1)
"""

import difflib
import inspect
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from sandbox.arrays import FloatArray
from sandbox.echo import short_repr
from sandbox.engines.reference.integrators import INTEGRATORS

Derivative = Callable[[float, FloatArray, Any], npt.ArrayLike]
"""f(t, x, u) → ẋ, of the same shape as x."""

SPLIT = ("semi_implicit_euler", "velocity_verlet", "leapfrog")
"""Methods for second-order systems: x[0] holds positions, x[1] velocities, and f(t, x, u)[0] is x[1]."""

SYNONYMS = {
    "forward_euler": "explicit_euler",
    "symplectic_euler": "semi_implicit_euler",
    "euler_cromer": "semi_implicit_euler",
    "runge_kutta": "rk4",
}
"""Other names of the methods, which the message on an unknown one knows."""


class IntegrationResult(NamedTuple):
    """States at T times, as in `scipy.integrate.solve_ivp` but with time as the first axis."""

    t: FloatArray
    """(T,) times, as given"""
    x: FloatArray
    """`(T, *x0.shape)` state at each time"""
    method: str
    """name of the integrator"""
    order: int
    """order of the integrator: the global error decreases as h to this power"""
    evaluations: int
    """number of calls of f"""

    def __repr__(self) -> str:
        """Return method, number of steps, times and shape."""
        span = f"t = {self.t[0]:g} to {self.t[-1]:g}"
        steps = f"{len(self.t) - 1:,} steps, {span}; x of shape {self.x.shape[1:]}"
        return f"<IntegrationResult {self.method}: {steps}; f called {self.evaluations:,} times>"


class _Input(NamedTuple):
    """The input in the form in which the integrators expect theirs."""

    value: Any
    damped: bool = True
    """f may depend on velocity: leapfrog then predicts the velocity at mid-step, which keeps second order"""


def integrate(
    f: Derivative, x0: npt.ArrayLike, t: npt.ArrayLike, method: str = "rk4", u: Any = None
) -> IntegrationResult:
    """Integrate ẋ = f(t, x, u) from x0 with a fixed-step method, one step between two successive times.

    `explicit_euler` (order 1) and `rk4` (order 4) accept any f and a state of any shape. `semi_implicit_euler` (order
    1), `velocity_verlet` and `leapfrog` (order 2) integrate second-order systems: x has the shape (2, …), x[0] holds
    positions and x[1] velocities. They use only the acceleration f(t, x, u)[1], and take x[1] as the derivative of
    x[0]. If the acceleration depends on velocity, the order is kept but symplecticity is lost.

    Units are those of f. There is no error control: choose a sufficiently small step. Explicit methods are unstable if
    the step is too large (ω·h ≥ 2 for an oscillator with Verlet or leapfrog, 2.83 with rk4, any h with explicit Euler).

    Args:
        f: called as f(t, x, u), with t a float and x an array that it must not change; returns ẋ, of the shape of x.
        x0: state at t[0], real numbers.
        t: (T,) times, finite and strictly increasing or decreasing; the steps are their differences.
        method: a name in `sandbox.INTEGRATORS`.
        u: input, passed to f unchanged. If it is callable, f gets the value of u(t).

    Returns:
        The states at all times.

    Raises:
        TypeError: f is no function of (t, x, u).
        ValueError: the method is unknown, the times or x0 are invalid, f fails at x0, or f returns an array of another
            shape than x.

    Example:
        >>> found = sandbox.integrate(lambda t, x, u: -x, [1.0], [0.0, 0.5, 1.0], "rk4")
        >>> round(float(found.x[-1, 0]), 4)
        0.3682
    """
    if not isinstance(method, str) or method not in INTEGRATORS:
        raise ValueError(f"no integrator {short_repr(method)}; {_near(method)}integrators: {', '.join(INTEGRATORS)}")
    _check_signature(f)
    scheme = INTEGRATORS[method]
    times = np.array(t, np.float64)
    if times.ndim == 0:
        raise ValueError(f"t: an array of times is expected, such as np.linspace(0.0, 1.0, 101); it is {times:g}")
    if times.ndim != 1 or not len(times) or not np.isfinite(times).all():
        raise ValueError(f"t: times of shape (T,), T ≥ 1, all finite are expected; the shape is {times.shape}")
    steps = np.diff(times)
    if not ((steps > 0.0).all() or (steps < 0.0).all()):
        raise ValueError("t: times must strictly increase or strictly decrease")
    state = np.array(x0, np.float64)
    if method in SPLIT and (state.ndim == 0 or len(state) != 2):
        raise ValueError(f"x0: {method} needs the shape (2, …), positions and velocities; it is {state.shape}")
    shape, calls = state.shape, 0

    def derivative(time: float, x: FloatArray, given: Any) -> FloatArray:
        nonlocal calls
        calls += 1
        value = given.value(time) if callable(given.value) else given.value
        try:
            returned = f(time, x, value)
        except (IndexError, TypeError, ValueError) as error:
            if calls > 1:
                raise
            raise ValueError(f"f fails at x0 of shape {shape}: {type(error).__name__}: {error}") from error
        try:
            found = np.asarray(returned, np.float64)
        except (TypeError, ValueError) as error:
            raise ValueError(f"f returns {short_repr(returned)}; an array of shape {shape} is expected") from error
        if returned is None or found.shape != shape:
            description = "None" if returned is None else f"the shape {found.shape}"
            raise ValueError(f"f returns {description}; x has the shape {shape}")
        return found

    given: Any = _Input(u)
    states = np.empty((len(times), *shape))
    states[0] = state
    for k, h in enumerate(steps.tolist()):
        states[k + 1] = state = scheme.step(derivative, float(times[k]), state, given, h)
    return IntegrationResult(times, states, method, scheme.order, calls)


def _near(method: object) -> str:
    """Return which method an unknown name may mean: `did you mean …? `, or nothing."""
    if not isinstance(method, str):
        return ""
    name = method.lower().replace("-", "_").replace(" ", "_")
    known: dict[str, str] = {**{str(each): str(each) for each in INTEGRATORS}, **SYNONYMS}
    containing = [each for each in known if name and name in each]
    close = containing or difflib.get_close_matches(name, known, n=1)
    return f"did you mean {known[close[0]]!r}? " if close else ""


def _check_signature(f: object) -> None:
    """Check that f can be called as f(t, x, u).

    Raises:
        TypeError: it cannot.
    """
    if not callable(f):
        raise TypeError(f"f: a function f(t, x, u) is expected, is {short_repr(f)}")
    try:
        signature = inspect.signature(f)
    except ValueError:  # a compiled function that does not state its parameters
        return
    try:
        signature.bind(0.0, None, None)
    except TypeError:
        name = getattr(f, "__name__", type(f).__name__)
        raise TypeError(f"f is called as f(t, x, u), with three arguments; it is {name}{signature}") from None
