"""Contact impulses equal the momentum change of each body to rounding, also if bodies separate and collide again.

pymunk remembers separated shapes for some substeps, and its impulse after a new contact counts the remembered impulse
twice. In settling piles this happens thousands of times.
"""

import numpy as np
import pytest

from sandbox.action import Action, Move, Remove, Reshape, Spawn, Toggle
from sandbox.engines.switching import start
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.bodies import Box
from sandbox.scene.description.discs import Ball
from sandbox.scene.files.load import load
from sandbox.scene.files.shipped_scenes import find
from sandbox.trajectory import Contacts
from tests.engines.builders import make_scene
from tests.engines.stepping import advance

pytestmark = pytest.mark.fail_slow(60)  # long runs and sweeps

GRAVITY = np.array([0.0, -9.81])

TOLERANCE = 1e-10
"""N·s: a thousand times the rounding of about 1e5 additions of terms of 1e-2 N·s to a sum of at most 10."""


def floor_scene(persistence: int) -> Scene:
    """Return balls that fall on a shelf and on the floor below it."""
    rough = {"restitution": 0.5, "friction": 0.5}
    floor = {"name": "floor", "points": [[-3.0, 0.0], [3.0, 0.0]], "thickness": 0.1, **rough}
    shelf = {"name": "shelf", "points": [[-0.5, 0.6], [0.5, 0.7]], "thickness": 0.02, **rough}
    balls = {"name": "ball", "lower": [-0.7, 0.8], "upper": [0.7, 2.4], "count": 30, "radius": 0.07}
    return make_scene(
        world={"gravity": [0.0, -9.81], "duration": 3.0},
        solver={"dt": 0.005, "persistence": persistence},
        wall=[floor, shelf],
        scatter=[{**balls, "restitution": 0.8, "friction": 0.6}],
    )


def pile(persistence: int) -> Scene:
    return load(find("pile"), ["grid.ball.rows=8", "grid.ball.columns=10", f"solver.persistence={persistence}"])


def momentum_error(scene: Scene, settle: int, steps: int, actions: dict[int, Action]) -> tuple[float, Contacts]:
    """Return the largest difference of momentum change and impulses, N·s, of bodies present all the time, and contacts.

    Args:
        scene: scene to run.
        settle: steps before contacts are first queried.
        steps: steps after that.
        actions: actions by the step before which they apply.
    """
    simulation = start(scene, "pymunk")
    advance(simulation, settle)
    simulation.contacts()
    initial = simulation.frame()
    batches = []
    for k in range(steps):
        if k in actions:
            simulation.apply(actions[k])
        simulation.step()
        if k % 50 == 0:
            batches.append(simulation.contacts())
    contacts, final = Contacts.joined([*batches, simulation.contacts()]), simulation.frame()
    bodies, count = simulation.bodies, len(initial.position)
    momentum = bodies.mass[:, None] * (final.time - initial.time) * GRAVITY
    for (first, second), impulse in zip(contacts.pair.tolist(), contacts.impulse, strict=True):
        momentum[first] -= impulse
        if second >= 0:
            momentum[second] += impulse
    gained = bodies.mass[:count, None] * (final.velocity[:count] - initial.velocity)
    present = final.present[:count] & ~bodies.fixed[:count]
    return float(np.abs(gained - momentum[:count])[present].max()), contacts


@pytest.mark.parametrize(("persistence", "settle"), [(1, 0), (3, 150), (10, 0)])
def test_impulses_on_each_ball_of_a_pile_balance_its_momentum(persistence: int, settle: int) -> None:
    error, contacts = momentum_error(pile(persistence), settle, 360, {})
    assert error < TOLERANCE
    ball_pairs = contacts.pair[contacts.pair[:, 1] >= 0]
    assert len(ball_pairs) > len(np.unique(ball_pairs, axis=0)) > 100  # some pairs collided again


@pytest.mark.parametrize(
    "actions",
    [
        {},
        {150: Remove(time=0.0, body="ball-3")},
        {
            150: Move(time=0.0, body="ball-4", position=(2.0, 1.0)),
            170: Move(time=0.0, body="ball-4", position=(0.0, 2.0)),
        },
        {150: Spawn(time=0.0, ball=Ball(name="new", position=(0.0, 2.5), radius=0.1, restitution=0.9))},
        {150: Spawn(time=0.0, box=Box(name="new", position=(0.0, 2.5), size=(0.3, 0.2)))},
        {150: Toggle(time=0.0, thing="shelf", solid=False), 158: Toggle(time=0.0, thing="shelf", solid=True)},
        {150: Reshape(time=0.0, thing="shelf", points=((-0.5, 0.601), (0.5, 0.7)))},
        {150: Reshape(time=0.0, thing="shelf", points=((-0.5, 0.6), (0.0, 0.6), (0.5, 0.7)))},
    ],
    ids=["none", "remove", "move", "ball", "box", "toggle", "reshape", "corner"],
)
@pytest.mark.parametrize("persistence", [3, 20])
def test_impulses_balance_momentum_during_actions(actions: dict[int, Action], persistence: int) -> None:
    error, contacts = momentum_error(floor_scene(persistence), 0, 600, actions)
    assert error < TOLERANCE
    assert len(contacts) > 300
