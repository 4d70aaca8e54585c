"""JointArrays: indices of bodies, and anchors relative to centres of mass."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given

from sandbox.scene.compile.joint_arrays import WORLD, JointArrays, JointKind
from sandbox.scene.compile.scene import Scene
from sandbox.scene.compile.setup import Setup
from sandbox.scene.files.load import from_document
from tests import strategies

L = [[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]]


def two_polygons(**joint: object) -> Scene:
    shapes = [
        {"name": "a", "points": L, "position": [0, 0], "angle": 0.7},
        {"name": "b", "points": L, "position": [5, 1], "angle": -0.2, "fixed": True},
    ]
    return from_document({"polygon": shapes, "joint": [{"between": ["a", "b"], **joint}]})


def rotated(angle: float, x: float, y: float) -> np.ndarray:
    return np.array([math.cos(angle) * x - math.sin(angle) * y, math.sin(angle) * x + math.cos(angle) * y])


def test_anchors_are_relative_to_the_origin_of_the_outline() -> None:
    scene = two_polygons(kind="rod", anchors=[[2, 1], [0, 2]])
    bodies, links = scene.bodies, scene.joint_arrays
    first, second = links.ends(bodies.position, bodies.angle)
    # 1e-14: rounding of the shift to the centre of mass and back
    assert first[0] == pytest.approx(rotated(0.7, 2, 1), abs=1e-14)
    assert second[0] == pytest.approx(np.array([5, 1]) + rotated(-0.2, 0, 2), abs=1e-14)
    assert links.figures[0, 0] == pytest.approx(math.dist(first[0], second[0]), rel=1e-14)


def test_pivot_point_is_the_anchor_of_both_bodies() -> None:
    scene = two_polygons(kind="pivot", at=[3, 4])
    for end in scene.joint_arrays.ends(scene.bodies.position, scene.bodies.angle):
        assert end[0] == pytest.approx([3, 4], abs=1e-14)  # rounding of the rotation to body axes and back


def test_joint_of_one_body_is_anchored_in_the_world() -> None:
    ball = {"name": "a", "position": [1, 2], "radius": 1}
    joint = {"kind": "spring", "between": ["a"], "anchors": [[0.5, 0], [7, 8]], "stiffness": 3, "damping": 2}
    links = from_document({"ball": [ball], "joint": [joint]}).joint_arrays
    assert (links.a[0], links.b[0]) == (WORLD, 0)
    assert links.anchor_a[0].tolist() == [7, 8]
    assert links.anchor_b[0].tolist() == [0.5, 0]
    assert links.figures[0].tolist() == [pytest.approx(math.dist((1.5, 2), (7, 8)), rel=1e-15), 3, 2]


def test_missing_values_are_those_of_the_initial_state() -> None:
    assert two_polygons(kind="rotary_spring", stiffness=1).joint_arrays.figures[0].tolist() == [-0.2 - 0.7, 1, 0]
    assert two_polygons(kind="gear", ratio=3).joint_arrays.figures[0].tolist() == [-0.2 * 3 - 0.7, 3, 0]
    assert two_polygons(kind="motor", rate=2).joint_arrays.max_force[0] == math.inf
    assert two_polygons(kind="ratchet", ratchet=0.5, phase=0.25).joint_arrays.figures[0].tolist() == [-1.25, 0.25, 0.5]


def test_limits_of_joints_are_unlimited_by_default() -> None:
    links = two_polygons(kind="rod", max_force=3, max_bias=0, bias=0.5).joint_arrays
    assert (links.max_force[0], links.max_bias[0], links.bias[0]) == (3.0, 0.0, 0.5)
    free = two_polygons(kind="rod").joint_arrays
    assert (free.max_force[0], free.max_bias[0], math.isnan(free.bias[0])) == (math.inf, math.inf, True)
    assert [each.is_limited.tolist() for each in (links, free)] == [[True], [False]]


@pytest.mark.parametrize(("ratchet", "turned", "click"), [(0.5, 1.3, 1.0), (0.5, 0.99, 1.0), (-0.5, -1.3, -1.0)])
def test_ratchet_of_a_later_state_is_at_the_last_click(ratchet: float, turned: float, click: float) -> None:
    """A load turns a ratchet that holds back a little, here by 2 % of a click."""
    scene = from_document({
        "ball": [{"name": "a", "position": [0, 0], "radius": 1}],
        "joint": [{"kind": "ratchet", "between": ["a"], "ratchet": ratchet}],
    })  # fmt: skip
    setup = Setup.of(scene)
    later = setup.placed(replace(setup.bodies, angle=np.asarray([turned])), 1.0)
    assert (setup.joints.figures[0, 0], later.joints.figures[0, 0]) == (0.0, click)


def test_links_list_bodies_held_turned_and_excluded_from_collision() -> None:
    balls = [{"name": name, "position": [3 * k, 0], "radius": 1} for k, name in enumerate("abcd")]
    joints = [
        {"kind": "rod", "between": ["b", "a"]},
        {"kind": "rod", "between": ["a", "b"], "anchors": [[0, 0], [0, 0.5]], "collide": True},
        {"kind": "motor", "between": ["c"], "rate": 1},
    ]
    links = from_document({"ball": balls, "joint": joints}).joint_arrays
    assert links.held(4).tolist() == [True, True, True, False]
    assert links.turned(4).tolist() == [False, True, True, False]
    assert links.apart().tolist() == [[0, 1]]
    assert links.of(JointKind.MOTOR).names == ("joint-3",)


@pytest.mark.fail_slow(60)  # takes over half a second
@given(strategies.solid_scenes())
def test_links_among_fewer_bodies_are_renumbered_or_dropped(scene: Scene) -> None:
    names = scene.bodies.names
    fewer = tuple(reversed(names[1:]))
    kept = scene.joint_arrays.among(fewer, names)
    all_links = [(k, names[b]) for k, b in zip(scene.joint_arrays.names, scene.joint_arrays.b.tolist(), strict=True)]
    kept_links = dict(zip(kept.names, kept.b.tolist(), strict=True))
    for k, (name, b) in enumerate(all_links):
        a = int(scene.joint_arrays.a[k])
        is_dropped = names[0] in (b, names[a] if a != WORLD else "")
        assert (name in kept_links) is not is_dropped
        if not is_dropped:
            assert fewer[kept_links[name]] == b
    assert len(scene.joint_arrays.joined(JointArrays.none())) == len(scene.joint_arrays)
