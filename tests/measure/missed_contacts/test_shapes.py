"""Missed contacts of other shapes than balls, of joined pairs and on layers, and the history of contacts."""

from typing import Any

import numpy as np
import pytest

import sandbox
from sandbox.action import Move
from sandbox.measure.missed_contacts.contact_history import ContactHistory
from sandbox.measure.run.runner import run
from sandbox.scene.files.document import to_document
from sandbox.scene.files.load import from_document, loads
from sandbox.trajectory import Trajectory

WALL = "[[wall]]\nname = 'w'\npoints = [[0, -5], [0, 5]]\n"


def shoot(body: str, dt: float = 0.1, wall: str = WALL) -> Trajectory:
    """Run a body at 30 m/s from 1.6 m before a wall; at 3 m a step it passes the wall within the first."""
    text = f"[world]\nduration = 0.5\n[solver]\ndt = {dt}\n{wall}{body}\nvelocity = [30, 0]\nname = 'b'\n"
    return run(loads(text))


@pytest.mark.parametrize(
    "body",
    [
        "[[ball]]\nradius = 0.25\nposition = [-1.6, 0]",
        "[[box]]\nsize = [1.0, 0.5]\nposition = [-1.6, 0]",
        "[[capsule]]\nlength = 1.0\nradius = 0.25\nposition = [-1.6, 0]",
    ],
    ids=["ball", "box", "capsule"],
)
def test_wall_passed_in_one_step_is_missed_by_any_shape(body: str) -> None:
    found = shoot(body)
    assert (found.missed_contacts, found.missed_pair.tolist()) == (1, [[0, -1]])
    assert shoot(body, dt=0.001).missed_contacts == 0


def test_body_without_an_inner_disc_is_not_audited() -> None:
    """A horseshoe with its centre of mass in the gap."""
    horseshoe = (
        "[[body]]\nname = 'b'\nposition = [-1.6, 0]\nvelocity = [30, 0]\n[[body.box]]\nsize = [0.1, 1.0]\n"
        "[[body.box]]\nsize = [1.0, 0.1]\nposition = [0.55, 0.45]\n"
        "[[body.box]]\nsize = [1.0, 0.1]\nposition = [0.55, -0.45]\n"
    )
    scene = loads(f"[world]\nduration = 0.5\n[solver]\ndt = 0.1\n{WALL}{horseshoe}")
    assert scene.bodies.core.tolist() == [0.0]
    assert run(scene).missed_contacts == 0


@pytest.mark.parametrize("engine", ["pymunk", "reference"])
def test_slowly_tumbling_boxes_miss_no_contacts(engine: str) -> None:
    """A step covers less than any half width, so that no contact can be missed."""
    rng = np.random.default_rng(3)
    boxes = "".join(
        f"[[box]]\nname = 'b{k}'\nposition = [{x}, {y}]\nangle = {rng.uniform(0, 3):.3f}\nsize = [0.8, 0.3]\n"
        f"angular_velocity = {rng.uniform(-9, 9):.3f}\nvelocity = [{rng.uniform(-3, 3):.3f}, 0]\n"
        for k, (x, y) in enumerate((x, y) for x in (-1.0, 0.0, 1.0) for y in (1.0, 2.0, 3.0))
    )
    floor = "[[wall]]\nname = 'w'\npoints = [[-2, 3], [-2, 0], [2, 0], [2, 3]]\nthickness = 0.1\n"
    scene = loads(f"[world]\nduration = 2.0\ngravity = [0, -9.81]\n[solver]\ndt = 0.005\n{floor}{boxes}")
    found = run(scene, engine)
    assert found.missed_contacts == 0
    assert len(found.contact_time) > 9


@pytest.mark.parametrize(("collide", "missed"), [("false", 0), ("true", 1)])
def test_joined_pair_misses_contacts_only_if_it_can_collide(collide: str, missed: int) -> None:
    """A ball passes another one, to which a long string connects it, in one step."""
    found = run(
        loads(
            "[world]\nduration = 0.2\n[solver]\ndt = 0.1\n"
            "[[ball]]\nname = 'a'\nposition = [-1.6, 0]\nvelocity = [30, 0]\nradius = 0.25\n"
            "[[ball]]\nname = 'b'\nposition = [0, 0]\nradius = 0.25\n"
            f"[[joint]]\nkind = 'slide'\nbetween = ['a', 'b']\nmost = 100.0\ncollide = {collide}\n"
        )
    )
    assert found.missed_contacts == missed


