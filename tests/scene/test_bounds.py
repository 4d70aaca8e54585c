"""Bounds of the numbers in a scene file: the last accepted value, and the first refused value beyond it."""

import math
from typing import Any

import pytest

from sandbox.scene.errors import SceneError
from sandbox.scene.files.load import from_document

BALL: dict[str, Any] = {"position": [0.0, 0.0], "radius": 1.0}
UP, DOWN = math.inf, -math.inf

# kind, path within it, the last value allowed, the direction in which the next float or integer is refused
BOUNDS: list[tuple[str, str, float, float]] = [
    ("world", "duration", 1e9, UP),
    ("world", "linear_drag", 0.0, DOWN),
    ("world", "linear_drag", 1e9, UP),
    ("world", "quadratic_drag", 0.0, DOWN),
    ("world", "quadratic_drag", 1e9, UP),
    ("world", "gravity.0", -1e9, DOWN),
    ("world", "gravity.1", 1e9, UP),
    ("world", "wind.0", 1e12, UP),
    ("world", "wind.1", -1e12, DOWN),
    ("world", "seed", 0, DOWN),
    ("world", "seed", 2**63 - 1, UP),
    ("solver", "dt", 1e-9, DOWN),
    ("solver", "dt", 10.0, UP),
    ("solver", "substeps", 1, DOWN),
    ("solver", "substeps", 1000, UP),
    ("solver", "iterations", 1, DOWN),
    ("solver", "iterations", 10_000, UP),
    ("solver", "slop", 0.0, DOWN),
    ("solver", "slop", 1e9, UP),
    ("solver", "bias", 0.0, DOWN),
    ("solver", "bias", 1.0, UP),
    ("solver", "persistence", 1, DOWN),
    ("solver", "persistence", 1000, UP),
    ("solver", "sleep_time", 0.0, DOWN),
    ("solver", "sleep_time", 1e6, UP),
    ("solver", "idle_speed", 0.0, DOWN),
    ("solver", "idle_speed", 1e6, UP),
    ("solver", "record_every", 1, DOWN),
    ("solver", "record_every", 1_000_000_000, UP),
    ("material", "restitution", 0.0, DOWN),
    ("material", "restitution", 1.0, UP),
    ("material", "friction", 0.0, DOWN),
    ("material", "friction", 1000.0, UP),
    ("pair", "restitution", 0.0, DOWN),
    ("pair", "restitution", 1.0, UP),
    ("pair", "friction", 0.0, DOWN),
    ("pair", "friction", 1000.0, UP),
    ("plane", "restitution", 1.0, UP),
    ("plane", "friction", 1000.0, UP),
    ("plane", "point.0", 1e16, UP),
    ("wall", "thickness", 0.0, DOWN),
    ("wall", "thickness", 1e9, UP),
    ("wall", "points.0.0", -1e16, DOWN),
    ("wall", "points.1.1", 1e16, UP),
    ("wall", "restitution", 0.0, DOWN),
    ("post", "position.1", 1e16, UP),
    ("post", "radius", 1e-9, DOWN),
    ("post", "radius", 1e9, UP),
    ("post", "friction", 0.0, DOWN),
    ("ball", "position.0", -1e16, DOWN),
    ("ball", "position.1", 1e16, UP),
    ("ball", "velocity.0", 1e12, UP),
    ("ball", "velocity.1", -1e12, DOWN),
    ("ball", "radius", 1e-9, DOWN),
    ("ball", "radius", 1e9, UP),
    ("ball", "mass", 1e-15, DOWN),
    ("ball", "mass", 1e30, UP),
    ("ball", "angle", 1e12, UP),
    ("ball", "angle", -1e12, DOWN),
    ("ball", "angular_velocity", 1e12, UP),
    ("ball", "angular_velocity", -1e12, DOWN),
    ("ball", "restitution", 0.0, DOWN),
    ("ball", "restitution", 1.0, UP),
    ("ball", "friction", 0.0, DOWN),
    ("ball", "friction", 1000.0, UP),
    ("grid", "columns", 1, DOWN),
    ("grid", "rows", 1, DOWN),
    ("grid", "columns", 1_000_000, UP),
    ("grid", "rows", 1_000_000, UP),
    ("grid", "origin.0", 1e16, UP),
    ("grid", "spacing.0", 1e16, UP),
    ("grid", "jitter", 0.0, DOWN),
    ("grid", "jitter", 1e9, UP),
    ("grid", "velocity.0", 1e12, UP),
    ("grid", "velocity_jitter", 0.0, DOWN),
    ("scatter", "count", 1, DOWN),
    ("scatter", "lower.0", -1e16, DOWN),
    ("scatter", "upper.1", 1e16, UP),
    ("scatter", "velocity.1", 1e12, UP),
    ("scatter", "velocity_jitter", 0.0, DOWN),
    ("emitter", "count", 1, DOWN),
    ("emitter", "count", 1_000_000, UP),
    ("emitter", "position.0", 1e16, UP),
    ("emitter", "velocity_min.0", -1e12, DOWN),
    ("emitter", "velocity_max.1", 1e12, UP),
]


