"""Order of convergence of each scheme, by halving the step in whole scenes."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from sandbox.engines.reference.integrators import INTEGRATORS as TABLE
from sandbox.measure.analytic import bounces
from sandbox.measure.analytic.trajectory import solved_run
from sandbox.scene.files.load import from_document
from tests.laws.engine_configs import INTEGRATORS, EngineConfig, drop

pytestmark = pytest.mark.fail_slow(60)  # sweeps of step sizes

STEPS = np.array([0.04, 0.02, 0.01, 0.005])


def fitted_order(errors) -> float:
    return float(np.polyfit(np.log(STEPS), np.log(errors), 1)[0])


def projectile_with_drag():
    world = {"gravity": [0.0, -9.81], "linear_drag": 0.3, "quadratic_drag": 0.05, "wind": [2.0, 0.5], "duration": 2.0}
    return from_document({"world": world, "ball": [{"position": [0, 0], "velocity": [15, 20], "radius": 0.1}]})


def final_state():
    """Return the final state by DOP853 at its smallest tolerances, an independent reference."""

    def flight(_, s):
        wind = s[2:] - [2.0, 0.5]
        return [*s[2:], *([0.0, -9.81] - 0.3 * wind - 0.05 * np.hypot(*wind) * wind)]

    return solve_ivp(flight, (0, 2), [0, 0, 15, 20], method="DOP853", rtol=1e-13, atol=1e-13).y[:, -1]


@pytest.mark.parametrize(
    "config", [*(EngineConfig("reference", {"integrator": word}) for word in INTEGRATORS), EngineConfig("pymunk", {})]
)
def test_flight_through_air_converges_at_the_order_of_its_scheme(config):
    order = 1 if config.engine == "pymunk" else TABLE[config.settings["integrator"]].order
    expected, scene = final_state(), projectile_with_drag()
    errors = []
    for dt in STEPS:
        result = config.run(scene, dt=float(dt))
        errors.append(np.abs(np.concatenate((result.position[-1, 0], result.velocity[-1, 0])) - expected).max())
    assert fitted_order(errors) == pytest.approx(order, abs=0.2)  # a fit over three halvings


@pytest.mark.parametrize(
    ("config", "drag"),
    [
        *((EngineConfig("reference", {"integrator": word}), 0.3) for word in INTEGRATORS),
        (EngineConfig("pymunk", {}), 0.0),
    ],
)
def test_damped_flight_converges_at_the_order_of_its_scheme(config, drag):
    """Velocities and spins against DOP853 at its smallest tolerances, with drag and wind where an engine has both."""
    world = {"gravity": [0.0, -9.81], "damping": 0.3, "linear_drag": drag, "wind": [2.0, 0.5], "duration": 2.0}
    flight = {"position": [0, 0], "velocity": [15, 20], "angular_velocity": 6.0, "radius": 0.1}
    scene, rate = from_document({"world": world, "ball": [flight]}), -np.log(0.3)

    def derivative(_, s):
        velocity = s[3:5]
        return [*s[3:], *([0.0, -9.81] - drag * (velocity - [2.0, 0.5]) - rate * velocity), -rate * s[5]]

    start = [0, 0, 0, 15, 20, 6.0]
    expected = solve_ivp(derivative, (0, 2), start, method="DOP853", rtol=1e-13, atol=1e-13).y[:, -1]
    errors = []
    for dt in STEPS:
        run = config.run(scene, dt=float(dt))
        end = [*run.position[-1, 0], run.angle[-1, 0], *run.velocity[-1, 0], run.angular_velocity[-1, 0]]
        errors.append(np.abs(end - expected))
    order = 1 if config.engine == "pymunk" else TABLE[config.settings["integrator"]].order
    assert fitted_order(np.max(errors, axis=1)) == pytest.approx(order, abs=0.2)  # a fit over three halvings
    spins = np.asarray(errors)[:, [2, 5]].max(axis=1)
    assert fitted_order(spins) == pytest.approx(order, abs=0.2)  # likewise


@pytest.mark.fail_slow(60)  # takes over half a second
@pytest.mark.parametrize(("settings", "order"), [({"detection": "swept"}, 2), ({"detection": "discrete"}, 1)])
def test_bounce_converges_at_the_order_of_its_detection(settings, order):
    """The largest error over many phases of the impact within the step, as that of a single phase is random."""
    errors = np.zeros(len(STEPS))
    for height in np.linspace(1.0, 1.2, 25):
        scene = drop(0.8, float(height), 0.8)
        exact = bounces(np.array([0.8]), float(height), 0.0, 9.81, 0.8)[0][0]
        for k, dt in enumerate(STEPS):
            result = EngineConfig("reference", {"integrator": "velocity_verlet", **settings}).run(scene, dt=float(dt))
            errors[k] = max(errors[k], abs(result.position[-1, 0, 1] - 0.5 - exact))
    # the maximum over 25 phases is slightly below that over all
    assert fitted_order(errors) == pytest.approx(order, abs=0.3)


@pytest.mark.fail_slow(60)  # takes over half a second
@pytest.mark.parametrize("detection", ["bisect", "swept"])
@pytest.mark.parametrize(("e", "h"), [(0.8, 0.007), (0.8, 0.0035), (0.9, 0.007)])
def test_explicit_euler_with_exact_impacts_never_stops_bouncing(detection, e, h):
    """Each flight gains g·h, so rebounds tend to v = e·(v + g·h): a documented flaw of the scheme."""
    result = EngineConfig("reference", {"detection": detection}).run(drop(e, 1.0, 15.0), dt=h)
    rebound = -e / (1 + e) * result.contact_impulse[-4:, 1]
    np.testing.assert_allclose(rebound, e * 9.81 * h / (1 - e), rtol=0.05)  # the gain varies with the phase in a step


def test_bisection_with_an_exact_flight_has_only_the_error_of_its_epsilon():
    scene = drop(0.8, 1.0, 0.8)
    exact = bounces(np.array([0.8]), 1.0, 0.0, 9.81, 0.8)[0][0]
    result = EngineConfig("reference", {"integrator": "velocity_verlet", "detection": "bisect"}).run(scene)
    assert result.position[-1, 0, 1] - 0.5 == pytest.approx(exact, abs=1e-9)  # 1e-9 of 0.01 s at 4.4 m/s, 1.8-fold


SPRING = {
    "world": {"duration": 1.3},
    "ball": [{"name": "m", "position": [1.1, 0.0], "velocity": [0.3, 0.0], "radius": 0.1, "collides": "none"}],
    "joint": [{"kind": "spring", "between": ["m"], "rest_length": 1.0, "stiffness": 39.0, "damping": 0.5}],
}
ORBIT = {
    "world": {"duration": 2.0},
    "ball": [{"position": [1.0, 0.0], "velocity": [0.2, 1.1], "radius": 0.01, "collides": "none"}],
    "attraction": [{"toward": [0.0, 0.0], "strength": 1.0}],
}
PENDULUM = {
    "world": {"gravity": [0.0, -9.81], "duration": 1.3},
    "ball": [{"name": "m", "position": [0.8, -0.6], "velocity": [1.5, 2.0], "radius": 0.1, "collides": "none"}],
    "joint": [{"kind": "rod", "between": ["m"], "length": 1.0}],
}
RATTLE = {"joints": "rattle"}
SMOOTH = [
    *(
        (document, EngineConfig("reference", {"integrator": word}), TABLE[word].order)
        for document in (SPRING, ORBIT)
        for word in INTEGRATORS
    ),
    *(
        (PENDULUM, EngineConfig("reference", {"integrator": word} | RATTLE), 2)
        for word in ("velocity_verlet", "leapfrog", "rk4")
    ),
    (PENDULUM, EngineConfig("reference", {"integrator": "semi_implicit_euler"}), 1),
    *((document, EngineConfig("pymunk", {}), 1) for document in (SPRING, ORBIT, PENDULUM)),
]


@pytest.mark.fail_slow(60)  # takes over half a second
@pytest.mark.parametrize(
    ("document", "config", "order"),
    SMOOTH,
    ids=["-".join((*sorted({"joint", "attraction"} & set(d)), w.engine, *w.settings.values())) for d, w, _ in SMOOTH],
)
def test_springs_orbits_and_pendulums_converge_to_their_closed_forms(document, config, order):
    """The error is the maximum over all frames: in a single frame errors of different sign may cancel."""
    scene, errors = from_document(document), []
    for dt in STEPS / 2.0:
        exact = solved_run(scene, scene.solver.replace(dt=float(dt)))
        result = config.run(scene, dt=float(dt))
        errors.append(np.hypot(*(result.position - exact.position)[:, 0].T).max())
    assert fitted_order(errors) == pytest.approx(order, abs=0.2)  # a fit over three halvings