def test_limbs_of_a_ragdoll_do_not_miss_each_other() -> None:
    scene = loads(
        "[world]\nduration = 1.0\ngravity = [0, -9.81]\n[solver]\ndt = 0.05\n"
        "[[post]]\nposition = [0.1, -1]\nradius = 0.1\n[[ragdoll]]\nname = 'doll'\nposition = [0, 2]\n"
    )
    own = {n for n, name in enumerate(scene.bodies.names) if name.startswith("doll")}
    assert not any(set(pair) <= own for pair in run(scene).missed_pair.tolist())


PAIRS = np.array([[3, 7], [0, -1], [999_999, -1_000_000], [5, 6]])


def test_pair_is_found_in_its_own_step_only():
    history = ContactHistory()
    history.add(PAIRS[:2])
    history.add(PAIRS[2:])
    when = np.array([0, 1, 0, 1])
    assert history.found(when, PAIRS[[0, 0, 2, 2]]).tolist() == [True, False, False, True]


def test_no_pair_is_found_in_a_step_without_contacts():
    history = ContactHistory()
    history.add(np.empty((0, 2), np.int64))
    assert history.found(np.zeros(4, np.int64), PAIRS).tolist() == [False] * 4


def test_pairs_with_adjacent_indices_are_distinguished():
    history = ContactHistory()
    history.add(np.array([[1, 0], [0, 5]]))
    pairs = np.array([[0, 1], [1, -1], [0, 4], [0, 6], [0, 5]])
    assert history.found(np.zeros(5, np.int64), pairs).tolist() == [False] * 4 + [True]


def test_forget_keeps_the_last_step_and_add_copies_its_pairs():
    history, pairs = ContactHistory(), PAIRS.copy()
    history.add(PAIRS[:1])
    history.add(pairs)
    pairs[:] = 0
    history.forget()
    assert len(history) == 1
    assert history.found(np.zeros(4, np.int64), PAIRS).all()


both = pytest.mark.parametrize("engine", ["pymunk", "reference"])

LAYERED_WALL = {"points": [[0.5, -1], [0.5, 1]], "layers": ["up"]}
POST = {"position": [0.5, 0.0], "radius": 0.01, "layers": ["up"]}
PLANE = {"point": [0.5, 0.0], "normal": [-1.0, 0.0], "layers": ["up"]}
TARGET = {"position": [0.5, 0.0], "radius": 0.01, "layer": "up"}
BULLET: dict[str, Any] = {"position": [0.0, 0.0], "velocity": [70.0, 0.0], "radius": 0.01}


@both
@pytest.mark.parametrize("thing", ["wall", "post", "ball"])
@pytest.mark.parametrize(("layer", "missed"), [("ground", 0), ("up", 1)])
def test_bullet_misses_only_shapes_of_its_own_layer(engine: str, thing: str, layer: str, missed: int) -> None:
    more: dict[str, Any] = {"wall": {"wall": [LAYERED_WALL]}, "post": {"post": [POST]}, "ball": {}}[thing]
    balls = [{**BULLET, "layer": layer}, *([TARGET] if thing == "ball" else [])]
    run = sandbox.run(from_document({"world": {"duration": 0.05}, "ball": balls, **more}), engine)
    assert run.missed_contacts == missed


@both
def test_body_is_audited_on_its_new_layer_after_a_change(engine: str) -> None:
    zone = {"position": [0.0, 0.0], "radius": 0.05, "to_layer": "up"}
    run = sandbox.run(
        from_document({"world": {"duration": 0.05}, "ball": [BULLET], "wall": [LAYERED_WALL], "zone": [zone]}), engine
    )
    assert run.missed_contacts == 1