def valid_document(kind: str) -> dict[str, Any]:
    """Return a small valid document with one element of each kind."""
    document: dict[str, Any] = {
        "world": {"gravity": [0.0, 0.0], "wind": [0.0, 0.0], "duration": 1.0},
        "solver": {},
        "material": [{"name": "m"}],
        "pair": [{"between": ["m", "m"]}],
        "wall": [{"points": [[0.0, 5.0], [1.0, 5.0]]}],
        "post": [{"position": [0.0, 9.0], "radius": 1.0}],
        "ball": [{"position": [0.0, 0.0], "velocity": [0.0, 0.0], "radius": 1.0, "collides": "none"}],
        "grid": [{"origin": [0.0, 0.0], "columns": 1, "spacing": [0.0, 0.0], "velocity": [0.0, 0.0], "radius": 1.0}],
        "scatter": [{"count": 1, "lower": [-9.0, -9.0], "upper": [9.0, 9.0], "velocity": [0.0, 0.0], "radius": 1.0}],
        "emitter": [{"position": [0.0, 0.0], "count": 1, "velocity_min": [-1.0, -1.0], "velocity_max": [1.0, 1.0]}],
    }
    if kind == "plane":
        document["plane"] = [{"point": [0.0, 0.0], "normal": [0.0, 1.0]}]
    if kind in ("grid", "scatter", "emitter"):  # alone: a million bodies and one more would exceed the limit of bodies
        document = {
            key: value for key, value in document.items() if key not in ("ball", "grid", "scatter", "emitter")
        } | {kind: document[kind]}
        document[kind][0]["collides"] = "none"
    return document


def put(document: dict[str, Any], kind: str, path: str, value: Any) -> dict[str, Any]:
    """Return the document with a value set in the first element of a kind."""
    node: Any = document[kind][0] if isinstance(document[kind], list) else document[kind]
    *keys, last = (int(key) if key.isdecimal() else key for key in path.split("."))
    for key in keys:
        node = node[key]
    node[last] = value
    if (kind, path) == ("world", "duration"):
        document["solver"]["dt"] = 10.0  # keeps the number of steps below its limit
    return document


def beyond(value: float, direction: float) -> float:
    """Return the next float, or the next integer."""
    if isinstance(value, int):
        return value + (1 if direction > 0 else -1)
    return math.nextafter(value, direction)


@pytest.mark.full
@pytest.mark.parametrize(("kind", "path", "value", "direction"), BOUNDS)
def test_value_at_a_bound_is_accepted_and_the_next_refused(
    kind: str, path: str, value: float, direction: float
) -> None:
    from_document(put(valid_document(kind), kind, path, value))
    with pytest.raises(SceneError) as caught:
        from_document(put(valid_document(kind), kind, path, beyond(value, direction)))
    fault_path = caught.value.faults[0].path
    leaf = path.split(".")[0]
    assert fault_path.startswith(kind)
    assert f".{leaf}" in fault_path


def test_every_number_of_a_ball_has_two_bounds() -> None:
    for key in ("radius", "mass", "density", "angle", "angular_velocity", "restitution", "friction"):
        for value in (1e300, -1e300):
            with pytest.raises(SceneError):
                from_document({"ball": [{**BALL, key: value}]})


