"""Balls on a surface on the reference engine: pockets, actions, energy, contacts, refusals, and no tunnelling."""

from typing import Any

import numpy as np
import pytest

from sandbox.action import ActionError, Impulse, Move, Spawn
from sandbox.engines.common.energy_balance import total_energy
from sandbox.engines.contract import Refusal
from sandbox.engines.registry import start
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.bodies import Box
from sandbox.scene.description.discs import Ball
from sandbox.scene.files.load import from_document
from tests.engines.stepping import advance

pytestmark = pytest.mark.fail_slow(60)  # compiles kernels of tables

R, M = 0.03, 0.17
CLOTH = {"sliding_friction": 0.2, "rolling_friction": 0.01, "spinning_friction": 0.01}


def ball(name: str, x: float, y: float, vx: float = 0.0, vy: float = 0.0, **more: Any) -> dict[str, Any]:
    return {"name": name, "position": [x, y], "velocity": [vx, vy], "radius": R, "mass": M, **more}


def table(*balls: dict[str, Any], dt: float = 0.005, **more: Any) -> Scene:
    document = {"solver": {"dt": dt, **more.pop("solver", {})}, "surface": CLOTH, "ball": list(balls), **more}
    return from_document({"world": {"duration": 5.0}, **document})


@pytest.mark.parametrize("speed", [3.0, 300.0])
def test_no_ball_tunnels_through_another(speed: float) -> None:
    """At 300 m/s a ball moves 25 diameters in a step."""
    scene = table(ball("a", 0, 0, speed, 0), ball("b", 0.7, 0.01))
    simulation = start(scene, "reference")
    simulation.contacts()
    advance(simulation, 60)
    assert simulation.frame().velocity[1, 0] > 0.3 * speed  # half, less restitution and friction
    assert simulation.contacts().pair.tolist() == [[0, 1]]


def test_ball_falls_into_a_pocket_and_a_move_returns_it() -> None:
    scene = table(ball("a", 0, 0, 2.0, 0), pocket=[{"position": [0.5, 0.0], "radius": 0.05}])
    simulation = start(scene, "reference")
    simulation.contacts(), simulation.account()
    energy = total_energy(simulation)
    advance(simulation, 80)
    assert simulation.frame().position.tolist() == [[0.5, 0.0]]
    assert simulation.contacts().pair.tolist() == [[0, -1 - len(scene.fixed)]]
    assert sum(simulation.account().values()) == pytest.approx(-energy, rel=1e-12)  # rounding
    with pytest.raises(ActionError, match="is in a pocket"):
        simulation.apply(Impulse(time=0.0, body="a", impulse=(1.0, 0.0)))
    simulation.apply(Move(time=0.0, body="a", position=(0.1, 0.1), velocity=(1.0, 0.0)))
    assert advance(simulation, 1).frame().position[0, 0] > 0.1


@pytest.mark.parametrize(
    ("more", "reason"),
    [
        ({"solver": {"integrator": "rk4"}}, "integrator 'rk4' is not supported on a [surface]"),
        ({"solver": {"detection": "swept"}}, "detection 'swept' is not supported on a [surface]"),
        ({"solver": {"joints": "xpbd"}}, "joints 'xpbd' is not supported (a [surface] has nothing of the kind)"),
        ({"world": {"duration": 1.0, "linear_drag": 0.1}}, "does not model drag on a floor"),
    ],
)
def test_unsupported_settings_on_a_surface_are_refused(more: dict[str, Any], reason: str) -> None:
    with pytest.raises(Refusal) as refused:
        start(table(ball("a", 0, 0, 1, 0), **more), "reference")
    assert any(reason in each for each in refused.value.reasons)


def test_only_balls_of_the_same_radius_can_be_added() -> None:
    simulation = start(table(ball("a", 0, 0, 1, 0)), "reference")
    large, box = Ball(position=(1, 1), radius=2 * R, mass=M), Box(position=(1, 1), size=(0.1, 0.1))
    for spawn in (Spawn(time=0.0, ball=large), Spawn(time=0.0, box=box)):
        with pytest.raises(ActionError, match="on a floor"):
            simulation.apply(spawn)
    assert len(simulation.bodies) == 1


def test_observer_sees_balls_in_pockets_as_nan() -> None:
    observed: list[Any] = []
    simulation = start(table(ball("a", 0, 0, 2, 0), pocket=[{"position": [0.1, 0], "radius": 0.05}]), "reference")
    simulation.watch(lambda time, start, end, pairs: observed.append((time, end.copy())))
    advance(simulation, 20)
    assert [time for time, _ in observed] == pytest.approx(0.005 * np.arange(20), abs=1e-15)  # rounding
    assert np.isnan(observed[-1][1]).all()
