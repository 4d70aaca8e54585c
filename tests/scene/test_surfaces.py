"""Surfaces: coefficients of pairs, falloff of restitution with speed, and kicks."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given

from sandbox.measure.preflight import warnings
from sandbox.scene.compile.contacts import contact_matrix, mix, pair_table
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import from_document
from tests.scene.faults import assert_faults, faults_of
from tests.scene.touching import coefficient, elements, touching_scenes


def coefficients_of(a: dict[str, Any], b: dict[str, Any], **more: Any) -> tuple[float, float]:
    """Return restitution and friction of two balls."""
    disc = {"position": [0.0, 0.0], "radius": 1.0}
    scene = from_document({"ball": [{**disc, **a}, {**disc, **b}], **more})
    surfaces = pair_table(scene, scene.bodies)
    i, j = surfaces.of_body
    assert surfaces.restitution[i, j] == surfaces.restitution[j, i]
    assert surfaces.friction[i, j] == surfaces.friction[j, i]
    return float(surfaces.restitution[i, j]), float(surfaces.friction[i, j])


@pytest.mark.parametrize(
    ("a", "b", "mixed"),
    [(None, None, 0.0), (0.5, None, 0.5), (None, 0.5, 0.5), (0.5, 0.25, 0.125), (0.0, None, 0.0), (0.0, 0.9, 0.0)],
)
def test_coefficients_are_mixed_as_products(a: float | None, b: float | None, mixed: float) -> None:
    assert mix(a, b) == mixed
    one, other = ({} if x is None else {"restitution": x, "friction": x} for x in (a, b))
    assert coefficients_of(one, other) == (mixed, mixed)


M, N, ROUGH = {"material": "m"}, {"material": "n"}, {"friction": 0.5}
WHOLE = {"restitution": 0.75, "friction": 2.0}


@pytest.mark.parametrize(
    ("a", "b", "pair", "expected"),
    [
        (M, {}, None, (0.5, 4.0)), (M, M, None, (0.25, 16.0)), (M, ROUGH, None, (0.5, 2.0)), (M, N, None, (0.125, 4.0)),
        # a shape goes before its material
        ({**M, "friction": 1.0}, {}, None, (0.5, 1.0)), ({**M, "restitution": 0.0}, {}, None, (0.0, 4.0)),
        # a pair goes before both, in either order; what it does not state is mixed
        (M, N, ("mn", WHOLE), (0.75, 2.0)), (M, N, ("nm", WHOLE), (0.75, 2.0)), (N, M, ("mn", WHOLE), (0.75, 2.0)),
        ({**M, "restitution": 0.1, "friction": 9.0}, {**N, "friction": 0.0}, ("mn", WHOLE), (0.75, 2.0)),
        (M, N, ("mn", {"restitution": 0.0}), (0.0, 4.0)), (M, N, ("mn", {"friction": 0.0}), (0.125, 0.0)),
        (M, N, ("mn", {}), (0.125, 4.0)), (M, M, ("mm", {"restitution": 0.9}), (0.9, 16.0)),
        (M, N, ("mm", {"restitution": 0.9}), (0.125, 4.0)), (M, {}, ("mm", {"restitution": 0.9}), (0.5, 4.0)),
    ],
)  # fmt: skip
def test_pair_goes_before_shape_and_shape_before_material(a: Any, b: Any, pair: Any, expected: Any) -> None:
    material = [{"name": "m", "restitution": 0.5, "friction": 4.0}, {"name": "n", "restitution": 0.25}]
    pairs = [] if pair is None else [{"between": list(pair[0]), **pair[1]}]
    assert coefficients_of(a, b, material=material, pair=pairs) == expected


@given(touching_scenes())
def test_coefficients_of_every_pair_agree_with_the_oracle(scene: Scene) -> None:
    surfaces = pair_table(scene, scene.bodies)
    all_elements = [*elements(scene), *scene.fixed]
    indices = [*surfaces.of_body, *surfaces.of_fixed]
    assert len(indices) == len(all_elements)
    for a, i in zip(all_elements, indices, strict=True):
        for b, j in zip(all_elements, indices, strict=True):
            assert surfaces.restitution[i, j] == coefficient(scene, a, b, "restitution")
            assert surfaces.friction[i, j] == coefficient(scene, a, b, "friction")


@given(touching_scenes())
def test_matrices_are_symmetric_and_within_bounds(scene: Scene) -> None:
    surfaces = pair_table(scene, scene.bodies)
    count = len(surfaces.surfaces)
    assert len(set(surfaces.surfaces)) == count
    assert surfaces.restitution.shape == surfaces.friction.shape == (count, count)
    assert np.array_equal(surfaces.restitution, surfaces.restitution.T)
    assert np.array_equal(surfaces.friction, surfaces.friction.T)
    assert ((surfaces.restitution >= 0) & (surfaces.restitution <= 1)).all()
    assert (surfaces.friction >= 0).all()


def test_elements_with_equal_coefficients_have_one_surface_unless_a_pair_names_them() -> None:
    at = {"position": [0.0, 0.0], "radius": 1.0}
    materials = [{"name": "m", "friction": 0.5}, {"name": "n", "friction": 0.5}]
    balls = [{**at, "material": "m"}, {**at, "material": "n"}, {**at, "friction": 0.5}, at]
    scene = from_document({"ball": balls, "material": materials})
    assert pair_table(scene, scene.bodies).of_body.tolist() == [0, 0, 0, 1]
    scene = from_document({"ball": balls, "material": materials, "pair": [{"between": ["m", "m"]}]})
    assert pair_table(scene, scene.bodies).of_body.tolist() == [0, 1, 1, 2]


WALL = {"points": [[0, 0], [1, 0]]}
POST = {"position": [0, 0], "radius": 1}
BALL = {"position": [5, 5], "radius": 0.1}
FALLOFF = {"restitution_falloff": 0.1}


@pytest.mark.parametrize(
    ("document", "path", "words"),
    [
        ({"post": [{**POST, "kick": {"speed": 1, "profile": "middle"}}]}, "post[0].kick.profile", "for a post"),
        ({"post": [{**POST, "kick": {}}]}, "post[0].kick.speed", "is missing"),
        ({"post": [{**POST, "kick": 3.0}]}, "post[0].kick", "a table, such as { speed = 3.0 }, is 3"),
        ({"wall": [{**WALL, "restitution": 1.5}]}, "wall[0].restitution", "add speed with kick = { speed = "),
        ({"post": [{**POST, "kick": {"speed": -1}}]}, "post[0].kick.speed", "must be at least 0"),
        ({"post": [{**POST, "kick": {"speed": 1, "threshold": 0}}]}, "post[0].kick.threshold", "at least 0.001"),
        ({"post": [{**POST, "one_way": True}]}, "post[0].one_way", "unknown key"),
        ({"wall": [{**WALL, "kick": {"speed": 1, "profile": "ends"}}]}, "wall[0].kick.profile", "one of"),
        ({"wall": [{**WALL, "solid": 1}]}, "wall[0].solid", "true or false"),
        ({"ball": [{**BALL, "restitution_falloff": -0.1}]}, "ball[0].restitution_falloff", "must be at least 0"),
        ({"surface": {}, "wall": [{**WALL, "solid": False}]}, "wall[0].solid", "is not supported"),
        ({"surface": {}, "wall": [{**WALL, "one_way": True}]}, "wall[0].one_way", "is not supported"),
        ({"surface": {}, "post": [{**POST, "kick": {"speed": 1}}]}, "post[0].kick", "is not supported"),
        ({"surface": {}, "material": [{"name": "m", **FALLOFF}]}, "material.m.restitution_falloff", "does not depend"),
        ({"surface": {}, "ball": [{**BALL, **FALLOFF}]}, "ball[0].restitution_falloff", "does not depend on speed"),
    ],
)
def test_fault_has_its_path_and_message(document: dict[str, Any], path: str, words: str) -> None:
    assert_faults(document, f"{path}: {words}")


def test_kick_is_no_remedy_for_the_restitution_of_a_ball() -> None:
    (fault,) = faults_of({"ball": [{**BALL, "restitution": 1.5}]})
    assert "kick" not in fault.message


def test_falloff_of_a_material_is_overridden_by_the_shape() -> None:
    balls = [
        {**BALL, "material": "rubber"},
        {"position": [9, 9], "radius": 0.1, "material": "rubber", "restitution_falloff": 0},
    ]
    rubber = {"name": "rubber", "restitution": 0.8, "restitution_falloff": 0.3}
    scene = from_document({"material": [rubber], "ball": balls, "post": [{**POST, "restitution_falloff": 0.1}]})
    surfaces = contact_matrix(scene).surfaces
    first, second, post = *surfaces.of_body.tolist(), surfaces.of_fixed[0]
    assert surfaces.falloff[first, post] == pytest.approx(0.4, rel=1e-15)  # a sum
    assert surfaces.falloff[second, post] == surfaces.falloff[post, second] == 0.1
    assert surfaces.fixed_coefficients[second, second]
    assert not surfaces.fixed_coefficients[first, second]


def test_parts_of_a_body_inherit_its_falloff() -> None:
    part = {"position": [0, 0], "radius": 0.1}
    parts = [part, {**part, "position": [0.5, 0], "restitution_falloff": 0.5}]
    scene = from_document({"body": [{"position": [5, 5], "restitution_falloff": 0.2, "ball": parts}]})
    surfaces = contact_matrix(scene).surfaces
    assert [surfaces.surfaces[k].falloff for k in surfaces.of_shape.tolist()] == [0.2, 0.5]


def test_scene_without_kicks_and_falloffs_has_one_plain_surface() -> None:
    surfaces = contact_matrix(from_document({"ball": [BALL], "post": [POST], "wall": [WALL]})).surfaces
    assert len(surfaces.surfaces) == 1
    assert surfaces.fixed_coefficients.all()
    assert not surfaces.kicks.any() | surfaces.one_way.any()


def test_warning_when_a_step_of_gravity_exceeds_the_kick_threshold() -> None:
    kicks = {"position": [0, 0], "radius": 0.5, "name": "bumper", "kick": {"speed": 1, "threshold": 0.054}}
    document = {"world": {"gravity": [0, -9.81], "duration": 0.1}, "ball": [BALL], "post": [kicks]}
    coarse, fine = ({**document, "solver": {"dt": dt}} for dt in (0.01, 0.005))
    (warning,) = (each for each in warnings(from_document(coarse)) if each.kind == "kick_threshold")
    assert "'bumper' kicks bodies that approach at 0.054 m/s" in warning.message
    assert "dt < 0.0055 s" in warning.message  # 0.054/9.81 s
    assert not [each for each in warnings(from_document(fine)) if each.kind == "kick_threshold"]


def test_top_speed_includes_kicks() -> None:
    from sandbox.measure.preflight import top_speeds

    def fastest(**wall: Any) -> float:
        scene = from_document({"ball": [BALL], "wall": [{**WALL, **wall}], "world": {"duration": 1}})
        return float(top_speeds(scene, contact_matrix(scene))[0])

    assert fastest() == 0.0
    assert fastest(restitution=0.5, kick={"speed": 2.0}) == pytest.approx(4.0, rel=1e-14)  # v = v/2 + 2
    v = fastest(restitution=0.8, restitution_falloff=0.3, kick={"speed": 2.0})
    assert v == pytest.approx(0.8 / (1 + 0.3 * v) * v + 2.0, rel=1e-14)
    assert fastest(restitution=1.0, kick={"speed": 2.0}) == 2.0


def test_scene_with_restitution_falloff_has_no_closed_form() -> None:
    from sandbox.measure.analytic import solution

    plane = {"point": [0, 0], "normal": [0, 1], "restitution": 0.5}
    drop = {"world": {"gravity": [0, -9.81], "duration": 3}, "ball": [{**BALL, "position": [0, 5]}], "plane": [plane]}
    assert solution(from_document(drop)) is not None
    assert solution(from_document({**drop, "plane": [{**plane, "restitution_falloff": 0.1}]})) is None
    row = [{"position": [x, 0], "velocity": [-x, 0], "radius": 0.1, "restitution": 0.9} for x in (-1, 1)]
    assert solution(from_document({"ball": row})) is not None
    assert solution(from_document({"ball": [{**each, "restitution_falloff": 0.1} for each in row]})) is None


def test_energy_is_not_conserved_with_falloff_or_kicks() -> None:
    from sandbox.measure.metrics.invariants import conserves_energy

    elastic = {**BALL, "restitution": 1}
    assert conserves_energy(from_document({"ball": [elastic], "post": [POST]}))
    assert not conserves_energy(from_document({"ball": [{**elastic, "restitution_falloff": 0.1}], "post": [POST]}))
    assert not conserves_energy(from_document({"ball": [elastic], "post": [{**POST, "kick": {"speed": 1}}]}))
