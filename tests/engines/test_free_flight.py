"""Free flight: closed forms to rounding, and bit-identical to pymunk."""

import math

import numpy as np
import pymunk
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.action import Force, Remove
from sandbox.engines.contract import Divergence
from sandbox.engines.pymunk_adapter import particles as free
from sandbox.engines.registry import start
from sandbox.scene.files.load import from_document
from tests.engines.stepping import advance

EPS = np.finfo(float).eps


def scene(balls: list[dict[str, object]], world: dict[str, object], **solver: object):
    return from_document({"world": world, "solver": solver, "ball": balls})


coordinates = st.floats(-1e6, 1e6)
speeds = st.floats(-1e4, 1e4)


@given(
    st.lists(st.tuples(coordinates, coordinates, speeds, speeds, st.floats(-50, 50)), min_size=1, max_size=5),
    st.tuples(st.floats(-100, 100), st.floats(-100, 100)),
    st.floats(1e-5, 0.5),
    st.integers(1, 4),
)
def test_flight_without_collisions_is_bit_identical_to_pymunk(states, gravity, dt, substeps):
    balls = [
        {"position": [x, y], "velocity": [vx, vy], "angular_velocity": w, "radius": 1.0, "collides": "none"}
        for x, y, vx, vy, w in states
    ]
    simulation = start(scene(balls, {"gravity": list(gravity)}, dt=dt, substeps=substeps))
    assert simulation.flying == len(states)

    space = pymunk.Space()
    space.gravity = gravity
    bodies = []
    for x, y, vx, vy, w in states:
        body = pymunk.Body(1.0, 0.5)
        body.position, body.velocity, body.angular_velocity = (x, y), (vx, vy), w
        space.add(body)
        bodies.append(body)

    for _ in range(20):
        simulation.step()
        for _ in range(substeps):
            space.step(dt / substeps)
    frame = simulation.frame()
    assert np.array_equal(frame.position, [tuple(body.position) for body in bodies])
    assert np.array_equal(frame.velocity, [tuple(body.velocity) for body in bodies])
    assert np.array_equal(frame.angle, [body.angle for body in bodies])
    assert np.array_equal(frame.angular_velocity, [body.angular_velocity for body in bodies])


@given(st.floats(1e-3, 0.1), st.integers(1, 200), st.tuples(st.floats(-20, 20), st.floats(-20, 20)))
def test_half_kick_is_exact_to_rounding(dt, steps, velocity):
    world = {"gravity": [1.5, -9.81]}
    ball = {"position": [3, 10], "velocity": list(velocity), "radius": 1}
    simulation = start(scene([ball], world, dt=dt, half_kick=True))
    assert np.array_equal(simulation.frame().velocity[0], velocity) or np.allclose(
        simulation.frame().velocity[0],
        velocity,
        rtol=0,
        atol=64 * EPS * (20 + 9.81 * dt),  # g·h/2 is added and subtracted again
    )
    advance(simulation, steps)
    time, frame = steps * dt, simulation.frame()
    g, v = np.asarray(world["gravity"]), np.asarray(velocity)
    scale = 10 + 20 * time + 9.81 * time**2
    # One or two roundings of the largest term each step.
    assert np.allclose(frame.position[0], [3, 10] + v * time + 0.5 * g * time**2, rtol=0, atol=4 * steps * EPS * scale)
    assert np.allclose(frame.velocity[0], v + g * time, rtol=0, atol=4 * steps * EPS * (20 + 9.81 * time))


@given(st.floats(0.01, 50), st.floats(1e-3, 0.5), st.tuples(st.floats(-20, 20), st.floats(-20, 20)))
def test_linear_drag_is_exact_in_velocity(k, dt, wind):
    world = {"gravity": [0, -9.81], "linear_drag": k, "wind": list(wind)}
    simulation = start(scene([{"position": [0, 0], "velocity": [30, 40], "radius": 1}], world, dt=dt))
    advance(simulation, 50)
    time = 50 * dt
    terminal = np.asarray(wind) + np.array([0, -9.81]) / k
    exact = terminal + (np.array([30, 40]) - terminal) * math.exp(-k * time)
    # Each of the 50 steps rounds sums as large as the largest velocity.
    scale = 60 + float(np.abs(terminal).max())
    assert np.allclose(simulation.frame().velocity[0], exact, rtol=0, atol=50 * 8 * EPS * scale)


@pytest.mark.parametrize("drag", [{"linear_drag": 1e9}, {"quadratic_drag": 1e9}, {"quadratic_drag": 3.0}])
def test_drag_of_any_strength_is_stable(drag):
    world = {"gravity": [0, -9.81], **drag}
    simulation = start(scene([{"position": [0, 0], "velocity": [1e3, 0], "radius": 1}], world, dt=10.0))
    fastest = 1e3
    for _ in range(100):
        simulation.step()
        speed = float(np.hypot(*simulation.frame().velocity[0]))
        # The speed decreases at most down to the terminal velocity.
        assert speed <= max(fastest, 9.81 / drag.get("linear_drag", 1e-9) + 2 * math.sqrt(9.81 / 1.0))
        fastest = max(speed, 1e-3)


SPARKS = {"position": [0.3, 0.7], "velocity_min": [-20, 10], "velocity_max": [20, 40], "radius": 0.05}
DRAGS = {
    "still": {},
    "linear": {"linear_drag": 0.3, "wind": [2.0, -1.0]},
    "quadratic": {"linear_drag": 0.1, "quadratic_drag": 0.02, "wind": [2.0, 0.5]},
    "damping": {"damping": 0.6},
}


