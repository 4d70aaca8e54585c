"""Bodies: numbering and initial state."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given

from sandbox.scene.compile.generators import size
from sandbox.scene.compile.scene import Scene
from sandbox.scene.compile.setup import Setup
from sandbox.scene.description.discs import Ball, Emitter, Grid, Scatter
from sandbox.scene.files.load import loads
from tests import strategies

SCENE = """
emitter = [{ position = [9, 9], count = 2, velocity_min = [1, 1], velocity_max = [1, 1] }]
ball = [
  { position = [1, 2], velocity = [3, 4], angle = 5, angular_velocity = 6, radius = 2, density = 0.5 },
  { name = "rock", position = [50, 0], radius = 1, fixed = true },
]
grid = [
  { name = "row", origin = [0, 20], columns = 2, spacing = [7, 0], radius = 1, mass = 8, angular_velocity = 2 },
]
scatter = [{ count = 1, lower = [-9, -9], upper = [-9, -9], velocity = [2, 1], radius = 1 }]
"""


def test_bodies_are_numbered_as_balls_grids_scatters_emitters() -> None:
    bodies = loads(SCENE).bodies
    assert bodies.names == ("ball-1", "rock", "row-1", "row-2", "scatter-1-1", "emitter-1-1", "emitter-1-2")
    assert bodies.position.tolist() == [[1, 2], [50, 0], [0, 20], [7, 20], [-9, -9], [9, 9], [9, 9]]
    assert bodies.velocity.tolist() == [[3, 4], [0, 0], [0, 0], [0, 0], [2, 1], [1, 1], [1, 1]]
    assert bodies.angle.tolist() == [5, 0, 0, 0, 0, 0, 0]
    assert bodies.angular_velocity.tolist() == [6, 0, 2, 2, 0, 0, 0]
    assert bodies.radius.tolist() == [2, 1, 1, 1, 1, 0.05, 0.05]
    assert bodies.mass.tolist() == [0.5 * math.pi * 4, 1, 8, 8, 1, 1, 1]
    assert bodies.fixed.tolist() == [False, True, False, False, False, False, False]
    assert bodies.element.tolist() == [0, 1, 2, 2, 3, 4, 4]
    assert np.array_equal(bodies.moment, bodies.mass * bodies.radius**2 / 2)  # discs
    assert [type(element) for element in bodies.elements] == [Ball, Ball, Grid, Scatter, Emitter]
    assert len(bodies) == 7


def test_added_body_gets_the_next_number_and_keeps_the_others() -> None:
    bodies = loads(SCENE).bodies
    more = bodies.joined_by(Ball(position=(1.0, 1.0), velocity=(2.0, 3.0), radius=0.5, mass=4.0, angle=1.0), "new")
    assert more.names == (*bodies.names, "new")
    for key in ("position", "velocity", "angle", "angular_velocity", "radius", "mass", "fixed", "element"):
        assert np.array_equal(getattr(more, key)[:-1], getattr(bodies, key))
    assert more.position[-1].tolist() == [1, 1]
    assert more.velocity[-1].tolist() == [2, 3]
    assert (more.radius[-1], more.mass[-1], more.angle[-1], more.fixed[-1]) == (0.5, 4.0, 1.0, False)
    assert more.elements[more.element[-1]].mass == 4.0
    assert len(bodies) == 7


def test_fixed_ball_has_no_velocity_and_arrays_without_bodies_are_empty() -> None:
    ball = Ball(position=(0.0, 0.0), velocity=(2.0, 3.0), angular_velocity=4.0, radius=1.0, fixed=True)
    bodies = Scene(balls=(ball,)).bodies  # a scene file with it is refused
    assert not bodies.velocity.any()
    assert not bodies.angular_velocity.any()
    more = bodies.joined_by(ball, "new")
    assert more.fixed[-1] and not more.velocity.any()
    empty = Scene().bodies
    assert empty.position.shape == empty.velocity.shape == (0, 2)
    assert empty.radius.shape == empty.moment.shape == (0,)


def test_fixed_elements_are_numbered_as_planes_walls_posts() -> None:
    text = """
    [[post]]
    position = [0, 0]
    radius = 1
    [[wall]]
    points = [[0, 0], [1, 0]]
    [[plane]]
    name = "floor"
    point = [0, 0]
    normal = [0, 1]
    [[wall]]
    points = [[0, 0], [1, 0]]
    """
    scene = loads(text)
    assert scene.fixed_names == ("floor", "wall-1", "wall-2", "post-1")
    assert scene.fixed == (*scene.planes, *scene.walls, *scene.posts)


@pytest.mark.fail_slow(60)  # takes over half a second
@given(strategies.scenes())
def test_arrays_of_bodies_have_equal_lengths_and_are_finite(scene: Scene) -> None:
    bodies = scene.bodies
    n = len(scene.balls) + sum(map(size, (*scene.grids, *scene.scatters, *scene.emitters)))
    assert len(bodies) == len(set(bodies.names)) == n
    assert bodies.position.shape == bodies.velocity.shape == (n, 2)
    for key in ("angle", "angular_velocity", "radius", "mass", "fixed", "element", "moment"):
        assert getattr(bodies, key).shape == (n,)
        assert np.isfinite(getattr(bodies, key)).all()
    assert np.isfinite(bodies.position).all()
    assert np.isfinite(bodies.velocity).all()
    assert not bodies.velocity[bodies.fixed].any()
    assert not bodies.angular_velocity[bodies.fixed].any()
    assert len(scene.fixed_names) == len(scene.fixed)
    assert not set(scene.fixed_names) & set(bodies.names)


def test_changed_copy_of_a_scene_has_its_own_bodies():
    scene = loads(
        '[world]\ngravity = [0, -9.81]\n[[ball]]\nname = "a"\nradius = 0.1\nposition = [0, 1]\n'
        '[[ball]]\nname = "b"\nradius = 0.1\nposition = [1, 1]\n[[joint]]\nkind = "rod"\nbetween = ["a", "b"]\n'
    )
    assert scene.bodies.names == ("a", "b") and len(scene.joint_arrays) == 1
    changed = scene.model_copy(update={"balls": scene.balls[:1], "joints": ()})
    assert changed.bodies.names == ("a",)
    assert len(changed.joint_arrays) == 0
    assert scene.bodies.names == ("a", "b")


def test_setup_with_a_changed_scene_keeps_its_bodies():
    scene = loads('[[ball]]\nname = "a"\nradius = 0.1\nposition = [0, 1]\n')
    setup = Setup.of(scene)
    moved = setup.placed(replace(setup.bodies, position=setup.bodies.position + 1.0), time=2.0)
    changed = moved.with_scene(
        scene.model_copy(update={"balls": (scene.balls[0].model_copy(update={"friction": 0.7}),)})
    )
    assert changed.bodies.position.tolist() == [[1.0, 2.0]]
    assert changed.time == 2.0
    assert changed.bodies.elements[0].friction == 0.7
    assert setup.bodies.position.tolist() == [[0.0, 1.0]]
