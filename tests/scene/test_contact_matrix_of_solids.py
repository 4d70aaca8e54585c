"""ContactMatrix of solids: who can touch whom, who can be turned, and by which figures."""

from typing import Any

from hypothesis import given, settings

from sandbox.scene.compile.contacts import contact_matrix
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.fixed import Plane
from sandbox.scene.files.load import from_document
from tests import strategies

BOX: dict[str, Any] = {"position": [0, 0], "size": [1, 1]}
BALL: dict[str, Any] = {"position": [9, 0], "radius": 1}
FLOOR: dict[str, Any] = {"point": [0, -5], "normal": [0, 1]}


def test_lone_body_of_many_parts_meets_nothing() -> None:
    body = {"position": [0, 0], "box": [{"size": [1, 1], "friction": 0.5}, {"size": [2, 2], "friction": 0.5}]}
    meet = contact_matrix(from_document({"body": [body]}))
    assert not meet.touches.any()
    assert not meet.mutual
    assert not meet.turnable.any()


def test_two_bodies_of_many_parts_meet() -> None:
    body = {"position": [0, 0], "box": [{"size": [1, 1]}]}
    meet = contact_matrix(from_document({"body": [body, {**body, "position": [5, 0]}]}))
    assert meet.touches.all()
    assert meet.mutual
    assert meet.solids
    assert not meet.ball_ball
    assert meet.turnable.all()  # a corner turns what it hits, rough or not


def test_smooth_ball_that_meets_a_box_is_not_turned() -> None:
    meet = contact_matrix(from_document({"box": [BOX], "ball": [BALL]}))
    assert meet.turnable.tolist() == [False, True]
    assert not meet.ball_ball


def test_each_part_has_its_own_figures() -> None:
    parts = [{"radius": 1, "friction": 0.5}, {"radius": 1, "position": [3, 0], "restitution": 0.25}]
    body = {"position": [0, 0], "restitution": 0.75, "ball": parts}
    meet = contact_matrix(from_document({"body": [body], "plane": [FLOOR]}))
    surfaces, (first, second) = meet.surfaces, meet.surfaces.of_shape.tolist()
    (floor,) = surfaces.of_fixed.tolist()
    assert (surfaces.friction[first, floor], surfaces.restitution[first, floor]) == (0.5, 0.75)
    assert (surfaces.friction[second, floor], surfaces.restitution[second, floor]) == (0.0, 0.25)
    assert (meet.friction, meet.restitution) == (0.5, 0.75)
    assert not meet.ball_fixed[Plane]


def test_part_with_a_material_of_its_own_takes_nothing_from_its_body() -> None:
    materials = [{"name": "wood", "friction": 0.4}, {"name": "ice", "friction": 0.1}]
    body = {"position": [0, 0], "material": "wood", "restitution": 0.5, "box": [{"size": [1, 1], "material": "ice"}]}
    meet = contact_matrix(from_document({"material": materials, "body": [body], "plane": [FLOOR]}))
    assert (meet.friction, meet.restitution) == (0.1, 0.0)


def test_fixed_box_is_met_and_never_turned() -> None:
    meet = contact_matrix(
        from_document({"box": [{**BOX, "fixed": True, "friction": 1}], "ball": [{**BALL, "friction": 1}]})
    )
    assert meet.touches.all()
    assert meet.turnable.tolist() == [True, False]


def test_what_is_joined_is_not_free() -> None:
    ball = {**BALL, "name": "a", "collides": "none"}
    meet = contact_matrix(from_document({"ball": [ball], "joint": [{"kind": "motor", "rate": 1, "between": ["a"]}]}))
    assert not meet.touches.any()
    assert not meet.free.any()


@settings(max_examples=30)
@given(strategies.solid_scenes())
def test_meetings_agree_with_themselves(scene: Scene) -> None:
    meet, bodies = contact_matrix(scene), scene.bodies
    assert len(meet.surfaces.of_shape) == len(bodies.shapes if not bodies.round.all() else bodies)
    assert not (meet.turnable & bodies.fixed).any()
    assert (meet.touching == meet.touching.T).all()
    assert not (meet.free & scene.links.held(len(bodies))).any()
    ghosts = [bodies.elements[k].collides == "none" for k in bodies.element.tolist()]
    assert not any(touches and ghost for touches, ghost in zip(meet.touches.tolist(), ghosts, strict=True))
