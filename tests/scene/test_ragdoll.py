"""Ragdolls: human mass and length fractions, joint limits, limbs of one ragdoll that do not collide."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.arrays import FloatArray
from sandbox.scene.compile.joint_arrays import JointKind
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.generators import segments
from sandbox.scene.files.load import dumps, from_document, loads
from tests.scene.faults import assert_faults

MASSES = {
    "head": 6.9, "pelvis": 21.75, "chest": 21.75, "upper-arm": 2.7, "forearm": 1.6, "hand": 0.6, "thigh": 14.2,
    "shank": 4.3, "foot": 1.4,
}  # fmt: skip
"""% of the total mass; the trunk has 43.5 % in two segments."""


def scene_of(**ragdoll: Any) -> Scene:
    return from_document({"ragdoll": [{"position": [0.0, 0.0], **ragdoll}]})


def joint_separation(scene: Scene, position: FloatArray, angle: FloatArray) -> float:
    """Return the largest distance between the two anchors of a pivot, m."""
    pivots = scene.joint_arrays.of(JointKind.PIVOT)
    first, second = pivots.ends(position, angle)
    return float(np.hypot(*(second - first).T).max())


def limit_margin(scene: Scene, angle: FloatArray) -> float:
    """Return the smallest distance of a joint angle from its limits, rad; negative beyond a limit."""
    bounds = scene.joint_arrays.of(JointKind.ROTARY_LIMIT)
    turn = angle[bounds.b] - angle[bounds.a]
    return float(np.minimum(turn - bounds.figures[:, 0], bounds.figures[:, 1] - turn).min())


def test_segments_have_human_mass_fractions() -> None:
    bodies = scene_of(name="doll", mass=80.0).bodies
    assert len(bodies) == 15
    assert math.fsum(bodies.mass) == pytest.approx(80.0, rel=1e-15)
    for name, mass in zip(bodies.names, bodies.mass.tolist(), strict=True):
        limb = name.removeprefix("doll-").removeprefix("left-").removeprefix("right-")
        assert mass == pytest.approx(0.8 * MASSES[limb], rel=1e-15)
    assert math.fsum(scene_of().bodies.mass) == pytest.approx(75.0, rel=1e-15)


def test_bodies_are_named_after_their_segments() -> None:
    names = scene_of(name="doll").bodies.names
    trunk = {"doll-pelvis", "doll-chest", "doll-head"}
    sides = {f"doll-{side}-{limb}" for side in ("left", "right") for limb in MASSES if f"doll-{limb}" not in trunk}
    assert set(names) == trunk | sides
    assert scene_of().bodies.names[0] == "ragdoll-1-left-upper-arm"
    assert scene_of(facing="left").bodies.names[0] == "ragdoll-1-right-upper-arm"  # the limbs at the back come first


def test_straight_figure_has_unit_height_and_joints_at_segment_ends() -> None:
    parts = segments(scene_of().ragdolls[0])
    assert max(part.ends[0][1] + part.radius for part in parts.values()) == 1.0
    assert min(part.ends[-1][1] - part.radius for name, part in parts.items() if name.endswith("foot")) == 0.0
    for name, part in parts.items():
        assert name == "pelvis" or part.parent in parts
        if name.endswith(("thigh", "shank", "arm")):
            assert part.joint == part.ends[0]
            assert not part.parent.endswith(("thigh", "arm")) or parts[part.parent].ends[1] == part.joint


figures = {
    "position": st.tuples(st.floats(-10.0, 10.0), st.floats(-10.0, 10.0)).map(list), "height": st.floats(0.1, 20.0),
    "mass": st.floats(1e-3, 1e4), "facing": st.sampled_from(["left", "right"]), "angle": st.floats(-7.0, 7.0),
}  # fmt: skip


@given(st.fixed_dictionaries({}, optional=figures))
def test_ragdoll_starts_joined_and_within_its_joint_limits(ragdoll: dict[str, Any]) -> None:
    scene = scene_of(**ragdoll)
    bodies, height = scene.bodies, ragdoll.get("height", 1.75)
    assert joint_separation(scene, bodies.position, bodies.angle) < 1e-14 * (height + 20.0)  # rounding of positions
    assert limit_margin(scene, bodies.angle) >= math.radians(4.9)  # the smallest margin of the initial pose is 5°
    assert len(scene.joint_arrays) == 28
    assert loads(dumps(scene)) == scene


@pytest.mark.parametrize("facing", ["left", "right"])
def test_position_of_a_ragdoll_is_below_its_feet(facing: str) -> None:
    bodies = scene_of(position=[3.0, 1.0], height=2.0, facing=facing).bodies
    shapes = bodies.shapes
    cos, sin = np.cos(bodies.angle), np.sin(bodies.angle)
    body = np.repeat(shapes.body, shapes.corners)
    y = bodies.position[body, 1] + sin[body] * shapes.corner[:, 0] + cos[body] * shapes.corner[:, 1]
    lowest = y - np.repeat(shapes.radius, shapes.corners)
    assert lowest.min() == pytest.approx(1.0, abs=1e-15)  # rounding
    assert (y + np.repeat(shapes.radius, shapes.corners)).max() == pytest.approx(3.0, abs=0.02)  # the legs are spread
    toe = bodies.position[bodies.names.index("ragdoll-1-right-foot"), 0]
    assert (toe > 3.0) == (facing == "right")


def test_facing_left_is_the_mirror_image() -> None:
    right, left = scene_of().bodies, scene_of(facing="left").bodies
    swapped = [n.replace("left", "x").replace("right", "left").replace("x", "right") for n in right.names]
    assert swapped != list(right.names)
    order = [left.names.index(name) for name in right.names]
    assert left.position[order] * [-1.0, 1.0] == pytest.approx(right.position, abs=1e-15)  # rounding


def test_angle_and_angular_velocity_apply_about_the_position() -> None:
    upright, tilted = scene_of(position=[1.0, 2.0]).bodies, scene_of(position=[1.0, 2.0], angle=math.pi / 2).bodies
    offset = upright.position - [1.0, 2.0]
    rotated = np.column_stack((-offset[:, 1], offset[:, 0]))
    assert tilted.position == pytest.approx(np.add(rotated, [1.0, 2.0]), abs=1e-15)
    assert tilted.angle == pytest.approx(upright.angle + math.pi / 2, abs=1e-15)  # rounding, as above
    spun = scene_of(position=[1.0, 2.0], velocity=[1.0, 0.0], angular_velocity=3.0).bodies
    assert spun.angular_velocity.tolist() == [3.0] * 15
    assert spun.velocity == pytest.approx(np.add(3.0 * rotated, [1.0, 0.0]), abs=1e-14)


def test_limbs_of_each_ragdoll_have_their_own_collision_group() -> None:
    scene = from_document({
        "ball": [{"position": [9.0, 9.0], "radius": 1.0}],
        "ragdoll": [{"position": [0.0, 0.0]}, {"position": [2.0, 0.0]}],
    })  # fmt: skip
    assert scene.bodies.group.tolist() == [0] + [1] * 15 + [2] * 15
    with_more = scene.bodies.joined_by(scene.balls[0], "more")
    assert with_more.group.tolist() == [*scene.bodies.group.tolist(), 0]


@pytest.mark.parametrize(
    ("ragdoll", "key", "message"),
    [
        ({"density": 2.0}, "density", "divide its mass"),
        ({"height": 0.0}, "height", "must be at least 0.001"),
        ({"facing": "up"}, "facing", "'right' or 'left'"),
        ({"mass": 0.0}, "mass", "must be greater than 0"),
    ],
)
def test_wrong_value_is_a_fault_with_a_hint(ragdoll: dict[str, Any], key: str, message: str) -> None:
    assert_faults({"ragdoll": [{"position": [0.0, 0.0], **ragdoll}]}, f"ragdoll[0].{key}: {message}")


def test_segments_have_the_material_and_colour_of_the_ragdoll() -> None:
    scene = from_document({
        "material": [{"name": "felt", "friction": 0.5}],
        "ragdoll": [{"position": [0.0, 0.0], "material": "felt", "restitution": 0.1, "colour": "#123456"}],
    })  # fmt: skip
    assert len(scene.elements) == 15
    for element in scene.elements:
        assert (element.material, element.restitution, element.colour) == ("felt", 0.1, "#123456")
    assert len({element.colour for element in scene_of().elements}) == 2
