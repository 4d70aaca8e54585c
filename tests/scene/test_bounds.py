"""Bounds of a scene file: the last accepted number, and the first refused one beyond it; lengths of names and texts."""

import math
from collections.abc import Iterator
from typing import Any

import pytest
from pydantic import BaseModel, ValidationError

from sandbox.scene.compile.scene import Scene
from sandbox.scene.errors import SceneError
from sandbox.scene.files.json_schema import schema
from sandbox.scene.files.load import from_document
from tests.scene.faults import assert_faults, fault_paths
from tests.scene.models import models

BALL: dict[str, Any] = {"position": [0.0, 0.0], "radius": 1.0}
GRID: dict[str, Any] = {"origin": [0.0, 0.0], "columns": 1, "spacing": [0.0, 0.0], "radius": 1.0}
SCATTER: dict[str, Any] = {"count": 1, "lower": [-9.0, -9.0], "upper": [9.0, 9.0], "radius": 1.0}
EMITTER: dict[str, Any] = {"position": [0.0, 0.0], "count": 1, "velocity_min": [-1.0, -1.0], "velocity_max": [1.0, 1.0]}
SCHEMA = schema()


def beyond(value: float, direction: float) -> float:
    """Return the next float, or the next integer."""
    return value + int(direction) if isinstance(value, int) else math.nextafter(value, direction * math.inf)


def limits(node: dict[str, Any]) -> Iterator[tuple[float, float]]:
    """Yield the last accepted and the first refused number at each bound of a schema."""
    for key, direction in (("minimum", -1), ("maximum", 1)):
        kind = int if node["type"] == "integer" else float
        if key in node:
            yield kind(node[key]), beyond(kind(node[key]), direction)
        if (excluded := f"exclusive{key.capitalize()}") in node:
            yield beyond(kind(node[excluded]), -direction), kind(node[excluded])


def values_at_bounds(node: dict[str, Any]) -> Iterator[tuple[Any, Any, tuple[int, ...]]]:
    """Yield an accepted value, a refused one, and the place of the fault within it, for each bound of a schema."""
    if node.get("type") in ("number", "integer"):
        yield from ((good, bad, ()) for good, bad in limits(node))
    elif node.get("type") == "array":
        items = node.get("prefixItems") or [node.get("items", {})] * node.get("minItems", 1)
        plain = [next((good for good, _, _ in values_at_bounds(item)), 0.0) for item in items]
        for k, item in enumerate(items):
            for good, bad, place in values_at_bounds(item):
                yield [*plain[:k], good, *plain[k + 1 :]], [*plain[:k], bad, *plain[k + 1 :]], (k, *place)


def places_of_faults(model: type[BaseModel], key: str, value: Any) -> set[tuple[int | str, ...]]:
    """Return the places of the faults in the value of a key; faults of other keys are left out."""
    try:
        model.model_validate({key: _in_tuples(value)})
    except ValidationError as error:
        places = (tuple(each["loc"]) for each in error.errors() if each["loc"][:1] == (key,))
        return {tuple(part for part in place if isinstance(part, int)) for place in places}
    return set()


def _in_tuples(value: Any) -> Any:
    return tuple(map(_in_tuples, value)) if isinstance(value, list) else value


@pytest.mark.parametrize("model", models(), ids=lambda model: model.__name__)
def test_number_at_a_bound_of_the_schema_is_accepted_and_the_next_refused(model: type[BaseModel]) -> None:
    table = SCHEMA if model is Scene else SCHEMA["$defs"][model.__name__]
    for key, node in table["properties"].items():
        for good, bad, place in values_at_bounds(node):
            assert place not in places_of_faults(model, key, good), (key, good)
            assert place in places_of_faults(model, key, bad), (key, bad)


def test_bounds_of_the_schema_are_found_in_numbers_vectors_and_lists_of_points() -> None:
    counts = {name: sum(1 for node in SCHEMA["$defs"][name]["properties"].values() for _ in values_at_bounds(node))
              for name in ("World", "Wall", "Ball")}  # fmt: skip
    assert counts["World"] >= 20 and counts["Wall"] >= 16 and counts["Ball"] >= 24


