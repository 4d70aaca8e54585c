"""Pymunk and the reference agree on zones, layers and gates; each has its own point-in-zone test."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import sandbox
from sandbox.action import Impulse, Switch
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.fixed import HELD
from sandbox.scene.files.load import from_document
from tests.engines.builders import make_scene
from tests.engines.stepping import advance

pytestmark = pytest.mark.fail_slow(60)  # property tests with many examples

H = 0.002
"""Substep, s."""

ROUNDING = 1e-12
"""m, m/s, s. With explicit_euler, discrete and impulse the reference computes the same as pymunk with another order of
sums: 4,000 substeps with coordinates of some metres, 2e-16 of them each, add up to less than this even if all round to
the same side. Flat walls do not amplify differences, and no path here is so near to an edge that rounding decides."""


def course(velocity: tuple[float, float] = (1.0, 0.0), **more: Any) -> Scene:
    """Return a course for one ball: a ramp over a fence with a gravity zone on it, a gate, an end wall and a hole.

    The ball passes the gate, returns from the end wall, rebounds from the gate and is held in the hole.
    """
    return make_scene(
        world={"duration": 8.0, **more},
        solver={"dt": 5 * H, "substeps": 5},
        ball=[{"name": "ball", "position": [0, 0], "velocity": velocity, "radius": 0.05, "restitution": 0.9}],
        wall=[
            {"name": "fence", "points": [[1, -1], [1, 1]]},
            {"name": "gate", "points": [[2.2, 1], [2.2, -1]], "one_way": True},
            {"name": "end", "points": [[3, -1], [3, 1]]},
            {"name": "rails", "points": [[-0.5, -1], [4, -1], [4, 1], [-0.5, 1]], "layers": ["ground", "ramp"]},
        ],
        zone=[
            {"name": "mouth", "points": [[0.5, -1], [0.5, 1]], "thickness": 0.1, "to_layer": "ramp"},
            {
                "name": "slope",
                "points": [[1.2, -1], [1.6, -1], [1.6, 1], [1.2, 1]],
                "layers": ["ramp"],
                "gravity": [-0.5, 0.3],
            },
            {
                "name": "foot",
                "points": [[1.8, -1], [1.8, 1]],
                "thickness": 0.1,
                "layers": ["ramp"],
                "to_layer": "ground",
            },
            {"name": "hole", "position": [2.7, 0.49], "radius": 0.05, "holds": True},
        ],
    )


def assert_runs_agree(one: sandbox.Trajectory, other: sandbox.Trajectory) -> None:
    assert one.status == other.status == "ok"
    assert one.contact_pair.tolist() == other.contact_pair.tolist()
    assert np.array_equal(one.layer, other.layer)
    for key in ("position", "velocity", "contact_time", "contact_point", "contact_normal", "contact_impulse"):
        np.testing.assert_allclose(getattr(one, key), getattr(other, key), rtol=0, atol=ROUNDING, err_msg=key)


def test_engines_agree_on_the_whole_course() -> None:
    scene = course()
    runs = [sandbox.run(scene, engine) for engine in ("pymunk", "reference")]
    assert_runs_agree(*runs)
    assert np.array_equal(*(run.contact_time for run in runs))  # both count k·h
    sequence = [scene.fixed_names[-1 - other] for other in runs[0].contact_pair[:, 1].tolist()]
    assert sequence == ["mouth", "slope", "foot", "end", "gate", "hole"]
    assert runs[1].position[-1].tolist() == [[2.7, 0.49]]
    assert [run.missed_contacts for run in runs] == [0, 0]


@given(st.floats(0.6, 3.0), st.floats(-1.0, 1.0), st.floats(-0.5, 0.5))
@settings(max_examples=15)
def test_engines_agree_on_courses_with_random_velocity_and_gravity(along: float, across: float, gravity: float) -> None:
    scene = course((along, across), duration=4.0, gravity=[gravity, 0.1])
    assert_runs_agree(*(sandbox.run(scene, engine, audit=False) for engine in ("pymunk", "reference")))


@given(st.integers(0, 1_000_000))
def test_engines_agree_on_straight_gates(seed: int) -> None:
    """A ball flies along a random curve to a gate; exactly on the line of a gate rounding would decide.

    At a sharp bend the engines may differ: pymunk uses the segment that is touched first, the reference the nearest.
    """
    random = np.random.default_rng(seed)
    angle, speed = random.uniform(0.0, 6.28), random.uniform(0.3, 8.0)
    along = np.asarray((np.cos(angle), np.sin(angle)))
    ball = {"position": (random.uniform(-0.5, 0.5, 2) - 2.0 * along).tolist(), "velocity": (speed * along).tolist()}
    gate = {"points": random.uniform(-0.8, 0.8, (2, 2)).tolist(), "thickness": 0.02}
    world = {"duration": 4.0 / speed, "gravity": (random.uniform(-0.2, 0.2, 2) * speed**2).tolist()}
    scene = make_scene(
        world=world,
        solver={"dt": 0.02 / speed},
        ball=[{**ball, "radius": 0.1, "restitution": 0.8}],
        wall=[{**gate, "one_way": True}],
    )
    one, other = (sandbox.run(scene, engine, audit=False) for engine in ("pymunk", "reference"))
    # At an end, rounding is amplified by 2·path/radius, at most 20 a rebound: four rebounds turn 1e-16 into this.
    assert np.abs(one.position - other.position).max() < 1e-9


@pytest.mark.parametrize("first", ["pymunk", "reference"])
def test_engine_switches_during_the_course_do_not_change_it(first: str) -> None:
    """Switches on the ramp, in the gravity zone, halfway through the gate, in the hole, and just after release."""
    scene, second = course(), {"pymunk": "reference", "reference": "pymunk"}[first]
    release = Impulse(time=6.0, body="ball", impulse=(-0.8, 0.1))
    times = (0.8, 1.4, 2.41, 2.45, 4.41, 5.5, 6.01)
    switches = [Switch(time=t, engine=second if k % 2 == 0 else first) for k, t in enumerate(times)]
    plain = sandbox.run(scene, first, actions=[release], audit=False)
    switched = sandbox.run(scene, first, actions=[*switches, release], audit=False)
    # Impulses remembered by contacts are not transferred; no contact here lasts, so nothing is lost.
    assert_runs_agree(plain, switched)
    simulation = sandbox.start(scene, first)
    while simulation.time < 5.5 - 1e-9:
        simulation.step()
    simulation.apply(Switch(time=0.0, engine=second))
    simulation.step()
    frame = simulation.frame()
    assert frame.visits is not None and frame.visits[0, 3] == HELD
    assert frame.position.tolist() == [[2.7, 0.49]]


@pytest.mark.parametrize("first", ["pymunk", "reference"])
def test_engine_switch_keeps_a_passing_ball_and_a_ball_resting_on_the_gate(first: str) -> None:
    """One ball has turned round inside the gate with its centre on the left side; the other rests on the left side."""
    second = {"pymunk": "reference", "reference": "pymunk"}[first]
    balls = [
        {"position": [-0.5, 0.1], "velocity": [0.0, 0.0], "radius": 0.1},
        {"position": [0.5, -0.5], "velocity": [0.0, 2.0 * np.sqrt(0.54)], "radius": 0.1},  # reaches y = 0.04
    ]
    gate = {"points": [[-1, 0], [1, 0]], "one_way": True, "thickness": 0.0001}
    document = {
        "world": {"gravity": [0.0, -2.0]},
        "solver": {"dt": 5 * H, "substeps": 5},
        "ball": balls,
        "wall": [gate],
    }
    simulation = sandbox.start(from_document(document), first)
    while simulation.frame().velocity[1, 1] >= 0.0:
        simulation.step()
    before = simulation.frame()
    assert before.position[1, 1] > 0.0
    assert before.passing is not None and before.passing.tolist() == [[1, -1]]
    simulation.apply(Switch(time=0.0, engine=second))
    after = simulation.frame()
    assert after.passing is not None and after.passing.tolist() == [[1, -1]]
    advance(simulation, 60)
    y = simulation.frame().position[:, 1]
    assert y[0] == pytest.approx(0.1, abs=2e-3)  # pymunk's slop
    assert y[1] == pytest.approx(before.position[1, 1] - 0.5 * 2.0 * 0.6**2, abs=0.02)  # free fall, from near rest
    assert simulation.frame().passing is None
