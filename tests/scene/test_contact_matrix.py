"""ContactMatrix against a brute-force oracle over all pairs."""

import numpy as np
import pytest
from hypothesis import given, settings

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


@pytest.mark.full
@settings(max_examples=200)
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


def test_single_ball_is_free_and_two_balls_of_a_grid_can_collide() -> None:
    assert contact_matrix(from_document({"ball": [BALL]})).free.tolist() == [True]
    grid = {"origin": [0, 0], "columns": 2, "spacing": [9, 0], "radius": 1}
    assert contact_matrix(from_document({"grid": [grid]})).free.tolist() == [False, False]
    assert contact_matrix(from_document({"grid": [{**grid, "columns": 1}]})).free.tolist() == [True]


def test_friction_makes_only_movable_bodies_turnable() -> None:
    matrix = contact_matrix(from_document({"ball": [{**BALL, "friction": 1.0}, {**BALL, "fixed": True}]}))
    assert matrix.turnable.tolist() == [True, False]


def test_spawned_ball_is_part_of_the_contact_matrix() -> None:
    scene = from_document({"ball": [BALL]})
    more = scene.bodies.joined_by(Ball(position=(5.0, 0.0), radius=1.0, friction=0.5), "new")
    matrix = contact_matrix(scene, more)
    assert matrix.ball_ball
    assert matrix.turnable.tolist() == [True, True]


def test_contact_matrix_of_an_empty_scene_is_empty() -> None:
    matrix = contact_matrix(Scene())
    assert not matrix.ball_ball
    assert len(matrix.free) == len(matrix.turnable) == 0
    assert (matrix.restitution, matrix.friction) == (0.0, 0.0)
