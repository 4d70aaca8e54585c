"""Tables with invalid requests, far positions, many threads and balls in pockets."""

import math
import pickle
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from sandbox.action import Action, ActionError, Impulse, Move, SetParameter, Spawn, Strike
from sandbox.engines.exact.tabletop.shots import BATCH, Table
from sandbox.engines.switching import start
from sandbox.measure.run.runner import run
from sandbox.scene.description.discs import Ball
from sandbox.scene.description.surface import Stroke
from sandbox.scene.files.load import from_document, loads
from tests.engines.exact.tabletop.small_tables import R, ball, table

pytestmark = pytest.mark.fail_slow(60)  # property tests with many examples

HOLE = {"name": "hole", "position": [0.5, 1.5], "radius": 0.06}
UPWARDS = Stroke(aim=0.5 * math.pi, speed=1.0)


def table_with_pocket() -> Table:
    balls = ball("cue", 0.5, 1.0), ball("a", 0.8, 1.4), ball("post", 0.2, 0.3, fixed=True)
    return Table(table(*balls, pocket=[HOLE]))


@pytest.mark.parametrize(
    ("play", "reason"),
    [
        (lambda t: t.with_balls({"cue": (0.5, 1.5)}).shoot(UPWARDS), "is in a pocket"),
        (lambda t: t.with_balls({"cue": (0.5, 1.5)}).fan([UPWARDS]), "is in a pocket"),
        (lambda t: t.shoot(UPWARDS, "post"), "is fixed"),
        (lambda t: t.shoot(UPWARDS, until=-1.0), "until -1 s"),
        (lambda t: t.fan([UPWARDS], until=math.nan), "until nan s"),
        (lambda t: t.send((math.nan, 0.0), (0.0, 0.0, 0.0)), "not a velocity and a spin"),
        (lambda t: t.fan_of(np.ones((2, 3))), "five finite numbers in each row"),
        (lambda t: t.fan_of(np.full((1, 5), math.inf)), "five finite numbers in each row"),
        (lambda t: t.with_balls({"a": (math.nan, 0.0)}), "finite"),
        (lambda t: t.with_balls({"a": (0.5, 1.01)}), "'cue' and 'a' overlap"),
        (lambda t: t.with_balls({"a": (0.0, 1.0)}), "'a' and 'rail' overlap"),
        (lambda t: t.after(Table(table(ball("other", 0.5, 1.0))).shoot()), "other balls"),
        (lambda t: t.shoot(UPWARDS, record_paths=True).path_of("cue", 0.0), "spacing"),
    ],
)
def test_invalid_shot_is_refused(play: Callable[[Table], object], reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        play(table_with_pocket())


def test_unknown_ball_is_refused_by_name() -> None:
    unknown: list[Callable[[Table], object]] = [
        lambda t: t.shoot(UPWARDS, "nobody"),
        lambda t: t.fan([UPWARDS], "nobody"),
        lambda t: t.with_balls({"nobody": (0.5, 0.5)}),
        lambda t: t.shoot(UPWARDS, record_paths=True).path_of("nobody"),
    ]
    for play in unknown:
        with pytest.raises(KeyError, match="nobody"):
            play(table_with_pocket())


def test_balls_without_friction_end_at_the_same_time() -> None:
    floor = {"sliding_friction": 0.0, "rolling_friction": 0.0, "spinning_friction": 0.0}
    scene = table(ball("cue", 0.0, 0.0), ball("a", 0.5, 0.0), cushions=False, e=0.9, surface=floor)
    outcome = Table(scene).send((1.0, 0.0), (0.0, 0.0, 0.0), until=math.inf)
    assert not outcome.complete
    assert outcome.state[:, 0].tolist() == [outcome.duration] * 2
    # m: rounding of a square root
    assert Table(scene).after(outcome).position[0, 0] == pytest.approx(0.5 - 2.0 * R, abs=1e-12)


def test_fan_does_not_depend_on_batches_and_threads() -> None:
    played_table = table_with_pocket()
    strokes = [Stroke(aim=aim, speed=2.0) for aim in np.linspace(0.0, 6.0, BATCH + 3).tolist()]
    expected = played_table.fan(strokes)
    for k in (0, BATCH - 1, BATCH, BATCH + 2):
        assert (expected.position[k] == played_table.shoot(strokes[k]).position).all()
    assert (played_table.fan(strokes, threads=5).position == expected.position).all()
    assert len(played_table.fan([], threads=3).position) == 0
    assert (played_table.fan(strokes[:2], threads=9).position == expected.position[:2]).all()


def test_table_can_be_pickled_and_used_from_many_threads() -> None:
    played_table = pickle.loads(pickle.dumps(table_with_pocket()))
    tables = played_table, played_table.with_balls({"a": (0.3, 1.2)})
    expected = [each.shoot(UPWARDS, record_paths=True).log for each in tables]
    with ThreadPoolExecutor(4) as pool:
        logs = list(pool.map(lambda k: tables[k % 2].shoot(UPWARDS, record_paths=True).log, range(100)))
    assert all((log == expected[k % 2]).all() for k, log in enumerate(logs))


@pytest.mark.parametrize("offset", [0.0, 1e6, 1e9])
def test_no_ball_passes_a_cushion_far_from_the_origin(offset: float) -> None:
    """Coordinates there are rounded to 1e-7 m, a hundred times the contact tolerance."""
    # Both hit the two cushions of a corner at once, the second just after the first.
    balls = [
        {"name": str(k), "position": [offset + 2.0 * k + 1.0, 0.5], "radius": 0.03125, "restitution": 1.0,
         "velocity": [3.0 + k, 3.0 + k], "spin": [0.0, 0.0, 1.0]}
        for k in range(2)
    ]  # fmt: skip
    corners = [[offset, 0.0], [offset + 4.0, 0.0], [offset + 4.0, 4.0], [offset, 4.0]]
    wall = {"points": corners, "closed": True, "restitution": 1.0, "height": 0.03}
    scene = from_document({"surface": {"spinning_friction": 0.01}, "ball": balls, "wall": [wall]})
    played_table = Table(scene).shoot(until=300.0, record_paths=True)
    positions = played_table.at(np.linspace(0.0, 300.0, 3001)) - [offset, 0.0]
    assert len(played_table.events) > 200
    assert (np.abs(positions - 2.0) < 2.0).all()


def test_floor_without_balls_runs() -> None:
    empty = loads("[world]\nduration = 0.1\n[surface]\nsliding_friction = 0.2\n")
    pit = loads("[world]\nduration = 0.1\n[surface]\nsliding_friction = 0.2\n[[pocket]]\nposition = [0, 0]\nradius = 1")
    assert run(empty, "exact").status == "ok"
    assert run(pit, "exact").status == "ok"
    assert Table(pit).shoot().complete


@pytest.mark.parametrize("engine", ["exact", "pymunk"])
@pytest.mark.parametrize(
    ("action", "reason"),
    [
        (Strike(time=0.0, ball="in", aim=0.0, speed=1.0), "'in' is in a pocket"),
        (Impulse(time=0.0, body="in", impulse=(1.0, 0.0)), "'in' is in a pocket"),
        (Spawn(time=0.0, ball=Ball(position=(0.7, 0.7), radius=0.5 * R)), "passes over|different radii"),
        (Spawn(time=0.0, ball=Ball(position=(0.7, 0.7), radius=0.5 * R, collides="fixed")), "'rail'.* passes over"),
        (Spawn(time=0.0, ball=Ball(position=(0.7, 0.7), radius=2.0 * R)), "different radii"),
        (SetParameter(time=0.0, path="world.gravity", value=[0.0, -1.0]), "gravity in the plane"),
    ],
)
def test_action_that_a_surface_does_not_allow_changes_nothing(engine: str, action: Action, reason: str) -> None:
    simulation = start(table(ball("in", 0.5, 1.5), ball("cue", 0.5, 0.5), pocket=[HOLE]), engine)
    simulation.step()
    before = simulation.state_hash()
    with pytest.raises(ActionError, match=reason):
        simulation.apply(action)
    assert simulation.state_hash() == before


@pytest.mark.parametrize("engine", ["exact", "pymunk"])
def test_ball_moved_within_its_pocket_lies_at_the_centre(engine: str) -> None:
    simulation = start(table(ball("in", 0.5, 1.5), pocket=[HOLE]), engine)
    simulation.step()
    simulation.apply(Move(time=simulation.time, body="in", position=(0.52, 1.5)))
    simulation.step()
    assert simulation.frame().position[0].tolist() == HOLE["position"]
    assert not simulation.frame().velocity.any()
