"""Both engines that know zones, layers and gates agree: the reference finds who is where by outlines of its own."""

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

pytestmark = pytest.mark.full  # property tests with many examples

H = 0.002
"""s, the substep"""

ROUNDING = 1e-12
"""m, m/s, s. As explicit_euler, discrete and impulse the reference does what pymunk does, in another order of the sums:
4,000 substeps of some meters, 2e-16 of them each, add up to less than this even if all round to the same side. Flat
walls do not let differences grow, and none here comes so near to an edge that rounding decides on which side it is."""


def course(velocity: tuple[float, float] = (1.0, 0.0), **more: Any) -> Scene:
    """Return a ball that takes a ramp over a fence, is drawn aside on it, and comes down before a gate.

    It passes the gate, comes back from the end to it, rebounds there, and falls into a hole.
    """
    return from_document(
        {
            "world": {"duration": 8.0, **more},
            "solver": {"dt": 5 * H, "substeps": 5},
            "ball": [{"name": "ball", "position": [0, 0], "velocity": velocity, "radius": 0.05, "restitution": 0.9}],
            "wall": [
                {"name": "fence", "points": [[1, -1], [1, 1]]},
                {"name": "gate", "points": [[2.2, 1], [2.2, -1]], "one_way": True},
                {"name": "end", "points": [[3, -1], [3, 1]]},
                {"name": "rails", "points": [[-0.5, -1], [4, -1], [4, 1], [-0.5, 1]], "layers": ["ground", "ramp"]},
            ],
            "zone": [
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
        }
    )


def agree(one: sandbox.Trajectory, other: sandbox.Trajectory) -> None:
    assert one.status == other.status == "ok"
    assert one.contact_pair.tolist() == other.contact_pair.tolist()
    assert np.array_equal(one.layer, other.layer)
    for key in ("position", "velocity", "contact_time", "contact_point", "contact_normal", "contact_impulse"):
        np.testing.assert_allclose(getattr(one, key), getattr(other, key), rtol=0, atol=ROUNDING, err_msg=key)


def test_course_over_a_ramp_through_a_gate_into_a_hole_is_the_same() -> None:
    scene = course()
    runs = [sandbox.run(scene, engine) for engine in ("pymunk", "reference")]
    agree(*runs)
    assert np.array_equal(*(run.contact_time for run in runs))  # k·h, counted alike
    noted = [scene.fixed_names[-1 - other] for other in runs[0].contact_pair[:, 1].tolist()]
    assert noted == ["mouth", "slope", "foot", "end", "gate", "hole"]
    assert runs[1].position[-1].tolist() == [[2.7, 0.49]]
    assert [run.missed_contacts for run in runs] == [0, 0]


@given(st.floats(0.6, 3.0), st.floats(-1.0, 1.0), st.floats(-0.5, 0.5))
@settings(max_examples=15, deadline=None)
def test_courses_are_the_same_from_wherever_they_start(along: float, across: float, gravity: float) -> None:
    scene = course((along, across), duration=4.0, gravity=[gravity, 0.1])
    agree(*(sandbox.run(scene, engine, audit=False) for engine in ("pymunk", "reference")))


@given(st.integers(0, 1_000_000))
@settings(max_examples=25, deadline=None)
def test_straight_gates_are_passed_or_not_alike(seed: int) -> None:
    """A ball flies a curve to a gate. Drawn by chance: on the very line of a gate rounding would decide.

    At a sharp bend the two may differ: pymunk asks of the segment that is touched first, the reference of the nearest.
    """
    chance = np.random.default_rng(seed)
    angle, speed = chance.uniform(0.0, 6.28), chance.uniform(0.3, 8.0)
    along = np.asarray((np.cos(angle), np.sin(angle)))
    ball = {"position": (chance.uniform(-0.5, 0.5, 2) - 2.0 * along).tolist(), "velocity": (speed * along).tolist()}
    gate = {"points": chance.uniform(-0.8, 0.8, (2, 2)).tolist(), "thickness": 0.02}
    world = {"duration": 4.0 / speed, "gravity": (chance.uniform(-0.2, 0.2, 2) * speed**2).tolist()}
    scene = from_document(
        {
            "world": world,
            "solver": {"dt": 0.02 / speed},
            "ball": [{**ball, "radius": 0.1, "restitution": 0.8}],
            "wall": [{**gate, "one_way": True}],
        }
    )
    one, other = (sandbox.run(scene, engine, audit=False) for engine in ("pymunk", "reference"))
    # At an end rounding grows by 2·way/radius, 20 at most, and each rebound takes it some way: four make 1e-16 this.
    assert np.abs(one.position - other.position).max() < 1e-9


@pytest.mark.parametrize("first", ["pymunk", "reference"])
def test_engines_hand_over_on_the_ramp_in_the_gate_and_in_the_hole(first: str) -> None:
    """On the ramp, on the slope, halfway through the gate, in the hole, and let go but not yet out of it."""
    scene, second = course(), {"pymunk": "reference", "reference": "pymunk"}[first]
    free = Impulse(time=6.0, body="ball", impulse=(-0.8, 0.1))
    times = (0.8, 1.4, 2.41, 2.45, 4.41, 5.5, 6.01)
    switches = [Switch(time=t, engine=second if k % 2 == 0 else first) for k, t in enumerate(times)]
    plain = sandbox.run(scene, first, actions=[free], audit=False)
    switched = sandbox.run(scene, first, actions=[*switches, free], audit=False)
    # Impulses that contacts remember are not handed over; none here lasts, so that nothing is lost.
    agree(plain, switched)
    relay = sandbox.start(scene, first)
    while relay.time < 5.5 - 1e-9:
        relay.step()
    relay.apply(Switch(time=0.0, engine=second))
    relay.step()
    frame = relay.frame()
    assert frame.visits is not None and frame.visits[0, 3] == HELD
    assert frame.position.tolist() == [[2.7, 0.49]]


@pytest.mark.parametrize("first", ["pymunk", "reference"])
def test_who_passes_a_gate_is_handed_over_and_who_lies_on_one_stays(first: str) -> None:
    """One has turned round within, its centre on the left already; the other rests on the left, at no speed."""
    second = {"pymunk": "reference", "reference": "pymunk"}[first]
    balls = [
        {"position": [-0.5, 0.1], "velocity": [0.0, 0.0], "radius": 0.1},
        {"position": [0.5, -0.5], "velocity": [0.0, 2.0 * np.sqrt(0.54)], "radius": 0.1},  # it comes to y = 0.04
    ]
    gate = {"points": [[-1, 0], [1, 0]], "one_way": True, "thickness": 0.0001}
    document = {
        "world": {"gravity": [0.0, -2.0]},
        "solver": {"dt": 5 * H, "substeps": 5},
        "ball": balls,
        "wall": [gate],
    }
    relay = sandbox.start(from_document(document), first)
    while relay.frame().velocity[1, 1] >= 0.0:
        relay.step()
    before = relay.frame()
    assert before.position[1, 1] > 0.0
    assert before.passing is not None and before.passing.tolist() == [[1, -1]]
    relay.apply(Switch(time=0.0, engine=second))
    after = relay.frame()
    assert after.passing is not None and after.passing.tolist() == [[1, -1]]
    for _ in range(60):
        relay.step()
    y = relay.frame().position[:, 1]
    assert y[0] == pytest.approx(0.1, abs=2e-3)  # pymunk's slop
    assert y[1] == pytest.approx(before.position[1, 1] - 0.5 * 2.0 * 0.6**2, abs=0.02)  # free fall, from near rest
    assert relay.frame().passing is None


def test_recording_of_the_reference_goes_again_to_the_same_hash() -> None:
    scene = course()
    free = Impulse(time=6.0, body="ball", impulse=(-0.8, 0.1))
    hashes = {sandbox.run(scene, "reference", actions=[free]).info["state_hash"] for _ in range(2)}
    assert len(hashes) == 1