@both
def test_plane_of_another_layer_is_not_missed(engine: str) -> None:
    for layer in ("ground", "up"):
        ball = {**BULLET, "layer": layer}
        run = sandbox.run(from_document({"world": {"duration": 0.05}, "ball": [ball], "plane": [PLANE]}), engine)
        assert run.missed_contacts == 0
        assert len(run.contact_time) == (layer == "up")


@pytest.mark.parametrize("engine", ["pymunk", "reference", "box2d"])
@pytest.mark.parametrize("shape", ["box", "capsule"])
def test_end_of_a_turning_bar_that_passes_a_ball_within_a_step_is_missed(engine: str, shape: str) -> None:
    """The axis is at the angle 1/6 + spin·t: it passes the ball, 1.5 m out at 1 rad, in the step from (5/6)/spin."""
    size = {"size": [4.0, 0.06]} if shape == "box" else {"length": 4.0, "radius": 0.03}
    spin, dt = 20.0, 1 / 60
    bar = {"name": "bar", "position": [0.0, 0.0], "kinematic": True, "angle": 1 / 6, "angular_velocity": spin, **size}
    ball = {"name": "ball", "position": [1.5 * np.cos(1.0), 1.5 * np.sin(1.0)], "radius": 0.03}
    world = {"gravity": [0.0, 0.0], "duration": 0.1}
    scene = from_document({"world": world, "solver": {"dt": dt}, shape: [bar], "ball": [ball]})
    found = run(scene, engine)
    assert found.missed_pair.tolist() == [[0, 1]]
    assert found.missed_time[0] <= (5 / 6) / spin < found.missed_time[0] + dt
    assert run(scene, engine, dt=1e-3).missed_contacts == 0  # 3 cm a step, less than the two are wide
    assert run(scene, engine, record_every=2).missed_contacts == 0  # a lower bound: not followed
    apart = from_document({**to_document(scene), "ball": [{**ball, "collides": "fixed"}]})
    assert run(apart, engine).missed_contacts == 0


ROD = {"name": "rod", "size": [0.04, 1.0], "position": [0.0, 0.75], "fixed": True}


@pytest.mark.parametrize("engine", ["pymunk", "reference", "box2d"])
def test_bounce_under_the_end_of_a_bar_within_a_frame_is_no_passage(engine: str) -> None:
    """The chord of the frame crosses the bar, whose lower end is 0.15 m above the ball when that bounces."""
    document = {
        "world": {"gravity": [0.0, 0.0], "duration": 0.2},
        "solver": {"dt": 0.05, "substeps": 25},
        "plane": [{"point": [0.0, 0.0], "normal": [0.0, 1.0], "restitution": 1.0}],
        "box": [ROD],
        "ball": [{"position": [-0.5, 0.55], "velocity": [20.0, -20.0], "radius": 0.05}],
    }
    assert run(from_document(document), engine).missed_contacts == 0


@pytest.mark.parametrize("engine", ["pymunk", "reference", "box2d"])
def test_actions_that_place_a_body_are_no_passages(engine: str) -> None:
    ball = {"name": "ball", "position": [-1.0, 0.75], "radius": 0.05}
    scene = from_document({"world": {"gravity": [0.0, 0.0], "duration": 0.3}, "box": [ROD], "ball": [ball]})
    moved = run(scene, engine, actions=(Move(time=0.1, body="ball", position=(1.0, 0.75)),))
    assert (moved.status, moved.missed_contacts) == ("ok", 0)
    failed = run(scene, engine, actions=(Move(time=0.1, body="x", position=(2.0, 1.0)),))
    assert failed.status == "failed"


def test_capsules_that_are_squeezed_together_do_not_pass_each_other() -> None:
    heap = [
        {"length": 1.2, "radius": 0.05, "position": [0.3 * (k % 4), 0.2 + 0.3 * (k // 4)], "angle": 0.4 * k}
        for k in range(24)
    ]
    document = {
        "world": {"gravity": [0.0, -9.8], "duration": 1.0},
        "solver": {"dt": 0.0166},
        "wall": [{"points": [[-2.0, 8.0], [-2.0, 0.0], [3.0, 0.0], [3.0, 8.0]]}],
        "capsule": heap,
    }
    found = run(from_document(document))
    assert len(found.contact_time) > 50
    assert found.missed_contacts == 0
