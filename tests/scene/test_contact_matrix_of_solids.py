"""ContactMatrix of solids: possible contacts, turnable bodies, and contact coefficients."""

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


def test_frictionless_ball_against_a_box_is_not_turnable() -> None:
    matrix = contact_matrix(from_document({"box": [BOX], "ball": [BALL]}))
    assert matrix.turnable.tolist() == [False, True]
    assert not matrix.ball_ball


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


def test_fixed_box_can_collide_and_is_not_turnable() -> None:
    matrix = contact_matrix(
        from_document({"box": [{**BOX, "fixed": True, "friction": 1}], "ball": [{**BALL, "friction": 1}]})
    )
    assert matrix.touches.all()
    assert matrix.turnable.tolist() == [True, False]


def test_body_with_a_joint_is_not_free() -> None:
    ball = {**BALL, "name": "a", "collides": "none"}
    matrix = contact_matrix(from_document({"ball": [ball], "joint": [{"kind": "motor", "rate": 1, "between": ["a"]}]}))
    assert not matrix.touches.any()
    assert not matrix.free.any()


@settings(max_examples=30)
@given(strategies.solid_scenes())
def test_contact_matrix_is_symmetric_and_consistent(scene: Scene) -> None:
    matrix, bodies = contact_matrix(scene), scene.bodies
    assert len(matrix.surfaces.of_shape) == len(bodies.shapes if not bodies.round.all() else bodies)
    assert not (matrix.turnable & bodies.fixed).any()
    assert (matrix.touching == matrix.touching.T).all()
    assert not (matrix.free & scene.links.held(len(bodies))).any()
    ghosts = [bodies.elements[k].collides == "none" for k in bodies.element.tolist()]
    assert not any(touches and ghost for touches, ghost in zip(matrix.touches.tolist(), ghosts, strict=True))
