"""Values derived once from a scene or setup: identity, lifetime, and independence of changed scenes."""

import gc
import weakref
from dataclasses import fields, replace

import numpy as np
import pytest

from sandbox.action import Impulse, Remove, SetParameter
from sandbox.measure.run.runner import run
from sandbox.scene.compile.contacts import ContactMatrix, PairTable, contact_matrix
from sandbox.scene.compile.demands import Demand, demands
from sandbox.scene.compile.derived import derived_once
from sandbox.scene.compile.scene import Scene
from sandbox.scene.compile.setup import Setup
from sandbox.scene.files.load import loads

TEXT = """
world = { gravity = [0, -10], duration = 0.5 }
material = [{ name = "rubber", restitution = 0.5, friction = 0.3 }]
plane = [{ point = [0, 0], normal = [0, 1] }]
ball = [
  { name = "a", position = [0, 1], radius = 0.5, material = "rubber" },
  { name = "b", position = [3, 1], radius = 0.5, material = "rubber" },
]
"""


def test_value_is_derived_once_for_a_scene_and_the_setups_of_its_start() -> None:
    calls: list[Setup] = []

    @derived_once
    def names(setup: Setup) -> tuple[str, ...]:
        calls.append(setup)
        return setup.bodies.names

    scene = loads(TEXT)
    assert names(scene) == names(Setup.of(scene)) == names(Setup.of(scene)) == ("a", "b")
    assert len(calls) == 1
    assert names(loads(TEXT)) == ("a", "b")
    assert len(calls) == 2  # another scene, though an equal one


def test_value_of_a_later_state_is_its_own() -> None:
    names = derived_once(lambda setup: setup.bodies.names)
    setup = Setup.of(loads(TEXT))
    bodies = replace(setup.bodies, names=("c", "d"))
    for later in (setup.placed(bodies), replace(setup, bodies=bodies)):
        assert (names(setup), names(later), names(setup)) == (("a", "b"), ("c", "d"), ("a", "b"))


def test_value_of_a_changed_setup_does_not_compile_its_scene() -> None:
    setup = Setup.of(loads(TEXT))
    changed = setup.with_scene(setup.scene.model_copy(update={"title": "changed"}))
    derived_once(lambda setup: setup.time)(changed)
    assert "bodies" not in vars(changed.scene)  # cached properties that were not read


@pytest.mark.fail_slow(60)  # takes over half a second
def test_value_is_released_with_its_scene() -> None:
    class Value:
        pass

    derive = derived_once(lambda setup: Value())
    scene = loads(TEXT)
    value = weakref.ref(derive(scene))
    assert value() is derive(scene)
    del scene
    gc.collect()
    assert value() is None


def test_changed_scene_has_its_own_demands_and_matrix() -> None:
    scene = loads(TEXT)
    weightless = scene.model_copy(update={"world": scene.world.model_copy(update={"gravity": (0.0, 0.0)})})
    assert Demand.GRAVITY in demands(scene)
    assert Demand.GRAVITY not in demands(weightless)
    bare = scene.model_copy(update={"planes": ()})
    assert contact_matrix(scene).surfaces.of_fixed.tolist() != contact_matrix(bare).surfaces.of_fixed.tolist()


@pytest.mark.fail_slow(60)  # compiles kernels of `reference`
@pytest.mark.parametrize("engine", ["pymunk", "reference", "exact"])
def test_run_does_not_change_the_matrix_of_its_scene(engine: str) -> None:
    scene = loads(TEXT)
    before = copied(scene)
    actions = [
        Impulse(time=0.1, body="a", impulse=(1.0, 0.0)),
        SetParameter(time=0.2, path="material.rubber.restitution", value=0.9),
        Remove(time=0.3, body="b"),
    ]
    assert run(scene, engine, actions=actions).status == "ok"
    for name, value in copied(scene).items():
        assert np.array_equal(value, before[name]), name


def copied(scene: Scene) -> dict[str, np.ndarray]:
    """Return copies of all arrays of the contact matrix of a scene."""
    matrix = contact_matrix(scene)
    found = {each.name: getattr(matrix, each.name) for each in fields(ContactMatrix)}
    found |= {f"surfaces.{each.name}": getattr(matrix.surfaces, each.name) for each in fields(PairTable)}
    return {name: value.copy() for name, value in found.items() if isinstance(value, np.ndarray)}
