"""Which elements can collide, of balls and of solids, against a search over all pairs."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given

from sandbox.scene.compile.contacts import contact_matrix
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.discs import Ball
from sandbox.scene.description.fixed import Plane, Post, Wall
from sandbox.scene.files.load import from_document
from tests.scene.touching import (
    balls_can_collide,
    coefficient,
    collides_with_fixed,
    elements,
    is_fixed,
    touching_scenes,
)


@given(touching_scenes())
def test_contact_matrix_equals_a_brute_force_search_over_pairs(scene: Scene) -> None:
    matrix = contact_matrix(scene)
    balls = elements(scene)
    surfaces = matrix.surfaces
    partners = [[b for j, b in enumerate(balls) if j != i and balls_can_collide(a, b)] for i, a in enumerate(balls)]
    fixed = [list(scene.fixed) if collides_with_fixed(a) else [] for a in balls]

    assert matrix.ball_ball == any(partners)
    assert matrix.free.tolist() == [not p and not f for p, f in zip(partners, fixed, strict=True)]
    has_friction = [
        any(coefficient(scene, a, b, "friction") > 0 for b in (*p, *f))
        for a, p, f in zip(balls, partners, fixed, strict=True)
    ]
    assert matrix.turnable.tolist() == [r and not is_fixed(a) for r, a in zip(has_friction, balls, strict=True)]
    for kind in (Plane, Wall, Post):
        assert matrix.ball_fixed[kind] == any(isinstance(element, kind) for f in fixed for element in f)

    touching = np.zeros((len(surfaces.surfaces),) * 2, dtype=bool)
    contacts = []
    for i, a in enumerate(balls):
        for j, b in enumerate(balls):
            if i != j and balls_can_collide(a, b):
                touching[surfaces.of_body[i], surfaces.of_body[j]] = True
                contacts.append((a, b))
        if collides_with_fixed(a):
            for k, element in enumerate(scene.fixed):
                touching[surfaces.of_body[i], surfaces.of_fixed[k]] = True
                touching[surfaces.of_fixed[k], surfaces.of_body[i]] = True
                contacts.append((a, element))
    assert np.array_equal(matrix.touching, touching)
    for key in ("restitution", "friction"):
        assert getattr(matrix, key) == max((coefficient(scene, a, b, key) for a, b in contacts), default=0.0)


BALL = {"position": [0.0, 0.0], "radius": 1.0}


@pytest.mark.parametrize(
    ("a", "b", "can"),
    [
        ({}, {}, True), ({}, {"collides": "fixed"}, False), ({"collides": "fixed"}, {"collides": "fixed"}, False),
        ({}, {"collides": "none"}, False), ({}, {"fixed": True}, True), ({"collides": "fixed"}, {"fixed": True}, True),
        ({"collides": "none"}, {"fixed": True}, False), ({"fixed": True}, {"fixed": True}, False),
        ({}, {"fixed": True, "collides": "fixed"}, False), ({}, {"fixed": True, "collides": "none"}, False),
    ],
)  # fmt: skip
def test_two_balls_can_collide_if_both_collide_and_one_moves(a: dict, b: dict, can: bool) -> None:
    for balls in ([{**BALL, **a}, {**BALL, **b}], [{**BALL, **b}, {**BALL, **a}]):
        matrix = contact_matrix(from_document({"ball": balls}))
        assert matrix.ball_ball == can
        assert matrix.free.tolist() == [not can] * 2


def test_spawned_ball_is_part_of_the_contact_matrix() -> None:
    scene = from_document({"ball": [BALL]})
    more = scene.bodies.joined_by(Ball(position=(5.0, 0.0), radius=1.0, friction=0.5), "new")
    matrix = contact_matrix(scene, more)
    assert matrix.ball_ball
    assert matrix.turnable.tolist() == [True, True]


BOX: dict[str, Any] = {"position": [0, 0], "size": [1, 1]}
DISC: dict[str, Any] = {"position": [9, 0], "radius": 1}
FLOOR: dict[str, Any] = {"point": [0, -5], "normal": [0, 1]}


def test_single_compound_body_has_no_contacts() -> None:
    body = {"position": [0, 0], "box": [{"size": [1, 1], "friction": 0.5}, {"size": [2, 2], "friction": 0.5}]}
    matrix = contact_matrix(from_document({"body": [body]}))
    assert not matrix.touches.any()
    assert not matrix.mutual
    assert not matrix.turnable.any()


def test_two_compound_bodies_can_collide() -> None:
    body = {"position": [0, 0], "box": [{"size": [1, 1]}]}
    matrix = contact_matrix(from_document({"body": [body, {**body, "position": [5, 0]}]}))
    assert matrix.touches.all()
    assert matrix.mutual
    assert matrix.solids
    assert not matrix.ball_ball
    assert matrix.turnable.all()  # a corner can turn a body even without friction


def test_frictionless_ball_and_fixed_box_are_not_turnable() -> None:
    matrix = contact_matrix(from_document({"box": [BOX], "ball": [DISC]}))
    assert matrix.turnable.tolist() == [False, True]
    assert not matrix.ball_ball
    matrix = contact_matrix(from_document({"box": [{**BOX, "fixed": True, "friction": 1}], "ball": [DISC]}))
    assert matrix.touches.all()
    assert matrix.turnable.tolist() == [True, False]


def test_each_part_has_its_own_coefficients() -> None:
    parts = [{"radius": 1, "friction": 0.5}, {"radius": 1, "position": [3, 0], "restitution": 0.25}]
    body = {"position": [0, 0], "restitution": 0.75, "ball": parts}
    matrix = contact_matrix(from_document({"body": [body], "plane": [FLOOR]}))
    surfaces, (first, second) = matrix.surfaces, matrix.surfaces.of_shape.tolist()
    (floor,) = surfaces.of_fixed.tolist()
    assert (surfaces.friction[first, floor], surfaces.restitution[first, floor]) == (0.5, 0.75)
    assert (surfaces.friction[second, floor], surfaces.restitution[second, floor]) == (0.0, 0.25)
    assert (matrix.friction, matrix.restitution) == (0.5, 0.75)
    assert not matrix.ball_fixed[Plane]


def test_part_with_its_own_material_ignores_coefficients_of_the_body() -> None:
    materials = [{"name": "wood", "friction": 0.4}, {"name": "ice", "friction": 0.1}]
    body = {"position": [0, 0], "material": "wood", "restitution": 0.5, "box": [{"size": [1, 1], "material": "ice"}]}
    matrix = contact_matrix(from_document({"material": materials, "body": [body], "plane": [FLOOR]}))
    assert (matrix.friction, matrix.restitution) == (0.1, 0.0)


def test_body_with_a_joint_is_not_free() -> None:
    ball = {**DISC, "name": "a", "collides": "none"}
    matrix = contact_matrix(from_document({"ball": [ball], "joint": [{"kind": "motor", "rate": 1, "between": ["a"]}]}))
    assert not matrix.touches.any()
    assert not matrix.free.any()
