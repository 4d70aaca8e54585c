"""Surfaces: restitution and friction of every pair."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given

from sandbox.scene.compile.contacts import mix, pair_table
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import from_document
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
    [
        (None, None, 0.0),
        (0.5, None, 0.5),
        (None, 0.5, 0.5),
        (0.5, 0.25, 0.125),
        (0.0, None, 0.0),
        (0.0, 0.9, 0.0),
        (1.0, 0.3, 0.3),
    ],
)
def test_coefficients_are_mixed_as_products(a: float | None, b: float | None, mixed: float) -> None:
    assert mix(a, b) == mixed
    one, other = ({} if x is None else {"restitution": x, "friction": x} for x in (a, b))
    assert coefficients_of(one, other) == (mixed, mixed)


def test_coefficients_of_a_material_apply_to_its_elements() -> None:
    material = [{"name": "m", "restitution": 0.5, "friction": 4.0}]
    assert coefficients_of({"material": "m"}, {}, material=material) == (0.5, 4.0)
    assert coefficients_of({"material": "m"}, {"material": "m"}, material=material) == (0.25, 16.0)
    assert coefficients_of({"material": "m"}, {"friction": 0.5}, material=material) == (0.5, 2.0)


def test_coefficient_of_a_shape_overrides_that_of_its_material() -> None:
    material = [{"name": "m", "restitution": 0.5, "friction": 4.0}]
    assert coefficients_of({"material": "m", "friction": 1.0}, {}, material=material) == (0.5, 1.0)
    assert coefficients_of({"material": "m", "restitution": 0.0}, {}, material=material) == (0.0, 4.0)


PAIRED = {
    "material": [{"name": "m", "restitution": 0.5, "friction": 4.0}, {"name": "n", "restitution": 0.25}],
}


def test_pair_overrides_materials_in_either_order() -> None:
    for between in (["m", "n"], ["n", "m"]):
        pair = [{"between": between, "restitution": 0.75, "friction": 2.0}]
        assert coefficients_of({"material": "m"}, {"material": "n"}, pair=pair, **PAIRED) == (0.75, 2.0)
        assert coefficients_of({"material": "n"}, {"material": "m"}, pair=pair, **PAIRED) == (0.75, 2.0)


def test_pair_overrides_coefficients_of_shapes() -> None:
    pair = [{"between": ["m", "n"], "restitution": 0.75, "friction": 2.0}]
    one, other = {"material": "m", "restitution": 0.1, "friction": 9.0}, {"material": "n", "friction": 0.0}
    assert coefficients_of(one, other, pair=pair, **PAIRED) == (0.75, 2.0)


def test_coefficient_missing_in_a_pair_is_mixed() -> None:
    pair = [{"between": ["m", "n"], "restitution": 0.0}]
    assert coefficients_of({"material": "m"}, {"material": "n"}, pair=pair, **PAIRED) == (0.0, 4.0)
    pair = [{"between": ["m", "n"], "friction": 0.0}]
    assert coefficients_of({"material": "m"}, {"material": "n"}, pair=pair, **PAIRED) == (0.125, 0.0)
    assert coefficients_of({"material": "m"}, {"material": "n"}, pair=[{"between": ["m", "n"]}], **PAIRED) == (
        0.125,
        4.0,
    )


def test_pair_of_a_material_with_itself_applies_to_two_such_elements() -> None:
    pair = [{"between": ["m", "m"], "restitution": 0.9}]
    assert coefficients_of({"material": "m"}, {"material": "m"}, pair=pair, **PAIRED) == (0.9, 16.0)
    assert coefficients_of({"material": "m"}, {"material": "n"}, pair=pair, **PAIRED) == (0.125, 4.0)
    assert coefficients_of({"material": "m"}, {}, pair=pair, **PAIRED) == (0.5, 4.0)


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


def test_empty_scene_has_no_surfaces() -> None:
    surfaces = pair_table(Scene(), Scene().bodies)
    assert surfaces.restitution.shape == surfaces.friction.shape == (0, 0)
