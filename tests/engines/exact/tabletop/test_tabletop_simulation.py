"""Simulation of balls on a surface: actions, pockets and refusals."""

import math
from typing import Any

import numpy as np
import pytest

from sandbox.action import Action, ActionError, Impulse, Move, Remove, SetParameter, Spawn, Strike
from sandbox.engines.common.energy_balance import total_energy
from sandbox.engines.contract import Exhaustion, Refusal
from sandbox.engines.registry import ENGINES
from sandbox.engines.switching import SwitchableSimulation, start
from sandbox.measure.run.runner import run
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.discs import Ball
from tests.engines.exact.tabletop.small_tables import MASS, SLIDING, G, R, ball, rack, table

HOLE = {"name": "hole", "position": [0.5, 1.5], "radius": 0.06}
UPWARDS = 0.5 * math.pi


def advanced_simulation(*balls: dict[str, Any], steps: int = 0, **more: Any) -> SwitchableSimulation:
    simulation = start(table(*balls, **more), "exact")
    for _ in range(steps):
        simulation.step()
    return simulation


def table_with_pocket(*balls: dict[str, Any], **more: Any) -> Scene:
    return table(*balls, cushions=False, pocket=[HOLE], **more)


def test_pocketed_ball_lies_at_the_centre_and_is_recorded() -> None:
    trajectory = run(table_with_pocket(ball("a", 0.5, 1.0, velocity=[0.0, 1.0])), "exact", account=True)
    assert trajectory.position[-1, 0].tolist() == HOLE["position"]
    assert not trajectory.velocity[-1].any()
    assert not trajectory.spin[-1].any()
    assert trajectory.contact_pair.tolist() == [[0, -1]]
    assert np.isnan(trajectory.retired_time[0])  # it is not retired
    distance = float(np.hypot(*(trajectory.contact_point[0] - HOLE["position"])))
    assert distance == pytest.approx(HOLE["radius"], abs=1e-12)  # m: accuracy of the root
    causes = dict(zip(trajectory.info["causes"], trajectory.account[-1], strict=True))
    assert causes["retired"] < 0.0
    assert causes["retired"] + causes["friction"] == pytest.approx(-trajectory.energy[0], rel=1e-14)


def test_two_balls_in_one_pocket_collide_with_nothing() -> None:
    balls = [ball("a", 0.5, 1.0, velocity=[0.0, 1.0]), ball("b", 0.5, 0.9, velocity=[0.0, 1.0])]
    trajectory = run(table_with_pocket(*balls, ball("c", 0.5, 1.6, velocity=[0.0, -1.0])), "exact")
    assert (trajectory.position[-1] == HOLE["position"]).all()
    assert sorted(trajectory.contact_pair[:, 0].tolist()) == [0, 1, 2]


def test_ball_that_starts_in_a_pocket_is_captured_at_once() -> None:
    simulation = start(table_with_pocket(ball("a", 0.52, 1.5, velocity=[1.0, 0.0])), "exact")
    assert simulation.frame().position[0].tolist() == HOLE["position"]
    assert not simulation.frame().velocity.any()


def test_move_returns_a_pocketed_ball() -> None:
    simulation = start(table_with_pocket(ball("a", 0.5, 1.4, velocity=[0.0, 1.0]), ball("b", 0.9, 1.0)), "exact")
    for _ in range(50):
        simulation.step()
    assert simulation.frame().position[0].tolist() == HOLE["position"]
    simulation.apply(Move(time=simulation.time, body="a", position=(0.9, 0.5)))
    simulation.apply(Strike(time=simulation.time, ball="a", aim=UPWARDS, speed=1.0))
    for _ in range(100):
        simulation.step()
    assert simulation.frame().position[1, 1] > 1.0  # the other ball was hit


def test_strike_equals_the_shot_of_a_scene() -> None:
    shot = {"aim": 1.2, "speed": 2.0, "side": 0.2, "height": -0.1}
    from_scene = run(table(ball("cue", 0.5, 0.5), shot=[shot]), "exact").position
    from_strike = run(table(ball("cue", 0.5, 0.5)), "exact", actions=(Strike(time=0.0, ball="cue", **shot),)).position
    assert (from_scene == from_strike).all()


@pytest.mark.parametrize(
    ("action", "reason"),
    [
        (Strike(time=0.0, ball="nobody", aim=0.0, speed=1.0), "no body is named"),
        (Strike(time=0.0, ball="a", aim=0.0, speed=1.0, side=0.4, height=0.4), "slips"),
        (Move(time=0.0, body="a", position=(0.7, 1.0)), "overlap"),
        (Move(time=0.0, body="a", position=(0.0, 1.0)), "overlap"),
        (Spawn(time=0.0, ball=Ball(position=(0.7, 1.0), radius=R)), "overlap"),
    ],
)
def test_invalid_action_changes_nothing(action: Action, reason: str) -> None:
    simulation = advanced_simulation(ball("a", 0.5, 0.5, velocity=[1.0, 0.3]), ball("b", 0.7, 1.0), steps=3)
    before = simulation.state_hash()
    with pytest.raises(ActionError, match=reason):
        simulation.apply(action)
    assert simulation.state_hash() == before


