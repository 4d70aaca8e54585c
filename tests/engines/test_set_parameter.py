"""Setting a value while a scene runs: one part is read again, with the outcome of reading the whole scene."""

from typing import Any

import pytest

from sandbox.action import ActionError, SetParameter, Spawn, Switch
from sandbox.engines.common import actions as surroundings
from sandbox.engines.contract import Exhaustion, Refusal
from sandbox.engines.registry import ENGINES
from sandbox.engines.switching import start
from sandbox.recording import Recording
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.discs import Ball
from sandbox.scene.description.world import Settings
from sandbox.scene.files.document import to_document
from sandbox.scene.files.load import from_document, load
from sandbox.scene.files.overrides import assign, change_value
from sandbox.scene.files.shipped_scenes import find

pytestmark = pytest.mark.full  # hundreds of combinations

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
"""Of every kind: balls, boxes, floors, pucks, nets, zones, drives, drag."""

HEADINGS = (
    "material",
    "plane",
    "wall",
    "post",
    "ball",
    "grid",
    "box",
    "capsule",
    "polygon",
    "stack",
    "cloth",
    "ragdoll",
)


def settings_of(scene: Scene) -> list[tuple[str, Any]]:
    """Return values that can be set in a scene while it runs."""
    found: list[tuple[str, Any]] = [("world.wind", [1.0, 0.5])]
    if scene.surface is None:
        found += [("world.gravity", [0.3, -5.0]), ("world.linear_drag", 0.25), ("world.quadratic_drag", 0.02)]
    else:
        found.append(("surface.sliding_friction", 0.03))
        if scene.surface.bodies == "pucks":
            found.append(("surface.curl", 0.4))
    document = to_document(scene)
    for heading in HEADINGS:
        elements = document.get(heading, [])
        if elements:
            found += [(f"{heading}.*.restitution", 0.4), (f"{heading}.{len(elements) - 1}.friction", 0.37)]
            if "name" in elements[0]:
                found.append((f'{heading}."{elements[0]["name"]}".restitution', 0.23))
    return found


CASES = [(name, path, value) for name in SCENES for path, value in settings_of(load(find(name)))]


@pytest.mark.parametrize(("name", "path", "value"), CASES)
def test_changed_value_is_what_reading_the_whole_scene_gives(name, path, value):
    scene = load(find(name))
    changed = change_value(scene, path, value)
    assert changed == from_document(assign(to_document(scene), path, value)[0])
    assert changed != scene
    assert changed.elements == from_document(to_document(changed)).elements


def ends(name: str, engine: str, path: str, value: Any) -> str:
    """Return the state after some steps, a change, and some more; or why there is none."""
    try:
        relay = start(load(find(name)), engine)
        for _ in range(10):
            relay.step()
        relay.apply(SetParameter(time=0.0, path=path, value=value))
        for _ in range(20):
            relay.step()
    except (Refusal, ActionError, Exhaustion) as error:
        return str(error)
    return relay.state_hash()


@pytest.mark.parametrize(("name", "path", "value"), CASES)
@pytest.mark.parametrize("engine", ENGINES)
def test_run_goes_on_as_if_the_whole_scene_had_been_read(engine, name, path, value, monkeypatch):
    quick = ends(name, engine, path, value)

    def refuse(*_: Any) -> Scene:
        raise ValueError

    monkeypatch.setattr(surroundings, "change_value", refuse)
    assert ends(name, engine, path, value) == quick


@pytest.mark.parametrize(("name", "path", "value"), CASES)
def test_value_that_is_right_is_set_without_reading_the_whole_scene(name, path, value, monkeypatch):
    """What a change costs is not the size of the scene: no test of time tells that as surely."""
    relay = start(load(find(name)))

    def refuse(*_: Any) -> Scene:
        raise AssertionError("the whole scene was read again")

    monkeypatch.setattr(surroundings, "from_session", refuse)
    relay.apply(SetParameter(time=0.0, path=path, value=value))
    assert to_document(relay.scene) == assign(to_document(load(find(name))), path, value)[0]


