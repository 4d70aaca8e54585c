"""Solid bodies and joints on pymunk: closed forms, momentum, attraction, thrust and engine switches."""

import math
from typing import Any

import numpy as np
import pytest

from sandbox.action import Impulse, Move, Remove, Spawn, Switch
from sandbox.engines.contract import Divergence
from sandbox.engines.registry import start
from sandbox.engines.switching import start as start_switchable
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.bodies import BallPart, Compound
from sandbox.scene.description.discs import Ball
from sandbox.scene.files.load import from_document
from tests.engines.stepping import advance

pytestmark = pytest.mark.fail_slow(60)  # long runs

G = 9.81
FLOOR = {"name": "floor", "point": [0, 0], "normal": [0, 1]}


def scene(dt: float = 1e-3, duration: float = 1.0, gravity: float = G, **document: Any) -> Scene:
    world = {"gravity": [0, -gravity], "duration": duration}
    return from_document({"world": world, "solver": {"dt": dt, "iterations": 30}, **document})


def test_compound_pendulum_has_the_closed_form_period() -> None:
    parts = [{"size": [0.1, 1.0]}, {"size": [0.5, 0.2], "position": [0, -0.5], "density": 3}]
    hammer = {"name": "hammer", "position": [0, 0], "density": 1, "box": parts, "angle": 0.0}
    document = {"body": [hammer], "joint": [{"kind": "pivot", "between": ["hammer"], "at": [0, 0.5]}]}
    pendulum = scene(dt=2.5e-4, duration=1.0, **document)
    bodies = pendulum.bodies
    masses = np.array([0.1, 0.3])
    centre = (masses @ [0.0, -0.5]) / 0.4
    inertia = 0.1 * (0.01 + 1) / 12 + 0.3 * (0.25 + 0.04) / 12 + 0.1 * centre**2 + 0.3 * (-0.5 - centre) ** 2
    assert bodies.mass[0] == pytest.approx(0.4, rel=1e-14)  # two sums of products
    assert bodies.moment[0] == pytest.approx(inertia, rel=1e-13)  # likewise, and the parallel-axis theorem
    assert bodies.position[0].tolist() == pytest.approx([0, centre], abs=1e-15)
    d = 0.5 - centre
    period = 2 * math.pi * math.sqrt((inertia + 0.4 * d * d) / (0.4 * G * d))
    simulation = start(pendulum)
    simulation.apply(Impulse(time=0, body="hammer", impulse=(1e-3, 0)))
    signs = np.sign([advance(simulation, 1).frame().angle[0] for _ in range(int(3 * period / 2.5e-4))])
    turns = np.flatnonzero(np.diff(signs) != 0) * 2.5e-4
    # a step of 2.5e-4 s in a half period of 0.7 s
    assert 2 * np.mean(np.diff(turns)) == pytest.approx(period, rel=2e-3)


def test_angular_impulse_spins_a_box_by_its_moment() -> None:
    box = {"name": "box", "position": [0, 0], "size": [2, 1], "mass": 3}
    simulation = start(scene(gravity=0, box=[box]))
    simulation.apply(Impulse(time=0, body="box", impulse=(0, 0), angular=2.0))
    assert advance(simulation, 1).frame().angular_velocity[0] == pytest.approx(2 / (3 * 5 / 12), rel=1e-14)


def two_boxes(**more: Any) -> list[dict[str, Any]]:
    return [
        {"name": "a", "position": [0, 0], "size": [1, 1], "mass": 2, **more},
        {"name": "b", "position": [3, 0], "size": [1, 1], "mass": 1},
    ]


def test_gravity_with_attraction_is_bit_identical_outside_and_inside_the_space() -> None:
    document = {
        "world": {"gravity": [0.3, -9.81], "linear_drag": 0.0},
        "solver": {"dt": 1e-3},
        "attraction": [{"toward": [0.1, 0.2], "strength": 1.7, "softening": 0.1}],
    }
    ball = {"name": "a", "position": [0.5, 0.1], "velocity": [0, 1.3], "radius": 0.01}
    distant = {"position": [5000, 0], "radius": 0.01, "fixed": True}
    outside = advance(start(from_document({**document, "ball": [{**ball, "collides": "none"}]})), 500).frame()
    inside = advance(start(from_document({**document, "ball": [ball, distant]})), 500).frame()
    assert outside.position[0].tobytes() == inside.position[0].tobytes()
    assert outside.velocity[0].tobytes() == inside.velocity[0].tobytes()


def test_jointed_bodies_without_collisions_move_as_those_with_shapes() -> None:
    """Shapes that touch nothing do not change the motion."""

    def final_hash(collides: str) -> str:
        boxes = [{**each, "collides": collides} for each in two_boxes(angular_velocity=1.0)]
        return advance(start(scene(box=boxes, joint=[{"kind": "rod", "between": ["a", "b"]}])), 200).state_hash()

    assert final_hash("all") == final_hash("none")