def sparks(count: int, substeps: int, **more):
    """Return sparks of two masses, some of which spin, with one colliding body between them."""
    world = {"gravity": [0.2, -9.81], "seed": 5, **more}
    emitters = [
        {**SPARKS, "count": count, "mass": 0.37},
        {**SPARKS, "count": count, "mass": 3.3, "angular_velocity": 2.5},
        {**SPARKS, "count": 1, "radius": 1.0, "collides": "all"},
        {**SPARKS, "count": 7},
    ]
    return from_document({"world": world, "solver": {"dt": 0.01, "substeps": substeps}, "emitter": emitters})


def same_state(a, b):
    return all(
        np.array_equal(getattr(a, each), getattr(b, each))
        for each in ("position", "velocity", "angle", "angular_velocity", "present")
    )


@pytest.mark.parametrize("drag", DRAGS)
@pytest.mark.parametrize("substeps", [1, 2, 4, 7, 16])
def test_flight_of_a_whole_frame_equals_its_single_substeps(drag, substeps):
    """With an observer each substep runs for all bodies; without one all substeps run body by body."""
    sparks_scene = sparks(300, substeps, **DRAGS[drag])
    whole_frames, single_substeps, times = start(sparks_scene), start(sparks_scene), []
    single_substeps.watch(lambda time, before, after, pairs: times.append(time))
    for _ in range(9):
        whole_frames.step()
        single_substeps.step()
        assert same_state(whole_frames.frame(), single_substeps.frame())
    assert len(times) == 9 * substeps


@pytest.mark.fail_slow(60)  # takes over half a second
@pytest.mark.parametrize("drag", DRAGS)
@pytest.mark.parametrize("substeps", [1, 4, 6])
@pytest.mark.parametrize("count", [150, 20_000])
def test_compiled_and_numpy_flight_are_bit_identical(drag, substeps, count, monkeypatch):
    sparks_scene = sparks(count, substeps, **DRAGS[drag])
    compiled, plain = start(sparks_scene), start(sparks_scene)
    for _ in range(4):
        monkeypatch.setattr(free, "MIN_COMPILED", 200)
        compiled.step()
        monkeypatch.setattr(free, "MIN_COMPILED", 10**9)
        plain.step()
    assert same_state(compiled.frame(), plain.frame())


@pytest.mark.parametrize("drag", DRAGS)
@pytest.mark.parametrize("min_compiled", [0, 10**9])
def test_removed_particles_do_not_change_the_others(drag, min_compiled, monkeypatch):
    """Remaining particles fly as before, in contiguous runs or scattered; removed ones keep their position."""
    monkeypatch.setattr(free, "MIN_COMPILED", min_compiled)
    sparks_scene = sparks(150, 3, **DRAGS[drag])
    complete, reduced = start(sparks_scene), start(sparks_scene)
    removed: list[int] = []
    for k, indices in enumerate(([0, 1, 40], list(range(100, 200)), list(range(201, 300, 2)), [307], [300])):
        for index in indices:
            reduced.apply(Remove(time=0, body=sparks_scene.bodies.names[index]))
        removed += indices
        before = reduced.frame().position[removed]
        for _ in range(k + 1):
            complete.step()
            reduced.step()
        a, b = complete.frame(), reduced.frame()
        remaining = b.present
        assert np.flatnonzero(~remaining).tolist() == sorted(removed)
        assert np.array_equal(a.position[remaining], b.position[remaining])
        assert np.array_equal(a.velocity[remaining], b.velocity[remaining])
        assert np.array_equal(a.angle[remaining], b.angle[remaining])
        assert np.array_equal(before, b.position[removed])
        assert not b.velocity[removed].any()


@pytest.mark.parametrize("min_compiled", [0, 10**9])
def test_force_on_one_particle_moves_only_that_particle(min_compiled, monkeypatch):
    monkeypatch.setattr(free, "MIN_COMPILED", min_compiled)
    sparks_scene = sparks(150, 4)
    free_flight, pushed = start(sparks_scene), start(sparks_scene)
    pushed.apply(Force(time=0, body=sparks_scene.bodies.names[7], force=(3.7, 0.0), torque=0.01))
    for _ in range(10):
        free_flight.step()
        pushed.step()
    a, b = free_flight.frame(), pushed.frame()
    assert b.velocity[7, 0] - a.velocity[7, 0] == pytest.approx(1.0, rel=1e-12)  # 3.7 N · 0.1 s / 0.37 kg, rounding
    moment = float(sparks_scene.bodies.moment[7])
    assert b.angular_velocity[7] == pytest.approx(0.001 / moment, rel=1e-12)  # rounding of 40 sums
    others = np.arange(len(a.position)) != 7
    assert np.array_equal(a.position[others], b.position[others])
    assert np.array_equal(a.angle[others], b.angle[others])


@pytest.mark.parametrize("min_compiled", [0, 10**9])
def test_diverging_particle_is_named(min_compiled, monkeypatch):
    monkeypatch.setattr(free, "MIN_COMPILED", min_compiled)
    sparks_scene = sparks(150, 1, linear_drag=1e-9)
    simulation = start(sparks_scene)
    name = sparks_scene.bodies.names[123]
    simulation.apply(Force(time=0, body=name, force=(3e13, 0.0)))
    with pytest.raises(Divergence, match=name):
        advance(simulation, 100)
