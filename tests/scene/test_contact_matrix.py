"""ContactMatrix against an oracle that asks every two things."""

import numpy as np
import pytest
from hypothesis import given, settings

from sandbox.scene.compile.contacts import contact_matrix
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.discs import Ball
from sandbox.scene.description.fixed import Plane, Post, Wall
from sandbox.scene.files.load import from_document
from tests.scene.touching import balls_meet, coefficient, elements, is_fixed, meets_fixed_things, touching_scenes


@settings(max_examples=200)
@given(touching_scenes())
def test_meetings_are_those_of_every_two_things(scene: Scene) -> None:
    meet = contact_matrix(scene)
    balls = elements(scene)
    surfaces = meet.surfaces
    partners = [[b for j, b in enumerate(balls) if j != i and balls_meet(a, b)] for i, a in enumerate(balls)]
    fixed = [list(scene.fixed) if meets_fixed_things(a) else [] for a in balls]

    assert meet.ball_ball == any(partners)
    assert meet.free.tolist() == [not p and not f for p, f in zip(partners, fixed, strict=True)]
    rubbed = [
        any(coefficient(scene, a, b, "friction") > 0 for b in (*p, *f))
        for a, p, f in zip(balls, partners, fixed, strict=True)
    ]
    assert meet.turnable.tolist() == [r and not is_fixed(a) for r, a in zip(rubbed, balls, strict=True)]
    for kind in (Plane, Wall, Post):
        assert meet.ball_fixed[kind] == any(isinstance(thing, kind) for f in fixed for thing in f)

    touching = np.zeros((len(surfaces.surfaces),) * 2, dtype=bool)
    contacts = []
    for i, a in enumerate(balls):
        for j, b in enumerate(balls):
            if i != j and balls_meet(a, b):
                touching[surfaces.of_body[i], surfaces.of_body[j]] = True
                contacts.append((a, b))
        if meets_fixed_things(a):
            for k, thing in enumerate(scene.fixed):
                touching[surfaces.of_body[i], surfaces.of_fixed[k]] = True
                touching[surfaces.of_fixed[k], surfaces.of_body[i]] = True
                contacts.append((a, thing))
    assert np.array_equal(meet.touching, touching)
    for key in ("restitution", "friction"):
        assert getattr(meet, key) == max((coefficient(scene, a, b, key) for a, b in contacts), default=0.0)


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
def test_two_balls_meet_where_each_lets_the_other_and_one_moves(a: dict, b: dict, can: bool) -> None:
    for balls in ([{**BALL, **a}, {**BALL, **b}], [{**BALL, **b}, {**BALL, **a}]):
        meet = contact_matrix(from_document({"ball": balls}))
        assert meet.ball_ball == can
        assert meet.free.tolist() == [not can] * 2


def test_lone_ball_meets_nothing_and_two_of_a_kind_meet() -> None:
    assert contact_matrix(from_document({"ball": [BALL]})).free.tolist() == [True]
    grid = {"origin": [0, 0], "columns": 2, "spacing": [9, 0], "radius": 1}
    assert contact_matrix(from_document({"grid": [grid]})).free.tolist() == [False, False]
    assert contact_matrix(from_document({"grid": [{**grid, "columns": 1}]})).free.tolist() == [True]


def test_friction_turns_movers_only() -> None:
    meet = contact_matrix(from_document({"ball": [{**BALL, "friction": 1.0}, {**BALL, "fixed": True}]}))
    assert meet.turnable.tolist() == [True, False]


def test_spawned_ball_joins_the_meetings() -> None:
    scene = from_document({"ball": [BALL]})
    more = scene.bodies.joined_by(Ball(position=(5.0, 0.0), radius=1.0, friction=0.5), "new")
    meet = contact_matrix(scene, more)
    assert meet.ball_ball
    assert meet.turnable.tolist() == [True, True]


def test_empty_scene_has_no_meetings() -> None:
    meet = contact_matrix(Scene())
    assert not meet.ball_ball
    assert len(meet.free) == len(meet.turnable) == 0
    assert (meet.restitution, meet.friction) == (0.0, 0.0)