WRONG: list[tuple[str, str, Any]] = [
    ("tutorial/bounce", "world.gravity", "down"),
    ("tutorial/bounce", "world.gravity", [0.0]),
    ("tutorial/bounce", "world.gravity", [0.0, 1e300]),
    ("tutorial/bounce", "world.gravity", 3),
    ("tutorial/bounce", "world.linear_drag", -1.0),
    ("tutorial/bounce", "world.linear_drag", True),
    ("tutorial/bounce", "world.wind", [1.0, 2.0, 3.0]),
    ("tutorial/bounce", "ball.nobody.restitution", 0.5),
    ("tutorial/bounce", "ball.17.restitution", 0.5),
    ("tutorial/bounce", "ball.*.restitution", 1.5),
    ("tutorial/bounce", "ball.restitution", 0.5),
    ("tutorial/bounce", "ball.0.0.friction", 0.5),
    ("tutorial/bounce", "box.*.friction", 0.5),
    ("tutorial/bounce", "nothing.friction", 0.5),
    ("tutorial/bounce", "friction", 0.5),
    ("tutorial/bounce", "world.friction", 0.5),
    ("tutorial/bounce", "world.duration", 5.0),
    ("tutorial/bounce", "ball.0.mass", 5.0),
    ("tutorial/bounce", "surface.sliding_friction", 0.5),
    ("tutorial/bounce", "ball..friction", 0.5),
    ("benchmark/pile", "material.pebble.restitution", -0.1),
    ("benchmark/pile", "material.pebble.friction", "much"),
    ("pinball/classic", "wall.*.restitution", 2.0),
    ("billiards/9-ball", "surface.curl", 0.5),
    ("billiards/9-ball", "surface.sliding_friction", -0.5),
    ("billiards/9-ball", "surface.sliding_friction", 0.0),
    ("billiards/9-ball", "world.gravity", [0.0, -1.0]),
    ("games/curling", "world.linear_drag", 0.5),
]


@pytest.mark.parametrize(("name", "path", "value"), WRONG)
def test_wrong_value_is_refused_with_the_fault_of_the_whole_scene(name, path, value, monkeypatch):
    def refusal() -> str | None:
        relay = start(load(find(name)))
        before, scene = relay.state_hash(), relay.scene
        try:
            relay.apply(SetParameter(time=0.0, path=path, value=value))
        except ActionError as error:
            assert relay.scene is scene
            assert relay.state_hash() == before
            return str(error)
        return None

    quick = refusal()

    def refuse(*_: Any) -> Scene:
        raise ValueError

    monkeypatch.setattr(surroundings, "change_value", refuse)
    assert refusal() == quick
    if (name, path) != ("billiards/9-ball", "surface.sliding_friction") or value:
        assert quick is not None


@pytest.mark.parametrize(
    ("name", "path", "hint"),
    [
        ("pinball/classic", "pinball.bumper.'left bumper'.restitution", "post.left bumper.restitution"),
        ("pinball/classic", "pinball.bumper.*.restitution", "post.right bumper.restitution"),
        ("pinball/classic", "pinball.flipper.0.friction", "polygon.left flipper.friction"),
        ("pinball/classic", "pinball.bumber.0.friction", ""),
        ("pinball/classic", "pinball.restitution", "examples: "),
        ("pinball/classic", "pinball.wall.cabinett.restitution", "wall.cabinet.restitution"),
        ("billiards/9-ball", "billiards.cushion.restitution", "wall.lower cushion.restitution"),
        ("artillery/duel", "artillery.friction", "box.Red.friction"),
        ("artillery/duel", "terrain.friction", "wall.terrain.friction"),
        ("tutorial/bounce", "terrain.friction", "ball.ball.friction"),
    ],
)
def test_path_of_an_expanded_preset_is_refused_with_the_elements_it_may_mean(name, path, hint):
    relay = start(load(find(name)))
    with pytest.raises(ActionError, match="running scene") as refused:
        relay.apply(SetParameter(time=0.0, path=path, value=0.5))
    assert hint in str(refused.value)


@pytest.mark.parametrize(
    ("path", "value", "said"),
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
def test_wrong_value_of_a_spawned_body_is_refused_in_the_words_of_a_scene(path, value, said):
    relay = start(load(find("tutorial/bounce")))
    relay.apply(Spawn(time=0.0, ball=Ball(name="late", position=(50.0, 50.0), radius=0.1)))
    with pytest.raises(ActionError) as refused:
        relay.apply(SetParameter(time=0.0, path=path, value=value))
    assert str(refused.value).startswith(f"{path}: ")
    assert said in str(refused.value)
    assert len(str(refused.value)) < 200


@pytest.mark.parametrize(
    ("key", "value", "said"),
    [
        ("dt", -1.0, "at most 10"),
        ("dt", "fast", "a number"),
        ("integrator", "none", "one of"),
        ("steps", 3, "unknown key"),
    ],
)
def test_wrong_setting_of_a_switch_is_refused_in_the_words_of_a_scene(key, value, said):
    relay = start(load(find("tutorial/bounce")))
    with pytest.raises(ActionError, match=f"^solver.{key}: .*{said}"):
        relay.apply(Switch(time=0.0, settings={key: value}))


def test_session_that_has_only_just_begun_keeps_its_duration():
    scene = load(find("tutorial/bounce"))
    begun = Recording(scene, "pymunk", Settings(), (), 0.0).whole_scene
    relay = start(begun)
    relay.apply(SetParameter(time=0.0, path="world.gravity", value=[0.0, -1.0]))
    assert relay.scene.world.duration == 0.0
    assert relay.scene.world.gravity == (0.0, -1.0)
