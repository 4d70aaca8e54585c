"""Stacks, ropes, cloth and ragdolls in running simulations: actions on them, and collisions."""

from typing import Any

import numpy as np
import pytest

from sandbox.action import Launch, Remove, SetParameter, Spawn
from sandbox.engines.registry import start as start_engine
from sandbox.engines.switching import start
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.discs import Ball
from sandbox.scene.files.load import from_document
from tests.engines.builders import make_scene
from tests.engines.stepping import advance

ENGINES = ("pymunk", "reference")
every_engine = pytest.mark.parametrize("engine", ENGINES)


def mixed_scene(**world: Any) -> Scene:
    """Return a scene with a ball, a small pyramid on a floor, a rope, and a ragdoll in the air."""
    return make_scene(
        world={"gravity": [0, -9.81], **world},
        solver={"dt": 0.01},
        plane=[{"point": [0, 0], "normal": [0, 1], "friction": 0.5}],
        ball=[{"name": "own", "position": [-5, 1], "radius": 0.5}],
        stack=[{"name": "box", "base": [0, 0], "size": [0.5, 0.5], "columns": 2, "rows": 2, "fewer": 1}],
        rope=[{"name": "line", "start": [3, 5], "end": [4, 5], "links": 4, "length": 1.2}],
        ragdoll=[{"name": "doll", "position": [8, 2], "friction": 0.5, "restitution": 0.2}],
    )


@every_engine
def test_changed_coefficient_applies_to_the_bodies_of_its_element_only(engine: str) -> None:
    simulation = start_engine(mixed_scene(), engine, mixed_scene().solver)
    simulation.apply(Spawn(time=0.0, ball=Ball(position=(-8.0, 3.0), radius=0.3, restitution=0.9)))
    simulation.apply(SetParameter(time=0.0, path="ragdoll.doll.restitution", value=0.7))
    simulation.apply(SetParameter(time=0.0, path="stack.box.friction", value=0.4))
    bodies = simulation.bodies
    simulation.close()
    elements = [bodies.elements[element] for element in bodies.element.tolist()]
    assert [each.restitution for each in elements[9:24]] == [0.7] * 15
    assert [each.friction for each in elements[1:4]] == [0.4] * 3
    assert elements[-1].restitution == 0.9
    assert len(bodies) == 25


def test_source_index_maps_an_element_to_its_source() -> None:
    scene = mixed_scene()
    assert [scene.source_index(k) for k in range(len(scene.elements))] == [0, 1, 2, *[3] * 15]
    assert scene.source_index(len(scene.elements)) == len(scene.body_sources)
    plain = from_document({"ball": [{"position": [k, 0], "radius": 0.1} for k in range(3)]})
    assert [plain.source_index(k) for k in range(4)] == [0, 1, 2, 3]


@every_engine
@pytest.mark.parametrize("name", ["box", "line", "doll"])
def test_launch_restores_a_generator_completely(engine: str, name: str) -> None:
    scene = mixed_scene()
    simulation = start(scene, engine)
    advance(simulation, 30)
    generated = np.asarray([body.startswith(f"{name}-") for body in scene.bodies.names])
    removed = scene.bodies.names[int(np.flatnonzero(generated)[1])]
    simulation.apply(Remove(time=simulation.time, body=removed))
    before = simulation.frame()
    simulation.apply(Launch(time=simulation.time, generator=name, seed=0))
    after = simulation.frame()
    assert after.present.all()
    assert np.array_equal(after.position[generated], scene.bodies.position[generated])
    assert np.array_equal(after.angle[generated], scene.bodies.angle[generated])
    assert not after.velocity[generated].any()
    assert np.array_equal(after.position[~generated], before.position[~generated])
    simulation.close()


@every_engine
def test_balls_joined_by_a_rod_do_not_collide(engine: str) -> None:
    balls = [{"name": name, "position": [x, 0], "radius": 1.0} for name, x in (("a", 0), ("b", 1), ("c", 1.5))]
    joints = [{"kind": "rod", "between": [a, b]} for a, b in (("a", "b"), ("b", "c"), ("a", "c"))]
    for active_joints, contact_count in ((joints, 0), (joints[:2], 1)):
        scene = from_document({"ball": balls, "joint": active_joints})
        simulation = start_engine(scene, engine, scene.solver)
        simulation.step()
        contacts = simulation.contacts()
        simulation.close()
        assert contacts.pair.tolist() == [[0, 2]] * contact_count
