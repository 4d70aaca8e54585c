"""Stated moments of inertia and centres of mass, rounded outlines, and capsules between two ends."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from shapely.geometry import Polygon as Outline

from sandbox.action import ActionError, Spawn
from sandbox.engines.registry import able
from sandbox.engines.switching import start
from sandbox.measure.run.runner import run
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.discs import Ball
from sandbox.scene.errors import SceneError
from sandbox.scene.files.load import dumps, loads
from sandbox.scene.geometry.polygon import polygon_moments, rounded_polygon_moments

pytestmark = pytest.mark.fail_slow(60)  # compiles kernels of polygons

CAPSULE = '[[body]]\nname = "b"\nposition = [1, 2]\ncapsule = [{{ radius = 0.1, {} }}]\n'


@given(mass=st.floats(1e-3, 1e6), width=st.floats(0.1, 9.0))
def test_stated_mass_is_kept_to_the_bit(mass: float, width: float) -> None:
    boxes = f"[{{ size = [{width!r}, 0.7] }}, {{ size = [0.3, 1.1] }}]"
    text = f"[[body]]\nposition = [0, 0]\nmass = {mass!r}\nbox = {boxes}\n"
    text += f"[[box]]\nposition = [99, 0]\nmass = {mass!r}\nsize = [{width!r}, 0.3]\n"
    assert loads(text).bodies.mass.tolist() == [mass, mass]


@given(st.integers(3, 9), st.floats(0.01, 2.0), st.floats(0.0, 6.0), st.tuples(st.floats(-5, 5), st.floats(-5, 5)))
def test_moments_of_a_rounded_outline_are_those_of_a_fine_polygon(count, radius, turn, at):
    angles = [turn + math.tau * (k + 0.3 * math.sin(k)) / count for k in range(count)]
    corners = [(at[0] + 1.7 * math.cos(a), at[1] + math.sin(a)) for a in angles]
    exact = rounded_polygon_moments(corners, radius)
    fine = Outline(corners).buffer(radius, quad_segs=400)
    sampled = polygon_moments(list(fine.exterior.coords)[::-1][:-1])
    # the polygon of 1,600 corners on the arcs lies (π/1600)²/6 = 6e-7 inside of them
    assert math.isclose(exact.area, sampled.area, rel_tol=2e-6)
    assert math.isclose(exact.second, sampled.second, rel_tol=4e-6)
    assert math.dist(exact.centroid, sampled.centroid) < 1e-6 * (radius + 2.0)


def scene(text: str, gravity: float = -9.81) -> Scene:
    return loads(f"[world]\ngravity = [0, {gravity}]\nduration = 1.0\n[solver]\ndt = 0.005\n{text}")


def test_stated_moment_and_centre_replace_those_of_the_shape() -> None:
    found = scene(
        '[[ball]]\nname = "a"\nposition = [0, 0]\nradius = 0.5\nmass = 2\nmoment = 7\n'
        '[[body]]\nname = "b"\nposition = [3, 4]\nangle = 1.5\nmass = 2\nmoment = 0.25\ncentre_of_mass = [0, 0]\n'
        "ball = [{ radius = 0.5, position = [1, 0] }]\n"
        '[[body]]\nname = "c"\nposition = [9, 4]\nmass = 2\ncentre_of_mass = [0, 0]\n'
        "ball = [{ radius = 0.5, position = [1, 0] }]\n"
    ).bodies
    assert found.moment.tolist() == [7.0, 0.25, 2.0 * (0.5 * 0.25 + 1.0)]  # parallel axis theorem
    assert found.position[1].tolist() == [3.0, 4.0]


def test_stated_moment_decides_how_a_torque_turns_a_body() -> None:
    """A thrust F at the rim of a disc gives α = F r / I; the path of its angle is ½ α t²."""
    text = (
        '[[ball]]\nname = "a"\nposition = [0, 0]\nradius = 0.5\nmass = 2\nmoment = 5\n'
        '[[joint]]\nkind = "pivot"\nbetween = ["a"]\nat = [0, 0]\n'
        '[[thrust]]\nbody = "a"\nforce = [0.0, 3.0]\npoint = [0.5, 0.0]\n'
    )
    wheel = scene(text, gravity=0.0)
    for engine in able(wheel):
        omega = run(wheel, engine).angular_velocity[-1, 0]
        # the solvers hold the pivot to about 1e-3 of the load
        assert math.isclose(omega, 3.0 * 0.5 / 5.0, rel_tol=5e-3), engine


@pytest.mark.parametrize("engine", ["pymunk", "reference", "box2d"])
def test_rounded_box_rests_on_its_rounding(engine: str) -> None:
    table = scene(
        "[[plane]]\npoint = [0, 0]\nnormal = [0, 1]\n"
        '[[box]]\nname = "a"\nposition = [0, 0.62]\nsize = [1, 0.8]\nradius = 0.2\n'
        '[[polygon]]\nname = "b"\nposition = [5, 0.22]\nradius = 0.2\npoints = [[-1, 0], [1, 0], [1, 0.5], [-1, 0.5]]\n'
    )
    found = run(table, engine)
    rest = found.position[-1, :, 1]
    assert math.isclose(rest[0], 0.6, abs_tol=0.012)  # slop of 1 % of the smallest size, and Box2D's of 5 mm
    assert math.isclose(rest[1], 0.45, abs_tol=0.012)
    assert np.abs(found.angle[-1]).max() < 1e-3


def test_body_with_fixed_rotation_slides_where_another_one_tumbles() -> None:
    """A tall box that is pushed at its top falls over; with a fixed rotation it keeps its angle."""
    text = (
        "[[plane]]\npoint = [0, 0]\nnormal = [0, 1]\nfriction = 1\n"
        '[[box]]\nname = "a"\nposition = [0, 1]\nsize = [0.4, 2]\nfriction = 1\n{}'
        '[[thrust]]\nbody = "a"\nforce = [8.0, 0.0]\npoint = [0.0, 1.0]\n'
    )
    for engine in ("pymunk", "reference", "box2d"):
        assert abs(run(scene(text.format("")), engine).angle[-1, 0]) > 0.5, engine
        fixed = run(scene(text.format("fixed_rotation = true\n")), engine)
        assert not fixed.angle.any() and not fixed.angular_velocity.any(), engine
        # μ m g = 9.81 N holds the 8 N; the solver lets it creep by less than a millimetre
        assert abs(fixed.position[-1, 0, 0]) < 1e-3, engine


def test_bodies_of_one_group_pass_each_other() -> None:
    text = "".join(
        f'[[{kind}]]\nname = "{name}"\nposition = [{x}, 0]\nvelocity = [{v}, 0]\ngroup = "{group}"\n{shape}\n'
        for kind, name, x, v, group, shape in (
            ("ball", "a", -1, 2, "g", "radius = 0.2"),
            ("box", "b", 0, 0, "g", "size = [0.4, 0.4]"),
            ("ball", "c", 1, 0, "h", "radius = 0.2"),
        )
    )
    crowd = scene(text, gravity=0.0)
    assert "exact" not in able(crowd)
    for engine in able(crowd):
        found = run(crowd, engine)
        assert found.velocity[-1, 2].tolist() == [0.0, 0.0], engine  # passed
        assert found.velocity[-1, 1, 0] > 0.5, engine  # hit
    assert {*crowd.bodies.group.tolist()} == {2**20, 2**20 + 1}


def test_exact_refuses_a_new_body_with_a_group() -> None:
    simulation = start(scene('[[ball]]\nname = "a"\nposition = [0, 0]\nradius = 0.2\n'), "exact")
    with pytest.raises(ActionError, match="does not model groups"):
        simulation.apply(Spawn(time=0.0, ball=Ball(position=(2.0, 0.0), radius=0.1, group="g")))


def test_capsule_part_lies_between_its_ends() -> None:
    one, other = scene(CAPSULE.format("ends = [[-0.5, 0], [0.5, 0]]")), scene(CAPSULE.format("length = 1.0"))
    for key in ("position", "mass", "moment", "radius"):
        assert getattr(one.bodies, key).tolist() == getattr(other.bodies, key).tolist()
    assert one.bodies.shapes.corner.tolist() == other.bodies.shapes.corner.tolist()
    assert loads(dumps(one)) == one


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (CAPSULE.format("angle = 0.0"), "either `length`"),
        (CAPSULE.format("length = 1.0, ends = [[0, 0], [1, 0]]"), "either `length`"),
        (CAPSULE.format("ends = [[1, 0], [1, 0]]"), "are the same point"),
        ("[surface]\n[[ball]]\nposition = [0, 0]\nradius = 0.1\nmoment = 2.0\n", "follows from the radius"),
        ("[[ball]]\nposition = [0, 0]\nradius = 0.1\nmoment = 0.0\n", "moment"),
    ],
)
def test_invalid_values_are_rejected(text: str, message: str) -> None:
    with pytest.raises(SceneError, match=message):
        loads(text)