def test_bound_of_velocity_is_on_the_speed_not_the_components() -> None:
    for kind, element, key in (
        ("ball", BALL, "velocity"),
        ("grid", GRID, "velocity"),
        ("scatter", SCATTER, "velocity"),
        ("emitter", EMITTER, "velocity_max"),
    ):
        from_document({kind: [{**element, key: [6e11, 8e11]}]})  # a 3-4-5 triangle
        assert_faults({kind: [{**element, key: [8e11, 8e11]}]}, f"{kind}[0].{key}: speed")
        for most in ([1e12, 0.0], [0.0, 1e12]):
            from_document({kind: [{**element, key: most}]})
            fast = [beyond(each, 1) if each else 0.0 for each in most]
            assert fault_paths({kind: [{**element, key: fast}]})[0].startswith(f"{kind}[0].{key}")
    from_document({"world": {"wind": [0.0, -1e12]}})
    assert fault_paths({"world": {"wind": [0.0, beyond(-1e12, -1)]}})[0].startswith("world.wind")


def test_density_beyond_its_bounds_is_refused_though_the_mass_is_valid() -> None:
    for density, direction, radius in ((1e30, 1, 0.1), (1e-30, -1, 1e9)):
        from_document({"ball": [{**BALL, "radius": radius, "density": density}]})
        with pytest.raises(SceneError, match="density"):
            from_document({"ball": [{**BALL, "radius": radius, "density": beyond(density, direction)}]})


def test_mass_from_density_has_the_bounds_of_a_given_mass() -> None:
    disc = {"position": [0.0, 0.0], "radius": 1e9}
    most = 1e30 / (math.pi * 1e18)
    from_document({"ball": [{**disc, "density": most * (1 - 1e-15)}]})
    assert_faults({"ball": [{**disc, "density": most * (1 + 1e-14)}]}, "ball[0].density: gives a mass of 1e+30 kg")
    assert_faults({"ball": [{**disc, "radius": 1e-9, "density": 1.0}]}, "ball[0].density: gives a mass")


def test_number_of_steps_at_the_limit_is_accepted_and_more_refused() -> None:
    from_document({"world": {"duration": 1e7}, "solver": {"dt": 0.01}, "ball": [BALL]})
    for duration, substeps in ((1e7 + 1.0, 1), (1e7, 2)):
        solver = {"dt": 0.01, "substeps": substeps}
        assert_faults({"world": {"duration": duration}, "solver": solver}, "solver.dt: steps per run")


@pytest.mark.parametrize(
    "name", ["", "x" * 201, "a\x00b", "a\tb", "a\nb", "line\n", "\x1b[31m", "a\x7f", "a\x85", "a\u2028", "a\u2029b"]
)
def test_name_that_is_empty_too_long_or_has_control_characters_is_refused(name: str) -> None:
    for document in (
        {"ball": [{**BALL, "name": name}]},
        {"ball": [BALL], "material": [{"name": name}]},
        {"ball": [BALL], "post": [{"position": [0, 9], "radius": 1, "name": name}]},
    ):
        with pytest.raises(SceneError) as caught:
            from_document(document)
        assert caught.value.faults[0].path.endswith(".name")
        assert str(caught.value.faults[0]).isprintable()


@pytest.mark.parametrize(
    "name", ["../../etc/passwd", "con", " ", "🎱", 'a"b', "a\\b", "a.b", "-", "é", "…", "x" * 200, "é" * 200]
)
def test_name_of_any_other_text_is_accepted(name: str) -> None:
    assert from_document({"ball": [{**BALL, "name": name}]}).bodies.names == (name,)


def test_wall_of_two_points_is_accepted_and_of_one_refused() -> None:
    from_document({"wall": [{"points": [[0, 0], [1, 0]]}]})
    assert_faults({"wall": [{"points": [[0, 0]]}]}, "wall[0].points: 2 or more")


def test_colour_is_six_hexadecimal_digits() -> None:
    assert from_document({"ball": [{**BALL, "colour": "#09aFcC"}]}).balls[0].colour == "#09aFcC"
    for colour in ("#09af", "09afcc", "red", "#09afcg", "#09afcc ", "#09afcc\n"):
        assert_faults({"ball": [{**BALL, "colour": colour}]}, "ball[0].colour: #rrggbb")


def test_lengths_of_title_and_about_are_limited() -> None:
    from_document({"title": "x" * 200, "about": "y" * 2000})
    assert fault_paths({"title": "x" * 201, "about": "y" * 2001}) == ["title", "about"]
