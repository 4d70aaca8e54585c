"""Joints as arrays, by the indices of their bodies and about their centres of mass."""

import math

import numpy as np
import pytest
from hypothesis import given, settings

from sandbox.scene.compile.joint_arrays import WORLD, JointArrays, LinkKind
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import from_document
from tests import strategies

L = [[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]]


def two(**joint: object) -> Scene:
    shapes = [
        {"name": "a", "points": L, "position": [0, 0], "angle": 0.7},
        {"name": "b", "points": L, "position": [5, 1], "angle": -0.2, "fixed": True},
    ]
    return from_document({"polygon": shapes, "joint": [{"between": ["a", "b"], **joint}]})


def turned(angle: float, x: float, y: float) -> np.ndarray:
    return np.array([math.cos(angle) * x - math.sin(angle) * y, math.sin(angle) * x + math.cos(angle) * y])


def test_anchors_are_counted_from_where_a_body_was_drawn() -> None:
    scene = two(kind="rod", anchors=[[2, 1], [0, 2]])
    bodies, links = scene.bodies, scene.links
    first, second = links.ends(bodies.position, bodies.angle)
    assert first[0] == pytest.approx(turned(0.7, 2, 1), abs=1e-14)  # to the centre of mass and back
    assert second[0] == pytest.approx(np.array([5, 1]) + turned(-0.2, 0, 2), abs=1e-14)
    assert links.figures[0, 0] == pytest.approx(math.dist(first[0], second[0]), rel=1e-14)


def test_pivot_in_the_world_is_one_point_of_both() -> None:
    scene = two(kind="pivot", at=[3, 4])
    for end in scene.links.ends(scene.bodies.position, scene.bodies.angle):
        assert end[0] == pytest.approx([3, 4], abs=1e-14)  # turned there and back


def test_one_alone_is_held_by_the_world() -> None:
    ball = {"name": "a", "position": [1, 2], "radius": 1}
    joint = {"kind": "spring", "between": ["a"], "anchors": [[0.5, 0], [7, 8]], "stiffness": 3, "damping": 2}
    links = from_document({"ball": [ball], "joint": [joint]}).links
    assert (links.a[0], links.b[0]) == (WORLD, 0)
    assert links.anchor_a[0].tolist() == [7, 8]
    assert links.anchor_b[0].tolist() == [0.5, 0]
    assert links.figures[0].tolist() == [pytest.approx(math.dist((1.5, 2), (7, 8)), rel=1e-15), 3, 2]


def test_what_is_not_stated_is_as_it_starts() -> None:
    assert two(kind="rotary_spring", stiffness=1).links.figures[0].tolist() == [-0.2 - 0.7, 1, 0]
    assert two(kind="gear", ratio=3).links.figures[0].tolist() == [-0.2 * 3 - 0.7, 3, 0]
    assert two(kind="motor", rate=2).links.most_force[0] == math.inf


def test_links_tell_whom_they_hold_turn_and_keep_apart() -> None:
    balls = [{"name": name, "position": [3 * k, 0], "radius": 1} for k, name in enumerate("abcd")]
    joints = [
        {"kind": "rod", "between": ["b", "a"]},
        {"kind": "rod", "between": ["a", "b"], "anchors": [[0, 0], [0, 0.5]], "collide": True},
        {"kind": "motor", "between": ["c"], "rate": 1},
    ]
    links = from_document({"ball": balls, "joint": joints}).links
    assert links.held(4).tolist() == [True, True, True, False]
    assert links.turned(4).tolist() == [False, True, True, False]
    assert links.apart().tolist() == [[0, 1]]
    assert links.of(LinkKind.MOTOR).names == ("joint-3",)


@settings(max_examples=25)
@given(strategies.solid_scenes())
def test_links_follow_their_bodies_into_a_smaller_cast(scene: Scene) -> None:
    names = scene.bodies.names
    fewer = tuple(reversed(names[1:]))
    kept = scene.links.among(fewer, names)
    told = [(k, names[b]) for k, b in zip(scene.links.names, scene.links.b.tolist(), strict=True)]
    still = dict(zip(kept.names, kept.b.tolist(), strict=True))
    for k, (name, b) in enumerate(told):
        a = int(scene.links.a[k])
        gone = names[0] in (b, names[a] if a != WORLD else "")
        assert (name in still) is not gone
        if not gone:
            assert fewer[still[name]] == b
    assert len(scene.links.joined(JointArrays.none())) == len(scene.links)
