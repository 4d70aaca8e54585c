"""Toggle: walls and posts change between solid and non-solid in a running scene."""

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
    """Return a ball at rest on a shelf, 1 m above a floor, beside a post."""
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
    """Run some steps and return the height of the ball, m."""
    for _ in range(steps):
        simulation.step()
    return float(simulation.frame().position[0, 1])


def toggle(simulation: SwitchableSimulation, thing: str, solid: bool) -> None:
    simulation.apply(Toggle(time=0.0, thing=thing, solid=solid))


@pytest.mark.parametrize("engine", ENGINES)
def test_ball_falls_when_its_shelf_becomes_non_solid(engine: str) -> None:
    simulation = start(shelf(), engine)
    simulation.account()
    before = total_energy(simulation)
    assert advance(simulation, 100) == pytest.approx(1.0 + R, abs=2e-3)  # slop of pymunk
    initial = float(simulation.frame().position[0, 1])
    toggle(simulation, "shelf", False)
    drop = initial - advance(simulation, 300)
    assert drop == pytest.approx(0.5 * G * 0.3**2, abs=0.01)  # explicit Euler lags by g·h·t/2, and one step of rest
    assert advance(simulation, 600) == pytest.approx(R, abs=2e-3)  # it rests on the floor
    assert simulation.scene.walls[0].solid is False
    booked = sum(simulation.account().values())
    assert total_energy(simulation) - before == pytest.approx(booked, rel=1e-9, abs=1e-9)  # rounding of about 10 J


@pytest.mark.parametrize("engine", ENGINES)
def test_non_solid_wall_is_passed_until_it_becomes_solid(engine: str) -> None:
    simulation = start(shelf(solid=False), engine)
    assert advance(simulation, 300) < 1.0
    supported = start(shelf(solid=False), engine)
    toggle(supported, "shelf", True)
    assert advance(supported, 300) == pytest.approx(1.0 + R, abs=2e-3)  # as above


@pytest.mark.parametrize("engine", ENGINES)
def test_contacts_end_with_the_solid_state(engine: str) -> None:
    simulation = start(shelf(), engine)
    simulation.contacts()
    advance(simulation, 50)
    assert {*map(tuple, simulation.contacts().pair.tolist())} == {(0, -1)}
    toggle(simulation, "shelf", False)
    advance(simulation, 2)
    simulation.contacts()  # it was active since the last call
    advance(simulation, 50)
    assert not len(simulation.contacts().time)


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("other_engine", ENGINES)
def test_engine_switch_keeps_the_solid_state(engine: str, other_engine: str) -> None:
    simulation = start(shelf(), engine)
    advance(simulation, 10)
    toggle(simulation, "shelf", False)
    toggle(simulation, "peg", False)
    advance(simulation, 10)
    simulation.apply(Switch(time=0.0, engine=other_engine))
    assert [thing.solid for thing in (*simulation.scene.walls, *simulation.scene.posts)] == [False, True, False]
    assert advance(simulation, 900) == pytest.approx(R, abs=3e-3)  # on the floor; slop
    toggle(simulation, "floor", False)
    assert [wall.solid for wall in simulation.scene.walls] == [False, False]
    assert advance(simulation, 300) < 0.0


@pytest.mark.parametrize("engine", ENGINES)
def test_checkpoint_keeps_the_solid_state(engine: str) -> None:
    simulation = start(shelf(), engine)
    toggle(simulation, "shelf", False)
    advance(simulation, 100)
    resumed = SwitchableSimulation.resumed(simulation.checkpoint())
    assert advance(resumed, 100) == pytest.approx(advance(simulation, 100), rel=1e-12)  # free fall


@pytest.mark.parametrize("engine", ENGINES)
def test_recorded_toggles_are_replayed(engine: str) -> None:
    actions: tuple[Action, ...] = (
        Toggle(time=0.1, thing="shelf", solid=False),
        Toggle(time=0.12, thing="floor", solid=False),
        Toggle(time=0.9, thing="floor", solid=True),
    )
    first = run(shelf(), engine, actions=actions)
    replayed = run(shelf(), engine, actions=actions_from_json(_text(actions)))
    assert first.status == replayed.status == "ok"
    assert first.position[-1, 0, 1] < -R  # fell through the floor
    assert np.array_equal(first.position, replayed.position)
    assert first.missed_contacts in (0, None)


def _text(actions: tuple[Action, ...]) -> str:
    import json

    return json.dumps(actions_to_json(actions))


def test_ball_inside_a_wall_that_becomes_solid_is_pushed_out_or_refused() -> None:
    simulation = start(shelf(solid=False), "exact")
    advance(simulation, 30)  # halfway through the shelf
    with pytest.raises(ActionError, match="shelf"):
        toggle(simulation, "shelf", True)
    assert simulation.scene.walls[0].solid is False
    assert advance(simulation, 200) < 1.0 - R
    on_pymunk = start(shelf(solid=False))
    advance(on_pymunk, 30)
    toggle(on_pymunk, "shelf", True)
    assert advance(on_pymunk, 900) == pytest.approx(1.0 + R, abs=2e-3)


@pytest.mark.full
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
def test_toggle_works_with_every_setting_of_the_reference(how: dict[str, Any]) -> None:
    scene = shelf()
    simulation = start(scene, "reference", scene.solver.replace(**how))
    advance(simulation, 50)
    toggle(simulation, "shelf", False)
    assert advance(simulation, 250) < 0.8
    toggle(simulation, "shelf", True)
    assert advance(simulation, 600) == pytest.approx(R, abs=0.01)  # penalty springs yield by some mm


def test_toggle_of_an_unknown_wall_is_refused() -> None:
    simulation = start(shelf())
    for name in ("ball", "shelves"):
        with pytest.raises(ActionError, match=rf"no wall or post is named '{name}'; known names: shelf, floor, peg"):
            toggle(simulation, name, False)
    plane = {"plane": [{"name": "ground", "point": [0, 0], "normal": [0, 1]}]}
    plane_only = start(from_document(plane))
    with pytest.raises(ActionError, match="no wall or post is named 'ground'"):
        toggle(plane_only, "ground", False)
    table = start(from_document({"surface": {}, "wall": [{"name": "w", "points": [[0, 0], [1, 0]]}]}))
    with pytest.raises(ActionError, match="cushions of a billiard table"):
        toggle(table, "w", False)


def test_toggle_to_the_same_state_changes_nothing() -> None:
    simulation = start(shelf())
    scene = simulation.scene
    toggle(simulation, "shelf", True)
    assert simulation.scene is scene


def test_document_round_trip_keeps_kicks_gates_and_solid_states() -> None:
    document = to_document(shelf(solid=False, one_way=True, kick={"speed": 1.0, "profile": "middle"}))
    assert document["wall"][0]["solid"] is False
    assert to_document(from_document(document)) == document
    toggled = start(shelf())
    toggle(toggled, "peg", False)
    assert from_document(to_document(toggled.scene)).posts[0].solid is False


def test_spawns_and_removals_keep_the_solid_state() -> None:
    from sandbox.action import Remove, Spawn
    from sandbox.scene.description.discs import Ball

    for engine in ENGINES:
        simulation = start(shelf(), engine)
        toggle(simulation, "shelf", False)
        simulation.apply(Spawn(time=0.0, ball=Ball(name="more", position=(0.2, 1.5), radius=R, restitution=0.3)))
        simulation.apply(Remove(time=0.0, body="ball"))
        advance(simulation, 400)
        assert simulation.frame().position[1, 1] < 0.9
