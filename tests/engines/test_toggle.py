"""Walls and posts that cease to be solid, and become so again, while a scene runs."""

from typing import Any

import numpy as np
import pytest

from sandbox.action import Action, ActionError, Switch, Toggle, actions_from_json, actions_to_json
from sandbox.engines.common.energy_balance import total_energy
from sandbox.engines.switching import SwitchableSimulation, start
from sandbox.measure.run.runner import run
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.document import to_document
from sandbox.scene.files.load import from_document

ENGINES = ("pymunk", "exact", "reference")
R = 0.05
G = 9.81


def shelf(**more: Any) -> Scene:
    """Return a ball that lies on a shelf, 1 m above a floor, beside a post."""
    return from_document(
        {
            "world": {"gravity": [0.0, -G], "duration": 1.0},
            "solver": {"dt": 0.001},
            "ball": [{"name": "ball", "position": [0.0, 1.0 + R], "radius": R}],
            "wall": [
                {"name": "shelf", "points": [[-0.5, 1.0], [0.5, 1.0]], "friction": 0.5, **more},
                {"name": "floor", "points": [[-0.5, 0.0], [0.5, 0.0]]},
            ],
            "post": [{"name": "peg", "position": [0.3, 0.5], "radius": 0.1}],
        }
    )


def advance(simulation: SwitchableSimulation, steps: int) -> float:
    """Return how high the ball is after some steps, m."""
    for _ in range(steps):
        simulation.step()
    return float(simulation.frame().position[0, 1])


def toggle(simulation: SwitchableSimulation, thing: str, solid: bool) -> None:
    simulation.apply(Toggle(time=0.0, thing=thing, solid=solid))


@pytest.mark.parametrize("engine", ENGINES)
def test_ball_falls_when_what_it_lies_on_is_gone(engine: str) -> None:
    simulation = start(shelf(), engine)
    simulation.account()
    before = total_energy(simulation)
    assert advance(simulation, 100) == pytest.approx(1.0 + R, abs=2e-3)  # pymunk lets it sink by its slop
    began = float(simulation.frame().position[0, 1])
    toggle(simulation, "shelf", False)
    fallen = began - advance(simulation, 300)
    assert fallen == pytest.approx(0.5 * G * 0.3**2, abs=0.01)  # explicit Euler is short by g·h·t/2, and 1 step of rest
    assert advance(simulation, 600) == pytest.approx(R, abs=2e-3)  # it lies on the floor
    assert simulation.scene.walls[0].solid is False
    brought = sum(simulation.account().values())
    assert total_energy(simulation) - before == pytest.approx(brought, rel=1e-9, abs=1e-9)  # rounding, of some 10 J


@pytest.mark.parametrize("engine", ENGINES)
def test_what_is_not_solid_is_passed_and_holds_once_it_is(engine: str) -> None:
    simulation = start(shelf(solid=False), engine)
    assert advance(simulation, 300) < 1.0
    thrown = start(shelf(solid=False), engine)
    toggle(thrown, "shelf", True)
    assert advance(thrown, 300) == pytest.approx(1.0 + R, abs=2e-3)  # as above


@pytest.mark.parametrize("engine", ENGINES)
def test_contacts_end_and_begin_with_it(engine: str) -> None:
    simulation = start(shelf(), engine)
    simulation.contacts()
    advance(simulation, 50)
    assert {*map(tuple, simulation.contacts().pair.tolist())} == {(0, -1)}
    toggle(simulation, "shelf", False)
    advance(simulation, 2)
    simulation.contacts()  # it was open since the last call
    advance(simulation, 50)
    assert not len(simulation.contacts().time)


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("heir", ENGINES)
def test_another_engine_takes_over_what_is_solid(engine: str, heir: str) -> None:
    simulation = start(shelf(), engine)
    advance(simulation, 10)
    toggle(simulation, "shelf", False)
    toggle(simulation, "peg", False)
    advance(simulation, 10)
    simulation.apply(Switch(time=0.0, engine=heir))
    assert [thing.solid for thing in (*simulation.scene.walls, *simulation.scene.posts)] == [False, True, False]
    assert advance(simulation, 900) == pytest.approx(R, abs=3e-3)  # on the floor; slop
    toggle(simulation, "floor", False)
    assert [wall.solid for wall in simulation.scene.walls] == [False, False]
    assert advance(simulation, 300) < 0.0