def test_density_beyond_its_bounds_is_refused_though_the_mass_is_valid() -> None:
    for density, direction, radius in ((1e30, UP, 0.1), (1e-30, DOWN, 1e9)):
        from_document({"ball": [{**BALL, "radius": radius, "density": density}]})
        with pytest.raises(SceneError, match="density"):
            from_document({"ball": [{**BALL, "radius": radius, "density": beyond(density, direction)}]})


def test_duration_of_zero_is_refused_and_the_smallest_float_accepted() -> None:
    with pytest.raises(SceneError):
        from_document({"world": {"duration": 0.0}, "ball": [BALL]})
    from_document({"world": {"duration": 5e-324}, "ball": [BALL]})


@pytest.mark.parametrize("kind", ["ball", "grid", "scatter"])
def test_bound_of_velocity_is_on_the_speed_not_the_components(kind: str) -> None:
    from_document(put(valid_document(kind), kind, "velocity", [6e11, 8e11]))  # a 3-4-5 triangle
    with pytest.raises(SceneError, match="speed"):
        from_document(put(valid_document(kind), kind, "velocity", [8e11, 8e11]))


def test_mass_from_density_has_the_bounds_of_a_given_mass() -> None:
    disc = {"position": [0.0, 0.0], "radius": 1e9}
    most = 1e30 / (math.pi * 1e18)
    from_document({"ball": [{**disc, "density": most * (1 - 1e-15)}]})
    with pytest.raises(SceneError, match=r"density: gives a mass of 1e\+30 kg") as caught:
        from_document({"ball": [{**disc, "density": most * (1 + 1e-14)}]})
    assert caught.value.faults[0].path == "ball[0].density"
    with pytest.raises(SceneError, match="gives a mass"):
        from_document({"ball": [{"position": [0.0, 0.0], "radius": 1e-9, "density": 1.0}]})


def test_number_of_steps_at_the_limit_is_accepted_and_more_refused() -> None:
    from_document({"world": {"duration": 1e7}, "solver": {"dt": 0.01}, "ball": [BALL]})
    with pytest.raises(SceneError, match="steps per run") as caught:
        from_document({"world": {"duration": 1e7 + 1.0}, "solver": {"dt": 0.01}, "ball": [BALL]})
    assert caught.value.faults[0].path == "solver.dt"
    with pytest.raises(SceneError, match="steps per run"):
        from_document({"world": {"duration": 1e7}, "solver": {"dt": 0.01, "substeps": 2}, "ball": [BALL]})


@pytest.mark.parametrize("length", [1, 200])
def test_name_of_allowed_length_is_accepted(length: int) -> None:
    scene = from_document({"ball": [{**BALL, "name": "é" * length}]})
    assert scene.bodies.names == ("é" * length,)


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
        assert "\n" not in str(caught.value.faults[0])
        assert str(caught.value.faults[0]).isprintable()


@pytest.mark.parametrize("name", ["../../etc/passwd", "con", " ", "🎱", 'a"b', "a\\b", "a.b", "-", "é", "…", "x" * 200])
def test_name_of_any_other_text_is_accepted(name: str) -> None:
    assert from_document({"ball": [{**BALL, "name": name}]}).bodies.names == (name,)


def test_wall_of_two_points_is_accepted_and_of_one_refused() -> None:
    from_document({"wall": [{"points": [[0, 0], [1, 0]]}]})
    with pytest.raises(SceneError, match="2 or more") as caught:
        from_document({"wall": [{"points": [[0, 0]]}]})
    assert caught.value.faults[0].path == "wall[0].points"


def test_colour_is_six_hexadecimal_digits() -> None:
    assert from_document({"ball": [{**BALL, "colour": "#09aFcC"}]}).balls[0].colour == "#09aFcC"
    for colour in ("#09af", "09afcc", "red", "#09afcg", "#09afcc ", "#09afcc\n"):
        with pytest.raises(SceneError, match="#rrggbb"):
            from_document({"ball": [{**BALL, "colour": colour}]})


def test_lengths_of_title_and_about_are_limited() -> None:
    from_document({"title": "x" * 200, "about": "y" * 2000})
    with pytest.raises(SceneError) as caught:
        from_document({"title": "x" * 201, "about": "y" * 2001})
    assert [fault.path for fault in caught.value.faults] == ["title", "about"]
