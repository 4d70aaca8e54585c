"""Balls on a surface on the reference engine: pockets, actions, energy, contacts, refusals, and no tunnelling."""

from typing import Any

import numpy as np
import pytest

from sandbox.action import ActionError, Impulse, Move, Remove, Spawn, Strike
from sandbox.engines.common.energy_balance import total_energy
from sandbox.engines.contract import Refusal, Simulation
from sandbox.engines.registry import start
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.bodies import Box
from sandbox.scene.description.discs import Ball
from sandbox.scene.files.load import from_document

R, M = 0.03, 0.17
CLOTH = {"sliding_friction": 0.2, "rolling_friction": 0.01, "spinning_friction": 0.01}
RAIL = {"points": [[0, 0], [2, 0], [2, 1], [0, 1]], "closed": True, "height": 0.036, "restitution": 0.8}


def ball(name: str, x: float, y: float, vx: float = 0.0, vy: float = 0.0, **more: Any) -> dict[str, Any]:
    return {"name": name, "position": [x, y], "velocity": [vx, vy], "radius": R, "mass": M, **more}


def table(*balls: dict[str, Any], dt: float = 0.005, **more: Any) -> Scene:
    document = {"solver": {"dt": dt, **more.pop("solver", {})}, "surface": CLOTH, "ball": list(balls), **more}
    return from_document({"world": {"duration": 5.0}, **document})


def advance(simulation: Simulation, steps: int) -> Simulation:
    for _ in range(steps):
        simulation.step()
    return simulation


def test_sliding_ball_rolls_at_five_sevenths_of_its_speed() -> None:
    speed, deceleration = 1.4, 0.2 * 9.81
    roll_time = 2.0 * speed / (7.0 * deceleration)
    frame = advance(start(table(ball("a", 0, 0, speed, 0), dt=roll_time / 50), "reference"), 50).frame()
    assert frame.velocity[0, 0] == pytest.approx(5 / 7 * speed, abs=1e-12)  # closed form, rounding
    assert frame.roll is not None
    assert frame.roll[0, 1] * R == pytest.approx(frame.velocity[0, 0], abs=1e-12)  # likewise


@pytest.mark.full
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


def test_energy_closes_over_a_break_with_cushions() -> None:
    balls = [ball(f"b{k}", 1.3 + 0.061 * (k // 2), 0.47 + 0.061 * (k % 2)) for k in range(6)]
    scene = table(ball("cue", 0.4, 0.5, 5.0, 0.1), *balls, wall=[RAIL])
    simulation = start(scene, "reference")
    simulation.account()
    energy = total_energy(simulation)
    for _ in range(100):
        simulation.step()
        change = total_energy(simulation) - energy
        assert change <= 1e-12 * energy  # rounding
        assert sum(simulation.account().values()) == pytest.approx(
            change, abs=1e-11 * energy
        )  # rounding of about 100 sums
    position = simulation.frame().position
    assert (position > 0.0).all()
    assert (position < [2.0, 1.0]).all()


def test_run_with_actions_and_a_partial_step_is_reproducible() -> None:
    def final_hash() -> str:
        simulation = start(table(ball("cue", 0.3, 0.5), ball("a", 1.0, 0.52), wall=[RAIL]), "reference")
        simulation.apply(Strike(time=0.0, ball="cue", aim=0.0, speed=4.0, side=0.2))
        advance(simulation, 40)
        simulation.apply(Spawn(time=0.0, ball=Ball(name="b", position=(1.5, 0.2), radius=R, mass=M)))
        simulation.apply(Remove(time=0.0, body="a"))
        advance(simulation, 40).finish(0.5)
        assert simulation.retired.keys() == {1}
        return simulation.state_hash()

    assert final_hash() == final_hash()


@pytest.mark.parametrize(
    ("more", "reason"),
    [
        ({"solver": {"integrator": "rk4"}}, "integrator 'rk4' is not supported on a [surface]"),
        ({"solver": {"detection": "swept"}}, "detection 'swept' is not supported on a [surface]"),
        ({"solver": {"joints": "xpbd"}}, "joints does not apply to a [surface]"),
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