@pytest.mark.parametrize("engine", ENGINES)
def test_checkpoint_holds_what_is_solid(engine: str) -> None:
    simulation = start(shelf(), engine)
    toggle(simulation, "shelf", False)
    advance(simulation, 100)
    taken_up = SwitchableSimulation.resumed(simulation.checkpoint())
    assert advance(taken_up, 100) == pytest.approx(advance(simulation, 100), rel=1e-12)  # in free fall


@pytest.mark.parametrize("engine", ENGINES)
def test_actions_of_a_recording_do_it_again(engine: str) -> None:
    actions: tuple[Action, ...] = (
        Toggle(time=0.1, thing="shelf", solid=False),
        Toggle(time=0.12, thing="floor", solid=False),
        Toggle(time=0.9, thing="floor", solid=True),
    )
    first = run(shelf(), engine, actions=actions)
    again = run(shelf(), engine, actions=actions_from_json(_text(actions)))
    assert first.status == again.status == "ok"
    assert first.position[-1, 0, 1] < -R  # it fell through the floor
    assert np.array_equal(first.position, again.position)
    assert first.missed_contacts in (0, None)


def _text(actions: tuple[Action, ...]) -> str:
    import json

    return json.dumps(actions_to_json(actions))


def test_pymunk_pushes_out_what_stands_where_something_becomes_solid_and_exact_refuses() -> None:
    simulation = start(shelf(solid=False), "exact")
    advance(simulation, 30)  # it is halfway through
    with pytest.raises(ActionError, match="shelf"):
        toggle(simulation, "shelf", True)
    assert simulation.scene.walls[0].solid is False
    assert advance(simulation, 200) < 1.0 - R
    soft = start(shelf(solid=False))
    advance(soft, 30)
    toggle(soft, "shelf", True)
    assert advance(soft, 900) == pytest.approx(1.0 + R, abs=2e-3)


@pytest.mark.parametrize(
    "how",
    [
        {"response": "penalty", "substeps": 20, "damping": 0.5},
        {"detection": "bisect", "integrator": "velocity_verlet"},
        {"detection": "swept", "integrator": "velocity_verlet"},
        {"detection": "shrink"},
        {"broad_phase": "grid"},
    ],
)
def test_every_choice_of_the_reference_knows_what_is_solid(how: dict[str, Any]) -> None:
    scene = shelf()
    simulation = start(scene, "reference", scene.solver.replace(**how))
    advance(simulation, 50)
    toggle(simulation, "shelf", False)
    assert advance(simulation, 250) < 0.8
    toggle(simulation, "shelf", True)
    assert advance(simulation, 600) == pytest.approx(R, abs=0.01)  # springs give way by some mm


def test_what_is_toggled_must_be_there() -> None:
    simulation = start(shelf())
    for name in ("ball", "shelves"):
        with pytest.raises(ActionError, match=rf"no wall or post is named '{name}'; known names: shelf, floor, peg"):
            toggle(simulation, name, False)
    plane = {"plane": [{"name": "ground", "point": [0, 0], "normal": [0, 1]}]}
    bare = start(from_document(plane))
    with pytest.raises(ActionError, match="no wall or post is named 'ground'"):
        toggle(bare, "ground", False)
    table = start(from_document({"surface": {}, "wall": [{"name": "w", "points": [[0, 0], [1, 0]]}]}))
    with pytest.raises(ActionError, match="cushions of a billiard table"):
        toggle(table, "w", False)


def test_same_state_again_changes_nothing() -> None:
    simulation = start(shelf())
    scene = simulation.scene
    toggle(simulation, "shelf", True)
    assert simulation.scene is scene


def test_document_round_trip_keeps_kicks_gates_and_openings() -> None:
    document = to_document(shelf(solid=False, one_way=True, kick={"speed": 1.0, "profile": "middle"}))
    assert document["wall"][0]["solid"] is False
    assert to_document(from_document(document)) == document
    toggled = start(shelf())
    toggle(toggled, "peg", False)
    assert from_document(to_document(toggled.scene)).posts[0].solid is False


def test_spawned_bodies_leave_what_is_solid_as_it_is() -> None:
    from sandbox.action import Remove, Spawn
    from sandbox.scene.description.discs import Ball

    for engine in ENGINES:
        simulation = start(shelf(), engine)
        toggle(simulation, "shelf", False)
        simulation.apply(Spawn(time=0.0, ball=Ball(name="more", position=(0.2, 1.5), radius=R, restitution=0.3)))
        simulation.apply(Remove(time=0.0, body="ball"))
        advance(simulation, 400)
        assert simulation.frame().position[1, 1] < 0.9