@pytest.mark.parametrize("seed", [0, 3])
@pytest.mark.parametrize("kind", ["box", "compound", "corner"])
def test_recorded_impulses_sum_to_the_momentum_change(kind: str, seed: int) -> None:
    random = np.random.default_rng(seed)
    bodies, sizes = [], random.uniform(0.3, 1, (20, 2)).tolist()
    for size in sizes:
        x, y, angle, speed = random.uniform([-3, 1, 0, -2], [3, 8, 6, 2]).tolist()
        state = {"position": [x, y], "angle": angle, "velocity": [speed, 0], "restitution": 0.5, "friction": 0.5}
        cross = {"box": [{"size": [0.8, 0.1]}, {"size": [0.1, 0.8]}], "ball": [{"radius": 0.15, "position": [0.4, 0]}]}
        bodies.append(state | {"box": {"size": size}, "compound": cross, "corner": {"radius": 0.3}}[kind])
    wall = {"points": [[-4, 3], [0, 0], [0.5, 0.3], [1, 0], [4, 3]], "restitution": 0.5, "friction": 0.6}
    table = {"box": "box", "compound": "body", "corner": "ball"}[kind]
    simulation = start(scene(dt=1 / 240, wall=[wall], **{table: bodies}))
    before = simulation.frame().velocity
    simulation.contacts()
    after = advance(simulation, 600).frame().velocity
    contacts, mass = simulation.contacts(), simulation.bodies.mass[:, None]
    gained = np.zeros_like(after)
    for side, sign in ((0, -1), (1, 1)):
        moved = contacts.pair[:, side] >= 0
        np.add.at(gained, contacts.pair[moved, side], sign * contacts.impulse[moved])
    expected = mass * (after - before - np.array([0, -G]) * simulation.time)
    assert len(contacts.time) > 100
    assert np.abs(gained - expected).max() < 1e-10  # rounding of some thousands of sums of about 50 N·s


def test_jointed_body_collides_with_a_spawned_ball() -> None:
    ball = {"name": "held", "position": [0, 0], "radius": 0.5}
    simulation = start(scene(gravity=0, ball=[ball], joint=[{"kind": "spring", "between": ["held"], "stiffness": 1}]))
    advance(simulation, 5)
    simulation.apply(Spawn(time=0, ball=Ball(position=(-2.0, 0.0), radius=0.5, velocity=(10.0, 0.0))))
    simulation.contacts()
    advance(simulation, 300)
    assert (0, 1) in [event.pair for event in simulation.contacts()]
    assert simulation.frame().velocity[0, 0] > 4  # half of 10 m/s at e = 0; the spring is too weak to matter


def test_contact_of_a_spawned_compound_is_recorded_once() -> None:
    simulation = start(scene(plane=[FLOOR], ball=[{"position": [0, 0.5], "radius": 0.5}]))
    simulation.contacts()
    parts = (BallPart(radius=0.1, position=(-0.3, 0.0)), BallPart(radius=0.1, position=(0.3, 0.0)))
    simulation.apply(Spawn(time=0, body=Compound(position=(5.0, 0.2), balls=parts)))
    advance(simulation, 400)
    pairs = [event.pair for event in simulation.contacts()]
    assert pairs.count((1, -1)) == 1  # both parts land at once: one contact


def jointed_scene() -> Scene:
    boxes = [
        {"name": "base", "position": [0, 3], "size": [0.6, 0.4], "friction": 0.4},
        {"name": "arm", "position": [0.8, 3], "size": [1.0, 0.2], "friction": 0.4},
        {"name": "crate", "position": [3, 0.5], "size": [1, 1], "friction": 0.4},
    ]
    joint = [
        {"name": "hinge", "kind": "pivot", "between": ["base", "arm"], "at": [0.3, 3]},
        {"name": "hook", "kind": "rod", "between": ["base"], "anchors": [[0, 0], [0, 5]]},
    ]
    return scene(dt=1 / 960, plane=[{**FLOOR, "friction": 1}], box=boxes, joint=joint)


def test_removal_of_a_jointed_body_frees_the_other_across_an_engine_switch() -> None:
    simulation = start_switchable(jointed_scene(), "pymunk")
    advance(simulation, 50)
    simulation.apply(Remove(time=simulation.time, body="base"))
    simulation.apply(Switch(time=simulation.time, engine="reference"))
    speed = simulation.frame().velocity[1, 1]
    advance(simulation, 96)
    assert simulation.frame().velocity[1, 1] == pytest.approx(speed - G * 0.1, rel=1e-9)  # free fall


def test_jointed_body_moved_far_away_stays_finite_or_diverges() -> None:
    simulation = start(scene(box=two_boxes(), joint=[{"kind": "rod", "between": ["a", "b"]}]))
    simulation.apply(Move(time=0, body="b", position=(1e9, 0.0)))
    try:
        advance(simulation, 100)
    except Divergence as divergence:
        assert str(divergence)
    assert np.isfinite(simulation.frame().position).all()
