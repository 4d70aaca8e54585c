"""Surfaces: the restitution and friction of every pair."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given

from sandbox.scene.compile.contacts import mix, pair_table
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import from_document
from tests.scene.touching import coefficient, elements, touching_scenes


def of_two(a: dict[str, Any], b: dict[str, Any], **more: Any) -> tuple[float, float]:
    """Return restitution and friction of two balls."""
    at = {"position": [0.0, 0.0], "radius": 1.0}
    scene = from_document({"ball": [{**at, **a}, {**at, **b}], **more})
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
def test_figures_mix_by_the_rule(a: float | None, b: float | None, mixed: float) -> None:
    assert mix(a, b) == mixed
    one, other = ({} if x is None else {"restitution": x, "friction": x} for x in (a, b))
    assert of_two(one, other) == (mixed, mixed)


def test_figure_of_a_material_counts_as_stated_on_the_side() -> None:
    material = [{"name": "m", "restitution": 0.5, "friction": 4.0}]
    assert of_two({"material": "m"}, {}, material=material) == (0.5, 4.0)
    assert of_two({"material": "m"}, {"material": "m"}, material=material) == (0.25, 16.0)
    assert of_two({"material": "m"}, {"friction": 0.5}, material=material) == (0.5, 2.0)


def test_figure_of_a_shape_outranks_its_material_one_by_one() -> None:
    material = [{"name": "m", "restitution": 0.5, "friction": 4.0}]
    assert of_two({"material": "m", "friction": 1.0}, {}, material=material) == (0.5, 1.0)
    assert of_two({"material": "m", "restitution": 0.0}, {}, material=material) == (0.0, 4.0)


PAIRED = {
    "material": [{"name": "m", "restitution": 0.5, "friction": 4.0}, {"name": "n", "restitution": 0.25}],
}


def test_pair_outranks_materials_in_either_order() -> None:
    for between in (["m", "n"], ["n", "m"]):
        pair = [{"between": between, "restitution": 0.75, "friction": 2.0}]
        assert of_two({"material": "m"}, {"material": "n"}, pair=pair, **PAIRED) == (0.75, 2.0)
        assert of_two({"material": "n"}, {"material": "m"}, pair=pair, **PAIRED) == (0.75, 2.0)


def test_pair_outranks_figures_in_place() -> None:
    pair = [{"between": ["m", "n"], "restitution": 0.75, "friction": 2.0}]
    one, other = {"material": "m", "restitution": 0.1, "friction": 9.0}, {"material": "n", "friction": 0.0}
    assert of_two(one, other, pair=pair, **PAIRED) == (0.75, 2.0)


def test_pair_that_states_one_figure_leaves_the_other_to_the_mixing() -> None:
    pair = [{"between": ["m", "n"], "restitution": 0.0}]
    assert of_two({"material": "m"}, {"material": "n"}, pair=pair, **PAIRED) == (0.0, 4.0)
    pair = [{"between": ["m", "n"], "friction": 0.0}]
    assert of_two({"material": "m"}, {"material": "n"}, pair=pair, **PAIRED) == (0.125, 0.0)
    assert of_two({"material": "m"}, {"material": "n"}, pair=[{"between": ["m", "n"]}], **PAIRED) == (0.125, 4.0)


def test_pair_of_a_material_with_itself() -> None:
    pair = [{"between": ["m", "m"], "restitution": 0.9}]
    assert of_two({"material": "m"}, {"material": "m"}, pair=pair, **PAIRED) == (0.9, 16.0)
    assert of_two({"material": "m"}, {"material": "n"}, pair=pair, **PAIRED) == (0.125, 4.0)
    assert of_two({"material": "m"}, {}, pair=pair, **PAIRED) == (0.5, 4.0)


@given(touching_scenes())
def test_every_pair_has_the_coefficients_of_its_things(scene: Scene) -> None:
    surfaces = pair_table(scene, scene.bodies)
    things = [*elements(scene), *scene.fixed]
    number = [*surfaces.of_body, *surfaces.of_fixed]
    assert len(number) == len(things)
    for a, i in zip(things, number, strict=True):
        for b, j in zip(things, number, strict=True):
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


def test_things_alike_share_a_surface_and_materials_no_pair_names_are_not_told_apart() -> None:
    at = {"position": [0.0, 0.0], "radius": 1.0}
    materials = [{"name": "m", "friction": 0.5}, {"name": "n", "friction": 0.5}]
    balls = [{**at, "material": "m"}, {**at, "material": "n"}, {**at, "friction": 0.5}, at]
    scene = from_document({"ball": balls, "material": materials})
    assert pair_table(scene, scene.bodies).of_body.tolist() == [0, 0, 0, 1]
    scene = from_document({"ball": balls, "material": materials, "pair": [{"between": ["m", "m"]}]})
    assert pair_table(scene, scene.bodies).of_body.tolist() == [0, 1, 1, 2]


def test_scene_without_things_has_no_surfaces() -> None:
    surfaces = pair_table(Scene(), Scene().bodies)
    assert surfaces.restitution.shape == surfaces.friction.shape == (0, 0)