def test_ledger_books_the_energy_of_actions() -> None:
    simulation = advanced_simulation(ball("a", 0.5, 0.5), ball("b", 0.7, 1.0, velocity=[0.0, 1.0]))
    simulation.account()
    energy = total_energy(simulation)
    for action in (
        Impulse(time=0.0, body="a", impulse=(0.05, 0.0), angular=1e-4),
        Spawn(time=0.0, ball=Ball(position=(0.3, 0.3), radius=R, velocity=(1.0, 0.0))),
        SetParameter(time=0.0, path="pair.0.restitution", value=0.5),
        Strike(time=0.0, ball="b", aim=1.0, speed=1.0),
        Remove(time=0.0, body="b"),
    ):
        for _ in range(7):
            simulation.step()
        simulation.apply(action)
    simulation.step()
    booked = sum(simulation.account().values())
    assert total_energy(simulation) - energy == pytest.approx(booked, abs=1e-15)  # J: rounding of some mJ
    assert not simulation.frame().present[1]


def test_spawned_ball_is_hit() -> None:
    simulation = advanced_simulation(ball("a", 0.5, 0.5, velocity=[0.0, 2.0]), steps=5)
    simulation.apply(
        Spawn(time=simulation.time, ball=Ball(position=(0.5, 0.9), radius=R, mass=MASS, material="phenolic"))
    )
    for _ in range(60):
        simulation.step()
    assert simulation.frame().velocity[1, 1] > 0.5
    assert simulation.frame().roll is not None


def test_ball_that_leaves_the_bounds_is_retired() -> None:
    scene = table(
        ball("a", 0.5, 0.5, velocity=[2.0, 0.0]), cushions=False, world={"duration": 2.0, "bounds": [[0, 0], [1, 1]]}
    )
    trajectory = run(scene, "exact")
    assert 0.2 < trajectory.retired_time[0] < 0.5
    assert not trajectory.spin[-1].any()


def test_half_step_equals_a_step_of_half_the_size() -> None:
    partial, full = (advanced_simulation(ball("a", 0.5, 0.5, velocity=[0.3, 2.0]), dt=dt) for dt in (0.01, 0.005))
    partial.finish(0.5)
    full.step()
    assert (partial.frame().position == full.frame().position).all()


@pytest.mark.parametrize(
    ("more", "reason"),
    [
        ({"world": {"gravity": [0.0, -0.1]}}, "world.gravity in the plane"),
        ({"ball": [ball("a", 0.5, 0.5), {**ball("b", 0.7, 0.5), "radius": 0.03}]}, "different radii"),
        ({"ball": [ball("a", 0.5, 0.5), ball("b", 0.5, 0.5 + 2.0 * R - 1e-6)]}, "overlap"),
        ({"world": {"linear_drag": 0.1}}, "drag"),
    ],
)
def test_scene_without_a_closed_form_is_refused(more: dict[str, Any], reason: str) -> None:
    with pytest.raises(Refusal, match=reason):
        ENGINES["exact"].start(table(ball("a", 0.5, 0.5, velocity=[1.0, 0.0]), **more))


def test_too_many_events_end_the_simulation(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SANDBOX_MAX_EVENTS", "30")  # a tenth of it is allowed per second
    simulation = advanced_simulation(ball("a", 0.5, 0.5, velocity=[5.0, 3.0]), *rack(3, 0.5, 1.2))
    with pytest.raises(Exhaustion, match="events, more than allowed, last of"):
        for _ in range(1000):
            simulation.step()
    assert np.isfinite(simulation.frame().position).all()


def test_non_colliding_ball_is_not_hit() -> None:
    ghost = ball("ghost", 0.5, 0.9, collides="fixed")
    trajectory = run(table(ball("a", 0.5, 0.5, velocity=[0.0, 2.0]), ghost), "exact")
    assert (trajectory.position[:, 1] == (0.5, 0.9)).all()
    assert (trajectory.contact_pair[:, 1] == -1).all()


@pytest.mark.parametrize("first", ["fixed", "moving"])
def test_impulse_on_a_fixed_ball_is_recorded_in_either_body_order(first: str) -> None:
    balls = [ball("moving", 0.5, 0.5, velocity=[0.0, 2.0]), ball("fixed", 0.5, 0.9, fixed=True)]
    trajectory = run(table(*sorted(balls, key=lambda each: each["name"] != first), friction=False, e=1.0), "exact")
    speed = math.sqrt(4.0 - 2.0 * G * SLIDING * (0.4 - 2.0 * R))  # it slides up to the impact
    sign = 1.0 if first == "moving" else -1.0
    assert trajectory.contact_impulse[0, 1] == pytest.approx(sign * 2.0 * MASS * speed, rel=1e-12)  # rounding


def test_fixed_ball_acts_as_a_post_with_friction() -> None:
    trajectory = run(table(ball("a", 0.5, 0.5, velocity=[0.0, 2.0]), ball("b", 0.51, 0.9, fixed=True)), "exact")
    assert (trajectory.position[:, 1] == (0.51, 0.9)).all()
    assert trajectory.contact_pair[0].tolist() == [0, 1]
    assert np.diff(trajectory.position[:, 0, 1]).min() < 0.0
