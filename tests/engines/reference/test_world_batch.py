"""Many worlds in one compiled call: each does what a simulation of its own does, bit for bit."""

import numpy as np
import pytest

from sandbox.action import Move, Throttle
from sandbox.engines.contract import Divergence, HasWorldBatch, Members, WorldBatch
from sandbox.engines.registry import start
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import loads
from tests.engines.stepping import advance

pytestmark = pytest.mark.fail_slow(60)  # compiles kernels of many worlds

SHIPS = """
title = "Two ships that pass through each other, above a wall and a plane"
[world]
gravity = [0.0, -2.0]
damping = {damping}
duration = 10.0
bounds = [[-8.0, -5.0], [8.0, 9.0]]
[solver]
dt = 0.02
substeps = 2
{solver}
[[plane]]
point = [0.0, 0.0]
normal = [0.1, 1.0]
[[wall]]
points = [[-4.0, 3.0], [-1.0, 1.0], [3.0, 1.5]]
thickness = 0.2
restitution = 0.5
[[box]]
name = "ship"
position = [0.0, 5.0]
size = [1.0, 0.5]
mass = 1.0
collides = "fixed"
[[body]]
name = "other"
position = [2.0, 4.0]
mass = 2.0
collides = "fixed"
[[body.polygon]]
points = [[-0.5, -0.3], [0.5, -0.3], [0.0, 0.6]]
[[body.capsule]]
position = [0.0, -0.5]
length = 0.8
radius = 0.1
[[thrust]]
body = "other"
force = [0.0, 1.0]
[[thrust]]
name = "engine"
body = "ship"
force = [0.0, 4.0]
key = "up"
[[thrust]]
name = "jet"
body = "ship"
force = [1.0, 0.0]
point = [0.0, 0.2]
begin = 0.1
key = "left"
"""
NAMES = "ship", "other"


def ships(solver: str = "", damping: float = 1.0) -> Scene:
    return loads(SHIPS.format(solver=solver, damping=damping))


def batch_of(scene: Scene, count: int) -> WorldBatch:
    simulation = start(scene, "reference")
    assert isinstance(simulation, HasWorldBatch)
    batch = simulation.world_batch(count)
    assert batch is not None
    return batch


def random_starts(scene: Scene, count: int, rng: np.random.Generator) -> Members:
    bodies = scene.bodies
    position = bodies.position + rng.uniform(-1.5, 1.5, (count, 2, 2))
    velocity = rng.uniform(-3.0, 3.0, (count, 2, 2))
    return Members(position, velocity, np.tile(bodies.angle, (count, 1)), np.zeros((count, 2)))


def numbers_of(pairs: np.ndarray, body: int, count: int) -> set[int]:
    others = [int(b if a == body else a) for a, b in pairs.tolist() if body in (a, b)]
    return {other if other >= 0 else count - 1 - other for other in others}


@pytest.mark.parametrize(
    ("solver", "damping"),
    [("", 1.0), ('integrator = "leapfrog"', 1.0), ('integrator = "rk4"', 1.0), ('integrator = "leapfrog"', 0.9)],
)
def test_worlds_do_what_simulations_do(solver: str, damping: float) -> None:
    scene, count, rng = ships(solver, damping), 6, np.random.default_rng(7)
    batch, starts = batch_of(scene, count), random_starts(ships(), count, rng)
    batch.restart(np.arange(count), starts)
    simulations = [start(scene, "reference") for _ in range(count)]
    for m, simulation in enumerate(simulations):
        simulation.contacts()
        for k, name in enumerate(NAMES):
            position, velocity = (tuple(array[m, k].tolist()) for array in (starts.position, starts.velocity))
            simulation.apply(Move(time=0.0, body=name, position=position, velocity=velocity))
    running, touches, removals = set(range(count)), 0, 0
    for _ in range(60):
        for m in running:
            levels = rng.random(2).round(2)
            batch.thrust_level[m, 1:] = levels
            for name, level in zip(("engine", "jet"), levels.tolist(), strict=True):
                simulations[m].apply(Throttle(time=0.0, thrust=name, level=level))
        wanted = np.asarray([int(rng.integers(1, 6)) if m in running else 0 for m in range(count)])
        made = batch.advance(wanted)
        states = batch.states
        for m in list(running):
            simulation, end = simulations[m], 0
            assert 1 <= made[m] <= wanted[m]
            while end < made[m]:
                before = simulation.frame()
                simulation.step()
                contacts, end = simulation.contacts(), end + 1
                assert not len(contacts) or end == made[m]  # a step with a contact is the last one
            frame = simulation.frame()
            assert (states.previous_time[m], states.time[m]) == (before.time, frame.time)
            for name in Members._fields:
                assert getattr(states.now, name)[m].tobytes() == getattr(frame, name).tobytes()
                assert getattr(states.previous, name)[m].tobytes() == getattr(before, name).tobytes()
            assert states.present[m].tolist() == frame.present.tolist()
            for k in range(2):
                assert set(np.flatnonzero(states.touched[m, k]).tolist()) == numbers_of(contacts.pair, k, 2)
            touches += len(contacts)
            if not frame.present.all():
                removals += 1
                running.discard(m)
    assert touches > 20  # ships bounce and come to rest
    assert removals > 0


def test_diverged_world_says_so_and_needs_a_restart() -> None:
    text = SHIPS.format(solver="", damping=1.0)
    scene = loads(text.replace("bounds =", "# ").replace("force = [0.0, 4.0]", "force = [0.0, 1e30]"))
    batch, simulation = batch_of(scene, 2), start(scene, "reference")
    bodies = scene.bodies
    columns = bodies.position, bodies.velocity, bodies.angle, bodies.angular_velocity
    batch.restart(np.arange(2), Members(*(np.repeat(array[None], 2, axis=0) for array in columns)))
    batch.thrust_level[0, 1] = 1.0
    simulation.apply(Throttle(time=0.0, thrust="engine", level=1.0))
    with pytest.raises(Divergence) as error:
        advance(simulation, 10)
    made = batch.advance(np.asarray([10, 3]))
    assert batch.states.diverged.tolist() == [True, False]
    assert made.tolist() == [round(simulation.time / 0.02), 3]
    assert str(batch.divergence(0)) == str(error.value)
    with pytest.raises(ValueError, match="restart"):
        batch.advance(np.asarray([1, 1]))
    batch.restart(np.asarray([0]), Members(*(array[None] for array in columns)))
    assert batch.advance(np.asarray([2, 0])).tolist() == [2, 0]
    assert batch.states.time.tolist() == [0.04, 0.06]


@pytest.mark.parametrize(
    "change",
    [
        ('collides = "fixed"', 'collides = "all"'),  # the ships can touch each other
        ("[world]", '[[joint]]\nkind = "rod"\nbetween = ["ship", "other"]\n[world]'),
        ("[[box]]", "[[zone]]\nposition = [0.0, 4.0]\nradius = 1.0\n[[box]]"),
    ],
)
def test_scene_with_more_than_static_contacts_has_no_batch(change: tuple[str, str]) -> None:
    simulation = start(loads(SHIPS.format(solver="", damping=1.0).replace(*change)), "reference")
    assert isinstance(simulation, HasWorldBatch)
    assert simulation.world_batch(2) is None
