"""SetParameter in a running scene: only one part is re-read, with the same result as re-reading the whole scene."""

from typing import Any

import pytest

from sandbox.action import ActionError, SetParameter, Spawn, Switch
from sandbox.engines.common import actions as actions_module
from sandbox.engines.contract import Exhaustion
from sandbox.engines.registry import able
from sandbox.engines.switching import start
from sandbox.recording import Recording
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.discs import Ball
from sandbox.scene.description.world import Settings
from sandbox.scene.files.document import to_document
from sandbox.scene.files.load import from_document, load
from sandbox.scene.files.overrides import assign, change_value
from sandbox.scene.files.shipped_scenes import find
from tests.engines.stepping import advance

pytestmark = pytest.mark.fail_slow(60)  # hundreds of combinations

SCENES = (
    "benchmark/incline",
    "billiards/9-ball",
    "games/curling",
    "games/landing",
    "joints/cloth",
    "joints/ragdoll_stairs",
    "pinball/classic",
    "tutorial/bounce",
)
"""Scenes of every kind: balls, boxes, surfaces, pucks, nets, zones, drives, drag."""

TABLES = (
    "material", "plane", "wall", "post", "ball", "grid", "box", "capsule", "polygon", "stack", "cloth", "ragdoll",
)  # fmt: skip


def parameters_of(scene: Scene) -> list[tuple[str, Any]]:
    """Return the parameters that can be set while a scene runs, with new values."""
    found: list[tuple[str, Any]] = [("world.wind", [1.0, 0.5])]
    if scene.surface is None:
        found += [("world.gravity", [0.3, -5.0]), ("world.linear_drag", 0.25), ("world.quadratic_drag", 0.02)]
        if not (scene.drives or scene.world.has_drag):  # pymunk models damping without them only
            found.append(("world.damping", 0.8))
    else:
        found.append(("surface.sliding_friction", 0.03))
        if scene.surface.bodies == "pucks":
            found.append(("surface.curl", 0.4))
    document = to_document(scene)
    for table in TABLES:
        elements = document.get(table, [])
        if elements:
            found += [(f"{table}.*.restitution", 0.4), (f"{table}.{len(elements) - 1}.friction", 0.37)]
            if "name" in elements[0]:
                found.append((f'{table}."{elements[0]["name"]}".restitution', 0.23))
    return found


def cases() -> list[tuple[str, str, Any]]:
    """Return each kind of parameter once, with the first scene that has it; paths by index, by name and by `*`."""
    found: dict[str, tuple[str, str, Any]] = {}
    for name in SCENES:
        for path, value in parameters_of(load(find(name))):
            table, *middle, key = path.split(".")
            form = "" if not middle else "*" if middle[0] == "*" else "index" if middle[0].isdigit() else "name"
            found.setdefault(f"{table} {key}", (name, path, value))
            found.setdefault(form, (name, path, value))
    return [case for k, case in enumerate(found.values()) if case not in list(found.values())[:k]]


CASES = cases()


@pytest.mark.parametrize(("name", "path", "value"), CASES)
def test_changed_value_equals_that_of_a_re_read_scene(name, path, value):
    scene = load(find(name))
    changed = change_value(scene, path, value)
    assert changed == from_document(assign(to_document(scene), path, value)[0])
    assert changed != scene
    assert changed.elements == from_document(to_document(changed)).elements


def outcome(name: str, engine: str, path: str, value: Any) -> str:
    """Return the state hash after some steps, a change and more steps, or the message of a refusal."""
    try:
        simulation = start(load(find(name)), engine)
        advance(simulation, 10)
        simulation.apply(SetParameter(time=0.0, path=path, value=value))
        advance(simulation, 20)
    except (ActionError, Exhaustion) as error:
        return str(error)
    return simulation.state_hash()


@pytest.mark.parametrize(
    ("engine", "name", "path", "value"), [(engine, *case) for case in CASES for engine in able(load(find(case[0])))]
)
def test_run_continues_as_if_the_whole_scene_were_re_read(engine, name, path, value, monkeypatch):
    quick = outcome(name, engine, path, value)

    def refuse(*_: Any) -> Scene:
        raise ValueError

    monkeypatch.setattr(actions_module, "change_value", refuse)
    assert outcome(name, engine, path, value) == quick


@pytest.mark.parametrize(("name", "path", "value"), CASES)
def test_valid_value_is_set_without_re_reading_the_whole_scene(name, path, value, monkeypatch):
    """The cost of a change does not depend on the size of the scene; this is a deterministic check of it."""
    simulation = start(load(find(name)))

    def refuse(*_: Any) -> Scene:
        raise AssertionError("the whole scene was read again")

    monkeypatch.setattr(actions_module, "from_session", refuse)
    simulation.apply(SetParameter(time=0.0, path=path, value=value))
    assert to_document(simulation.scene) == assign(to_document(load(find(name))), path, value)[0]


