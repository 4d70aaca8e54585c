"""A running scene of rolling balls: what is done to it, what falls into pockets, what it refuses."""

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
UP = 0.5 * math.pi


def simulation(*balls: dict[str, Any], steps: int = 0, **more: Any) -> SwitchableSimulation:
    running = start(table(*balls, **more), "exact")
    for _ in range(steps):
        running.step()
    return running


def holed(*balls: dict[str, Any], **more: Any) -> Scene:
    return table(*balls, cushions=False, pocket=[HOLE], **more)


def test_ball_that_falls_lies_at_the_centre_and_is_told_of() -> None:
    trajectory = run(holed(ball("a", 0.5, 1.0, velocity=[0.0, 1.0])), "exact", account=True)
    assert trajectory.position[-1, 0].tolist() == HOLE["position"]
    assert not trajectory.velocity[-1].any()
    assert not trajectory.spin[-1].any()
    assert trajectory.contact_pair.tolist() == [[0, -1]]
    assert np.isnan(trajectory.retired_time[0])  # it is still there
    at = float(np.hypot(*(trajectory.contact_point[0] - HOLE["position"])))
    assert at == pytest.approx(HOLE["radius"], abs=1e-12)  # m: as near as a root is found
    causes = dict(zip(trajectory.info["causes"], trajectory.account[-1], strict=True))
    assert causes["retired"] < 0.0
    assert causes["retired"] + causes["friction"] == pytest.approx(-trajectory.energy[0], rel=1e-14)


def test_two_balls_may_lie_in_one_pocket_and_nobody_meets_them() -> None:
    balls = [ball("a", 0.5, 1.0, velocity=[0.0, 1.0]), ball("b", 0.5, 0.9, velocity=[0.0, 1.0])]
    trajectory = run(holed(*balls, ball("c", 0.5, 1.6, velocity=[0.0, -1.0])), "exact")
    assert (trajectory.position[-1] == HOLE["position"]).all()
    assert sorted(trajectory.contact_pair[:, 0].tolist()) == [0, 1, 2]


def test_ball_that_starts_in_a_pocket_is_captured_at_once() -> None:
    running = start(holed(ball("a", 0.52, 1.5, velocity=[1.0, 0.0])), "exact")
    assert running.frame().position[0].tolist() == HOLE["position"]
    assert not running.frame().velocity.any()


def test_captured_ball_comes_back_by_a_move() -> None:
    running = start(holed(ball("a", 0.5, 1.4, velocity=[0.0, 1.0]), ball("b", 0.9, 1.0)), "exact")
    for _ in range(50):
        running.step()
    assert running.frame().position[0].tolist() == HOLE["position"]
    running.apply(Move(time=running.time, body="a", position=(0.9, 0.5)))
    running.apply(Strike(time=running.time, ball="a", aim=UP, speed=1.0))
    for _ in range(100):
        running.step()
    assert running.frame().position[1, 1] > 1.0  # it was met


def test_strike_is_the_shot_of_a_scene() -> None:
    shot = {"aim": 1.2, "speed": 2.0, "side": 0.2, "height": -0.1}
    written = run(table(ball("cue", 0.5, 0.5), shot=[shot]), "exact").position
    struck = run(table(ball("cue", 0.5, 0.5)), "exact", actions=(Strike(time=0.0, ball="cue", **shot),)).position
    assert (written == struck).all()


@pytest.mark.parametrize(
    ("action", "words"),
    [
        (Strike(time=0.0, ball="nobody", aim=0.0, speed=1.0), "no body is named"),
        (Strike(time=0.0, ball="a", aim=0.0, speed=1.0, side=0.4, height=0.4), "slips"),
        (Move(time=0.0, body="a", position=(0.7, 1.0)), "overlap"),
        (Move(time=0.0, body="a", position=(0.0, 1.0)), "overlap"),
        (Spawn(time=0.0, ball=Ball(position=(0.7, 1.0), radius=R)), "overlap"),
    ],
)
def test_action_that_cannot_be_done_changes_nothing(action: Action, words: str) -> None:
    running = simulation(ball("a", 0.5, 0.5, velocity=[1.0, 0.3]), ball("b", 0.7, 1.0), steps=3)
    before = running.state_hash()
    with pytest.raises(ActionError, match=words):
        running.apply(action)
    assert running.state_hash() == before


def test_account_books_what_is_done_from_outside() -> None:
    running = simulation(ball("a", 0.5, 0.5), ball("b", 0.7, 1.0, velocity=[0.0, 1.0]))
    running.account()
    energy = total_energy(running)
    for action in (
        Impulse(time=0.0, body="a", impulse=(0.05, 0.0), angular=1e-4),
        Spawn(time=0.0, ball=Ball(position=(0.3, 0.3), radius=R, velocity=(1.0, 0.0))),
        SetParameter(time=0.0, path="pair.0.restitution", value=0.5),
        Strike(time=0.0, ball="b", aim=1.0, speed=1.0),
        Remove(time=0.0, body="b"),
    ):
        for _ in range(7):
            running.step()
        running.apply(action)
    running.step()
    brought = sum(running.account().values())
    assert total_energy(running) - energy == pytest.approx(brought, abs=1e-15)  # J: rounding of some mJ
    assert not running.frame().present[1]


