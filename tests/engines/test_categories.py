"""Collision categories: two objects collide if the mask of each has a category of the other, on every engine."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import sandbox
from sandbox.action import ActionError, Spawn
from sandbox.engines.common.collision_bits import bits_of_body, bits_of_static
from sandbox.engines.contract import Refusal
from sandbox.measure.metrics.contacts import max_penetration
from sandbox.measure.preflight.checks import warnings
from sandbox.scene.compile.contacts import contact_matrix
from sandbox.scene.compile.filters import filter_table
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.discs import Ball
from sandbox.scene.errors import SceneError
from sandbox.scene.files.load import from_document
from tests.engines.stepping import advance

pytestmark = pytest.mark.fail_slow(60)  # many runs of seconds

every_engine = pytest.mark.parametrize("engine", ["pymunk", "box2d", "reference"])

NAMES = ("player", "enemy", "shot")
LISTS = st.none() | st.lists(st.sampled_from(NAMES), unique=True)
FILTERS = st.fixed_dictionaries({"categories": LISTS, "mask": LISTS}).map(
    lambda values: {key: names for key, names in values.items() if names is not None}
)

Filter = dict[str, Sequence[str]]


def collide(first: Filter, second: Filter) -> bool:
    """Return whether two filters allow a collision: the definition, by names."""

    def accepts(one: Filter, other: Filter) -> bool:
        return bool(set(one.get("mask", NAMES)) & set(other.get("categories", NAMES)))

    return accepts(first, second) and accepts(second, first)


def scene_with(duration: float = 0.5, **tables: Any) -> Scene:
    # a far body names every category, so that an object without categories belongs to several
    named = {"position": [0.0, 50.0], "radius": 0.1, "categories": list(NAMES), "name": "far"}
    balls = [*tables.pop("ball", []), named]
    return from_document({"world": {"duration": duration}, "solver": {"dt": 0.005}, "ball": balls, **tables})


def ball(x: float, vx: float = 0.0, **more: Any) -> dict[str, Any]:
    return {"position": [x, 0.0], "velocity": [vx, 0.0], "radius": 0.1, "restitution": 1.0, **more}


@every_engine
@given(first=FILTERS, second=FILTERS)
def test_balls_exchange_velocities_only_if_their_filters_allow_it(engine: str, first: Filter, second: Filter) -> None:
    scene = scene_with(ball=[ball(0.0, 2.0, **first), ball(0.5, **second)])
    end = sandbox.run(scene, engine).velocity[-1, :2, 0]
    expected = (0.0, 2.0) if collide(first, second) else (2.0, 0.0)
    assert end == pytest.approx(expected, abs=1e-5)  # 32-bit rounding in Box2D


@every_engine
@pytest.mark.parametrize(
    "collider",
    [
        {"plane": {"point": [0.5, 0.0], "normal": [-1.0, 0.0]}},
        {"wall": {"points": [[0.5, -1.0], [0.5, 1.0]], "thickness": 0.1}},
        {"post": {"position": [0.6, 0.0], "radius": 0.1}},
        {"box": {"position": [0.6, 0.0], "size": [0.2, 2.0], "fixed": True}},
    ],
    ids=lambda each: next(iter(each)),
)
@given(first=FILTERS, second=FILTERS)
@settings(max_examples=15)
def test_static_objects_stop_only_balls_that_their_filters_name(
    engine: str, collider: dict[str, Any], first: Filter, second: Filter
) -> None:
    ((kind, values),) = collider.items()
    scene = scene_with(ball=[ball(0.0, 2.0, **first)], **{kind: [{**values, "restitution": 1.0, **second}]})
    speed = sandbox.run(scene, engine).velocity[-1, 0, 0]
    assert speed == pytest.approx(-2.0 if collide(first, second) else 2.0, abs=1e-5)  # 32-bit rounding in Box2D


@given(
    filters=st.lists(FILTERS, min_size=2, max_size=6),
    walls=st.lists(FILTERS, min_size=1, max_size=3),
    layers=st.lists(st.sampled_from(["ground", "ramp"]), min_size=6, max_size=6),
    kinds=st.lists(st.sampled_from(["all", "fixed", "none"]), min_size=6, max_size=6),
)
def test_bits_of_engines_state_the_relation_of_the_contact_matrix(
    filters: list[Filter], walls: list[Filter], layers: list[str], kinds: list[str]
) -> None:
    balls = [
        ball(float(k), layer=layers[k], collides=kinds[k], restitution=0.1 * (k + 1), **each)
        for k, each in enumerate(filters)
    ]
    segments = [
        {"points": [[-1.0, -9.0 - k], [1.0, -9.0 - k]], "layers": [layers[k]], **each} for k, each in enumerate(walls)
    ]
    scene = scene_with(ball=balls, wall=segments)
    matrix, bodies = contact_matrix(scene), scene.bodies
    bits = [bits_of_body(scene, bodies, k, int(bodies.layer[k])) for k in range(len(balls))]
    static = [bits_of_static(scene, each) for each in scene.walls]
    meets = filter_table(scene, bodies)
    for i in range(len(balls)):
        for j in range(i + 1, len(balls)):
            by_bits = bool(bits[i][0] & bits[j][1]) and bool(bits[j][0] & bits[i][1])
            # each ball has a surface of its own, so that pairs of surfaces are pairs of bodies
            a, b = matrix.surfaces.of_body[[i, j]]
            assert by_bits == matrix.touching[a, b]
            if kinds[i] == kinds[j] == "all":
                assert by_bits == meets.meets(np.asarray([i]), np.asarray([j]))[0]
        for k in range(len(walls)):
            by_bits = bool(bits[i][0] & static[k][1]) and bool(static[k][0] & bits[i][1])
            if kinds[i] != "none":  # engines give those no shape
                assert by_bits == meets.meets_fixed(k)[i]


def test_filtered_overlaps_are_neither_warned_of_nor_measured() -> None:
    ghost = ball(0.05, categories=["enemy"], mask=["enemy"])
    scene = scene_with(
        ball=[ball(0.0, categories=["player"]), ghost], post=[{"position": [0.0, 0.0], "radius": 0.2, "mask": ["shot"]}]
    )
    assert not [each for each in warnings(scene) if each.kind == "overlap"]
    assert max_penetration(sandbox.run(scene, "reference"), scene).max() == 0.0
    seen = scene_with(ball=[ball(0.0, categories=["player"]), ball(0.05, categories=["enemy"])])
    assert [each.details["pairs"] for each in warnings(seen) if each.kind == "overlap"] == [1]


def test_tunnelling_is_forecast_only_through_objects_that_can_be_hit() -> None:
    wall = {"points": [[5.0, -1.0], [5.0, 1.0]], "thickness": 0.01}
    bullet = ball(0.0, 500.0, categories=["shot"])

    def hit(wall: dict[str, Any]) -> list[object]:
        found = warnings(from_document({"ball": [bullet], "wall": [wall]}))
        return [each.details["thing"] for each in found if each.kind == "tunnelling"]

    assert "wall-1" in hit(wall)
    assert "wall-1" not in hit({**wall, "mask": ["player"]})


@every_engine
@pytest.mark.parametrize("mask", [["player"], None], ids=["passes", "hits"])
def test_passages_that_filters_allow_are_no_missed_contacts(engine: str, mask: list[str] | None) -> None:
    values = {} if mask is None else {"mask": mask}
    target = ball(1.0, categories=["shot"], **values)
    wall = {"points": [[2.0, -1.0], [2.0, 1.0]], **values}
    plane = {"point": [4.0, 0.0], "normal": [-1.0, 0.0], **values}
    bullet = ball(0.0, 200.0, categories=["enemy"], mask=["shot", "enemy", "player"])
    scene = from_document(
        {"world": {"duration": 0.1}, "solver": {"dt": 0.02}, "ball": [bullet, target], "wall": [wall], "plane": [plane]}
    )
    missed = len(sandbox.run(scene, engine, continuous=False if engine == "box2d" else None).missed_time)
    assert (missed == 0) == (mask is not None)


def test_engines_name_the_categories_that_their_filters_have_no_bits_for() -> None:
    def scene_of(count: int) -> Scene:
        return from_document({"ball": [ball(float(k), categories=[f"c{k}"]) for k in range(count)]})

    sandbox.start(scene_of(10), "pymunk")
    with pytest.raises(Refusal, match=r"11 categories are not supported; its collision filters have bits for 10"):
        sandbox.start(scene_of(11), "pymunk")
    sandbox.start(scene_of(21), "box2d")
    with pytest.raises(Refusal, match="bits for 21"):
        sandbox.start(scene_of(22), "box2d")
    sandbox.start(scene_of(32), "reference")
    with pytest.raises(SceneError, match="33 categories; the limit is 32"):
        scene_of(33)
    with pytest.raises(Refusal, match="categories"):
        sandbox.start(scene_of(2), "exact")


@every_engine
def test_spawned_bodies_collide_by_their_categories(engine: str) -> None:
    simulation = sandbox.start(scene_with(ball=[ball(0.0, 2.0, categories=["player"])]), engine)
    spawned = Ball(position=(0.5, 0.0), radius=0.1, restitution=1.0, categories=("enemy",), mask=("enemy",), name="new")
    simulation.apply(Spawn(time=0, ball=spawned))
    with pytest.raises(ActionError, match="no category is named 'friend'; categories of the scene: player"):
        simulation.apply(Spawn(time=0, ball=Ball(position=(0.0, 5.0), radius=0.1, categories=("friend",))))
    advance(simulation, 100)
    assert simulation.frame().velocity[0, 0] == pytest.approx(2.0, abs=1e-5)  # 32-bit rounding in Box2D


@pytest.mark.parametrize("key", ["categories", "mask"])
def test_categories_that_are_no_list_are_refused_with_an_example(key: str) -> None:
    with pytest.raises(SceneError, match=r'must be an array of names, such as \["a", "b"\], is "all"'):
        from_document({"ball": [ball(0.0, **{key: "all"})]})


def test_a_surface_has_no_categories() -> None:
    with pytest.raises(SceneError, match=r"has a \[surface\] and the category 'player'"):
        from_document({"surface": {"sliding_friction": 0.2}, "ball": [ball(0.0, categories=["player"])]})