BOUNCE, POOL = "tutorial/bounce", "billiards/9-ball"
INVALID_VALUES: list[tuple[str, str, Any]] = [
    *((BOUNCE, "world.gravity", value) for value in ("down", [0.0], [0.0, 1e300], 3)),
    *((BOUNCE, "world.linear_drag", value) for value in (-1.0, True)),
    *((BOUNCE, "world.damping", value) for value in (0.0, 1.5)),
    (BOUNCE, "world.wind", [1.0, 2.0, 3.0]),
    (BOUNCE, "ball.*.restitution", 1.5),
    *(
        (BOUNCE, path, 0.5)
        for path in (
            "ball.nobody.restitution", "ball.17.restitution", "ball.restitution", "ball.0.0.friction", "ball..friction",
            "box.*.friction", "nothing.friction", "friction", "world.friction", "world.duration", "ball.0.mass",
            "surface.sliding_friction",
        )
    ),
    ("benchmark/pile", "material.pebble.friction", "much"),
    ("pinball/classic", "wall.*.restitution", 2.0),
    *((POOL, "surface.sliding_friction", value) for value in (-0.5, 0.0)),
    (POOL, "surface.curl", 0.5),
    (POOL, "world.gravity", [0.0, -1.0]),
    ("games/curling", "world.linear_drag", 0.5),
    *((name, "world.damping", 0.5) for name in ("games/curling", "joints/cloth", "pinball/classic")),
]  # fmt: skip


@pytest.mark.parametrize(("name", "path", "value"), INVALID_VALUES)
def test_invalid_value_is_refused_with_the_message_of_a_re_read_scene(name, path, value, monkeypatch):
    def refusal() -> str | None:
        simulation = start(load(find(name)))
        before, scene = simulation.state_hash(), simulation.scene
        try:
            simulation.apply(SetParameter(time=0.0, path=path, value=value))
        except ActionError as error:
            assert simulation.scene is scene
            assert simulation.state_hash() == before
            return str(error)
        return None

    quick = refusal()

    def refuse(*_: Any) -> Scene:
        raise ValueError

    monkeypatch.setattr(actions_module, "change_value", refuse)
    assert refusal() == quick
    if (name, path) != (POOL, "surface.sliding_friction") or value:
        assert quick is not None


@pytest.mark.parametrize(
    ("name", "path", "hint"),
    [
        ("pinball/classic", "pinball.bumper.'left bumper'.restitution", "post.left bumper.restitution"),
        ("billiards/9-ball", "billiards.cushion.restitution", "wall.lower cushion.restitution"),
        ("artillery/duel", "terrain.friction", "wall.terrain.friction"),
        ("tutorial/bounce", "terrain.friction", "ball.ball.friction"),
    ],
)
def test_path_of_an_expanded_preset_is_refused_with_a_hint(name, path, hint):
    simulation = start(load(find(name)))
    with pytest.raises(ActionError, match="running scene") as refused:
        simulation.apply(SetParameter(time=0.0, path=path, value=0.5))
    assert hint in str(refused.value)


@pytest.mark.parametrize(
    ("path", "value", "message"),
    [
        ("ball.late.restitution", 2, "between 0 and 1"),
        ("ball.late.friction", -1.0, "between 0 and 1000"),
        ("ball.late.friction", "x" * 1000, "a number"),
        ("ball.late.restitution", True, "a number"),
        ("box.late.restitution", 0.5, "ball.late.restitution"),
        ("ball.1.restitution", 0.5, "ball.late"),
        ("ball.later.restitution", 0.5, "ball.late"),
    ],
)
def test_invalid_value_of_a_spawned_body_is_refused_with_the_message_of_a_scene(path, value, message):
    simulation = start(load(find("tutorial/bounce")))
    simulation.apply(Spawn(time=0.0, ball=Ball(name="late", position=(50.0, 50.0), radius=0.1)))
    with pytest.raises(ActionError) as refused:
        simulation.apply(SetParameter(time=0.0, path=path, value=value))
    assert str(refused.value).startswith(f"{path}: ")
    assert message in str(refused.value)
    assert len(str(refused.value)) < 200


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("dt", -1.0, "more than 0"),
        ("dt", "fast", "a number"),
        ("integrator", "none", "one of"),
        ("steps", 3, "unknown key"),
    ],
)
def test_invalid_setting_of_a_switch_is_refused_with_the_message_of_a_scene(key, value, message):
    simulation = start(load(find("tutorial/bounce")))
    with pytest.raises(ActionError, match=f"^solver.{key}: .*{message}"):
        simulation.apply(Switch(time=0.0, settings={key: value}))


def test_new_session_keeps_its_zero_duration():
    scene = load(find("tutorial/bounce"))
    new_session = Recording(scene, "pymunk", Settings(), (), 0.0).whole_scene
    simulation = start(new_session)
    simulation.apply(SetParameter(time=0.0, path="world.gravity", value=[0.0, -1.0]))
    assert simulation.scene.world.duration == 0.0
    assert simulation.scene.world.gravity == (0.0, -1.0)