def test_spawned_ball_is_met() -> None:
    running = simulation(ball("a", 0.5, 0.5, velocity=[0.0, 2.0]), steps=5)
    running.apply(Spawn(time=running.time, ball=Ball(position=(0.5, 0.9), radius=R, mass=MASS, material="phenolic")))
    for _ in range(60):
        running.step()
    assert running.frame().velocity[1, 1] > 0.5
    assert running.frame().roll is not None


def test_balls_leave_the_bounds() -> None:
    scene = table(
        ball("a", 0.5, 0.5, velocity=[2.0, 0.0]),
        cushions=False,
        world={"duration": 2.0, "bounds": [[0, 0], [1, 1]]},
    )
    trajectory = run(scene, "exact")
    assert 0.2 < trajectory.retired_time[0] < 0.5
    assert not trajectory.spin[-1].any()


def test_last_part_of_a_step_is_where_the_next_frame_would_pass() -> None:
    part, whole = (simulation(ball("a", 0.5, 0.5, velocity=[0.3, 2.0]), dt=dt) for dt in (0.01, 0.005))
    part.finish(0.5)
    whole.step()
    assert (part.frame().position == whole.frame().position).all()


def test_relay_goes_on_from_any_state() -> None:
    scene = table(ball("cue", 0.5, 0.5), *rack(3, 0.49, 1.2, 1e-4), pocket=[HOLE], cushions=False)
    struck = Strike(time=0.0, ball="cue", aim=UP, speed=4.0, height=0.2)
    through, halted = start(scene, "exact"), start(scene, "exact")
    for running in (through, halted):
        running.apply(struck)
    for step in range(300):
        through.step()
        halted.step()
        if step == 40:
            halted = SwitchableSimulation.resumed(halted.checkpoint())
    # m: what the last digits of a state at rest in them grow to over some dozen hits
    np.testing.assert_allclose(through.frame().position, halted.frame().position, atol=1e-9)


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ({"world": {"gravity": [0.0, -0.1]}}, "world.gravity in the plane"),
        ({"ball": [ball("a", 0.5, 0.5), {**ball("b", 0.7, 0.5), "radius": 0.03}]}, "different radii"),
        ({"ball": [ball("a", 0.5, 0.5), ball("b", 0.5, 0.5 + 2.0 * R - 1e-6)]}, "overlap"),
        ({"world": {"linear_drag": 0.1}}, "drag"),
    ],
)
def test_what_has_no_closed_form_is_refused(more: dict[str, Any], words: str) -> None:
    with pytest.raises(Refusal, match=words):
        ENGINES["exact"].start(table(ball("a", 0.5, 0.5, velocity=[1.0, 0.0]), **more))


def test_too_many_events_are_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SANDBOX_MAX_EVENTS", "30")  # a tenth of it in a second
    running = simulation(ball("a", 0.5, 0.5, velocity=[5.0, 3.0]), *rack(3, 0.5, 1.2))
    with pytest.raises(Exhaustion, match="events, more than allowed, last of"):
        for _ in range(1000):
            running.step()
    assert np.isfinite(running.frame().position).all()


def test_who_cannot_meet_does_not() -> None:
    ghost = ball("ghost", 0.5, 0.9, collides="fixed")
    trajectory = run(table(ball("a", 0.5, 0.5, velocity=[0.0, 2.0]), ghost), "exact")
    assert (trajectory.position[:, 1] == (0.5, 0.9)).all()
    assert (trajectory.contact_pair[:, 1] == -1).all()


@pytest.mark.parametrize("first", ["fixed", "moving"])
def test_impulse_on_a_fixed_ball_is_told_whoever_has_the_lower_number(first: str) -> None:
    balls = [ball("moving", 0.5, 0.5, velocity=[0.0, 2.0]), ball("fixed", 0.5, 0.9, fixed=True)]
    trajectory = run(table(*sorted(balls, key=lambda each: each["name"] != first), rubs=False, e=1.0), "exact")
    speed = math.sqrt(4.0 - 2.0 * G * SLIDING * (0.4 - 2.0 * R))  # it slides up to there
    sign = 1.0 if first == "moving" else -1.0
    assert trajectory.contact_impulse[0, 1] == pytest.approx(sign * 2.0 * MASS * speed, rel=1e-12)  # rounding


def test_fixed_ball_is_a_post_that_rubs() -> None:
    trajectory = run(table(ball("a", 0.5, 0.5, velocity=[0.0, 2.0]), ball("b", 0.51, 0.9, fixed=True)), "exact")
    assert (trajectory.position[:, 1] == (0.51, 0.9)).all()
    assert trajectory.contact_pair[0].tolist() == [0, 1]
    assert np.diff(trajectory.position[:, 0, 1]).min() < 0.0
