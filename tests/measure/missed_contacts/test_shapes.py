"""Missed contacts of other shapes than balls, by their largest inner disc, and of joined pairs."""

import numpy as np
import pytest

from sandbox.measure.run.runner import run
from sandbox.scene.files.load import loads
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
        "[[body]]\nposition = [-1.6, 0]\n[[body.box]]\nsize = [0.1, 1.0]\n"
        "[[body.box]]\nsize = [1.0, 0.1]\nposition = [0.55, 0.45]\n"
        "[[body.box]]\nsize = [1.0, 0.1]\nposition = [0.55, -0.45]\n"
    )
    scene = loads(horseshoe.replace("[[body.box]]", "name = 'b'\n[[body.box]]", 1))
    assert scene.bodies.core.tolist() == [0.0]
    text = horseshoe.replace("[[body.box]]", "velocity = [30, 0]\nname = 'b'\n[[body.box]]", 1)
    assert run(loads(f"[world]\nduration = 0.5\n[solver]\ndt = 0.1\n{WALL}{text}")).missed_contacts == 0


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
