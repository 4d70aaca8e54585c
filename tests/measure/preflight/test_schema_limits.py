"""Preflight checks at the limits of the schema: every scene gets warnings with finite numbers."""

import math
from typing import Any

import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from sandbox.measure.preflight import FAILED, largest_safe_dt, notes, warnings
from sandbox.scene.compile.scene import Scene
from sandbox.scene.errors import SceneError
from sandbox.scene.files.load import from_document

pytestmark = pytest.mark.slow  # about 10 s


def ends(low: float, high: float, *usual: float) -> st.SearchStrategy[float]:
    """Return a strategy of numbers at either end of their range, and usual ones."""
    return st.sampled_from([low, high, *usual])


def vectors(high: float, *usual: float) -> st.SearchStrategy[list[float]]:
    return st.lists(ends(-high, high, 0.0, *usual), min_size=2, max_size=2)


MASS, SIZE = ends(1e-15, 1e30, 1.0), ends(1e-9, 1e9, 0.5)
POSITION, SPEED = vectors(1e16, 1.0, -3.0), vectors(7e11, 1.0)
STIFF, DAMPING = ends(1e-300, 1e30, 5e6), ends(0.0, 1e30, 1.0)
NAMES = ["a", "b", "c"]


@st.composite
def joints(draw: st.DrawFn) -> dict[str, Any]:
    length, anchors = ends(0.0, 1e9, 1.0), st.lists(vectors(1e16, 1.0), min_size=2, max_size=2)
    angles = ends(-1e12, 1e12, 0.0)
    kinds: dict[str, dict[str, Any]] = {
        "rod": {"length": length, "anchors": anchors},
        "slide": {"most": length, "anchors": anchors},
        "pivot": {"at": POSITION},
        "spring": {"stiffness": STIFF, "damping": DAMPING, "rest_length": length, "anchors": anchors},
        "rotary_spring": {"stiffness": STIFF, "damping": DAMPING, "rest_angle": angles},
        "motor": {"rate": angles},
        "gear": {"ratio": ends(-1e6, 1e6, 1.0)},
        "ratchet": {"ratchet": ends(-1e12, 1e12, 1.0), "phase": angles},
    }
    kind = draw(st.sampled_from(sorted(kinds)))
    between = draw(st.lists(st.sampled_from(NAMES), min_size=1, max_size=2, unique=True))
    is_limited = kind in ("rod", "slide", "pivot", "gear", "ratchet")
    limits = {key: ends(0.0, 1e42, 1.0) for key in ("max_force", "max_bias") if is_limited}
    return {"kind": kind, "between": between, **draw(st.fixed_dictionaries(kinds[kind], optional=limits))}


@st.composite
def documents(draw: st.DrawFn) -> dict[str, Any]:
    state = {"velocity": SPEED, "angle": ends(-1e12, 1e12, 0.1), "mass": MASS}
    surface = {"restitution": ends(0.0, 1.0, 0.5), "friction": ends(0.0, 1000.0, 0.5)}
    shapes = [("ball", {"radius": SIZE}), ("box", {"size": st.lists(SIZE, min_size=2, max_size=2)})]
    document: dict[str, Any] = {"ball": [], "box": []}
    for name in NAMES:
        kind, shape = draw(st.sampled_from(shapes))
        body = draw(st.fixed_dictionaries({"position": POSITION, **shape}, optional={**state, **surface}))
        document[kind].append({"name": name, **body})
    document["joint"] = draw(st.lists(joints(), max_size=3))
    document["plane"] = draw(
        st.lists(st.fixed_dictionaries({"point": POSITION, "normal": st.just([0, 1])}, optional=surface), max_size=1)
    )
    points = st.lists(vectors(1e16, 1.0, 2.0, 3.0), min_size=2, max_size=2)
    document["wall"] = draw(
        st.lists(st.fixed_dictionaries({"points": points, "thickness": ends(0.0, 1e9, 0.1)}), max_size=1)
    )
    document["zone"] = draw(st.lists(st.fixed_dictionaries({"position": POSITION, "radius": SIZE}), max_size=1))
    document["thrust"] = draw(
        st.lists(st.fixed_dictionaries({"body": st.sampled_from(NAMES), "force": vectors(1e30, 1.0)}), max_size=1)
    )
    attraction = {"toward": POSITION | st.sampled_from(NAMES), "strength": ends(-1e30, 1e30, 10.0)}
    document["attraction"] = draw(
        st.lists(st.fixed_dictionaries(attraction, optional={"softening": ends(0.0, 1e9, 1.0)}), max_size=1)
    )
    document["world"] = draw(
        st.fixed_dictionaries(
            {"duration": ends(1e-9, 1e9, 3.0)},
            optional={
                "gravity": vectors(1e9, -9.81),
                "wind": SPEED,
                "linear_drag": ends(0.0, 1e9, 1.0),
                "quadratic_drag": ends(0.0, 1e9, 1.0),
            },
        )
    )
    schemes = ["explicit_euler", "semi_implicit_euler", "velocity_verlet", "leapfrog", "rk4"]
    document["solver"] = draw(
        st.fixed_dictionaries(
            {"dt": ends(1e-9, 10.0, 0.001)},
            optional={
                "substeps": st.sampled_from([1, 1000]),
                "iterations": st.sampled_from([1, 10, 10_000]),
                "bias": ends(0.0, 1.0, 0.1),
                "integrator": st.sampled_from(schemes),
                "detection": st.sampled_from(["discrete", "bisect", "swept", "shrink"]),
                "joints": st.sampled_from(["impulses", "relaxation", "xpbd", "rattle"]),
            },
        )
    )
    return {key: value for key, value in document.items() if value != []}


def assert_finite_answers(scene: Scene) -> None:
    safe = largest_safe_dt(scene)
    assert safe is None or safe > 0.0
    for each in (*warnings(scene), *notes(scene)):
        assert each.kind != FAILED, each.message
        assert "nan" not in each.message
        assert all(isinstance(v, str) or math.isfinite(v) for v in each.details.values()), each


# Many combinations are contradictory and no valid scenes; the schema rejects these.
@settings(max_examples=300, suppress_health_check=[HealthCheck.filter_too_much])
@given(documents())
def test_scene_at_the_limits_of_the_schema_gets_finite_answers(document: dict[str, Any]) -> None:
    try:
        scene = from_document(document)
    except SceneError:
        assume(False)
    assert_finite_answers(scene)


@pytest.mark.parametrize("stiffness", [5e6, 1e30])
def test_explicit_euler_on_a_stiff_spring_gets_finite_answers(stiffness: float) -> None:
    ball = {"name": "a", "position": [1.0, 0.0], "radius": 0.1}
    spring = {"kind": "spring", "between": ["a"], "stiffness": stiffness, "anchors": [[0, 0], [0, 0]]}
    solver = {"dt": 0.001, "integrator": "explicit_euler"}
    scene = from_document({"ball": [ball], "joint": [spring], "solver": solver})
    assert_finite_answers(scene)
    assert "spring" in [each.kind for each in warnings(scene)]
