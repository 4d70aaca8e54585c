"""Diagnostics of a session: ghost on another engine, perturbed twin for divergence, and missed contacts."""

from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from sandbox.action import ActionError, Force, Impulse, Pull, Remove, Spawn, Switch
from sandbox.engines.registry import ENGINES
from sandbox.measure.compare.ground_truth import truth_of
from sandbox.measure.metrics.trajectory_error import default_tolerance
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.discs import Ball
from sandbox.scene.description.world import Settings
from sandbox.scene.files.load import from_document, load
from sandbox.scene.files.shipped_scenes import find
from sandbox.trajectory import Frame
from sandbox.window.playback import diagnostics as module
from sandbox.window.playback.diagnostics import (
    Diagnostics,
    DivergenceMonitor,
    ShadowRun,
    create_ghost,
    ghost_action,
    max_body_distance,
)
from sandbox.window.playback.session import Session

pytestmark = pytest.mark.fail_slow(60)  # a window or a film

BOUNCE = load(find("bounce"))
GAS = load(find("gas"), [("world.duration", 12.0)])


@pytest.fixture(autouse=True)
def patient(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let no ghost or twin stop because other processes use the processor."""
    monkeypatch.setattr(module, "CATCH_UP_TIME", 20.0)  # s


def advance_both(session: Session, diagnostics: Diagnostics, steps: int) -> None:
    for _ in range(steps):
        session.advance()
        diagnostics.advance(session.take_replayed_actions())


def watched(scene: Scene = BOUNCE, divergence: bool = False, **more: Any) -> tuple[Session, Diagnostics]:
    """Return a session on pymunk, and its diagnostics with a ghost."""
    session = Session(scene, "pymunk", **more)
    diagnostics = Diagnostics(session)
    diagnostics.show_ghost(True)
    diagnostics.watch_divergence(divergence)
    return session, diagnostics


def ghost_of(diagnostics: Diagnostics) -> tuple[Frame, float]:
    """Return the state of the ghost and its distance, m."""
    assert diagnostics.ghost_frame is not None
    assert diagnostics.ghost_distance is not None
    return diagnostics.ghost_frame, diagnostics.ghost_distance


def monitor_of(diagnostics: Diagnostics) -> DivergenceMonitor:
    assert diagnostics.divergence is not None
    return diagnostics.divergence


def seek(session: Session, diagnostics: Diagnostics, step: int) -> None:
    for _ in session.seek(step):
        pass
    diagnostics.restart()


def update_monitor(monitor: DivergenceMonitor, session: Session) -> None:
    monitor.follow(session.step_number)
    monitor.update(session.frame, session.step_number)


@pytest.mark.parametrize("engine", ENGINES)
def test_ghost_uses_the_exact_engine_or_else_another_one(engine: str) -> None:
    ghost, note = create_ghost(Session(BOUNCE, engine).simulation.checkpoint())
    assert ghost.engine == ("reference" if engine == "exact" else "exact")
    assert note == ""
    ghost.close()


def test_ghost_reports_why_it_is_not_exact() -> None:
    session = Session(from_document({"ball": [{"position": [k * 0.5, 0], "radius": 1} for k in range(2)]}))
    ghost, note = create_ghost(session.simulation.checkpoint())
    assert ghost.engine == "reference"
    assert "exact refuses" in note
    _, diagnostics = watched(session.scene)
    assert diagnostics.ghost_engine == "reference"
    assert [level for level, _ in diagnostics.notifications] == ["info"]


def test_ghost_distance_in_free_fall_is_the_error_of_explicit_euler() -> None:
    """Explicit Euler is g·h·t/2 too high; `exact` follows the parabola."""
    (session, diagnostics), h = watched(), BOUNCE.solver.dt
    assert diagnostics.ghost_distance == 0.0
    for k in range(1, 1000):
        advance_both(session, diagnostics, 1)
        assert diagnostics.ghost_distance == pytest.approx(0.5 * 9.81 * h * k * h, rel=1e-9)  # rounding of sums of ~5 m
    assert ghost_of(diagnostics)[0].position[0, 1] == pytest.approx(5.5 - 0.5 * 9.81 * 0.999**2, rel=1e-14)  # rounding
    advance_both(session, diagnostics, 3000)
    assert ghost_of(diagnostics)[1] < 0.2  # landings differ by some steps of 1 ms at up to 10 m/s
    assert diagnostics.notifications == []


def test_ghost_repeats_actions_of_the_session_and_keeps_its_engine() -> None:
    session, diagnostics = watched()
    for action in (
        Impulse(time=0.0, body="ball", impulse=(1.0, 0.0)),
        Spawn(time=0.0, ball=Ball(name="new", position=(5.0, 5.0), radius=0.1)),
        Pull(time=0.0, body="new", target=(5.0, 6.0)),
        Switch(time=0.0, engine="reference", settings={"dt": 0.002, "integrator": "rk4"}),
        Remove(time=0.0, body="ball"),
    ):
        diagnostics.apply(session.apply(action))
        advance_both(session, diagnostics, 20)
        ghost, distance = ghost_of(diagnostics)
        assert ghost.time == pytest.approx(session.time, rel=1e-14)  # each sums its own steps
        assert ghost.present.tolist() == session.frame.present.tolist()
        assert distance < 1e-2  # short time: g·h·t/2, and a pull of first order
    assert diagnostics.ghost_engine == "exact"
    assert session.engine == "reference"


@pytest.mark.parametrize("batch", [1, 7])
def test_ghost_and_twin_repeat_all_actions_after_one_step(batch: int) -> None:
    """Rules may apply several actions at once, and a seek repeats them: all pushes must add up."""
    pushes = tuple(Impulse(time=0.01, body="ball", impulse=(x, 0.0)) for x in (1.0, 2.0, 4.0))
    session, diagnostics = watched(actions=pushes, divergence=True)
    for _ in range(42 // batch):
        session.advance(batch)
        diagnostics.advance(session.take_replayed_actions())
    ghost, twin_distance = ghost_of(diagnostics)[0], monitor_of(diagnostics).distance
    assert twin_distance is not None
    np.testing.assert_allclose(ghost.velocity[0, 0], session.frame.velocity[0, 0], rtol=1e-12)  # all three pushes
    assert session.frame.velocity[0, 0] > 0.0
    assert twin_distance < 1e-11  # from 1e-12 m at first, without a collision


def test_ghost_that_fails_is_reported_and_replaced_by_another_engine() -> None:
    session, diagnostics = watched()
    diagnostics.apply(session.apply(Spawn(time=0.0, ball=Ball(position=(0.3, 5.5), radius=0.5))))
    advance_both(session, diagnostics, 1)
    assert diagnostics.ghost_engine == "reference"
    assert diagnostics.ghost_distance == 0.0
    assert [level for level, text in diagnostics.notifications if "ghost of exact stopped" in text] == ["warning"]
    advance_both(session, diagnostics, 5)
    assert np.isfinite(ghost_of(diagnostics)[1])


def test_ghost_that_is_too_slow_is_replaced_by_another_engine(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "CATCH_UP_TIME", -1.0)  # exceeded by the first step
    session, diagnostics = watched()
    for engine in ("exact", "reference"):
        assert diagnostics.ghost_engine == engine
        advance_both(session, diagnostics, 1)
    advance_both(session, diagnostics, len(ENGINES))
    assert diagnostics.ghost_engine is None
    assert sum("too slow" in text for _, text in diagnostics.notifications) == len(ENGINES) - 1  # all but its own


def test_divergence_horizon_agrees_with_the_ground_truth_of_compare() -> None:
    scene = GAS
    truth = truth_of(scene, scene.solver, default_tolerance(scene))
    assert truth is not None
    assert truth.trusted_until < scene.world.duration
    for engine in ("pymunk", "exact"):
        session = Session(scene, engine)
        monitor = DivergenceMonitor(session.simulation.checkpoint())
        assert monitor.tolerance == default_tolerance(scene)
        spreads = []
        while monitor.state == "trusted" and session.time < 3.0 * truth.trusted_until:
            session.advance(5)
            update_monitor(monitor, session)
            spreads.append(monitor.distance)
        assert monitor.state == "lost"
        assert monitor.horizon == session.time
        # Impacts of another engine come about a step later; errors grow by the same factor per collision.
        assert 0.5 * truth.trusted_until <= monitor.horizon <= 2.0 * truth.trusted_until
        assert spreads[0] is not None
        assert spreads[0] < 1e-10
        update_monitor(monitor, session)
        assert monitor.state == "lost"
        monitor.close()


@pytest.mark.parametrize("engine", ENGINES)
def test_bounce_is_trusted_to_its_end(engine: str) -> None:
    session = Session(BOUNCE, engine)
    monitor = DivergenceMonitor(session.simulation.checkpoint())
    for _ in range(60):
        session.advance(100)
        update_monitor(monitor, session)
    assert monitor.state == "trusted"
    assert monitor.horizon is None
    assert monitor.distance is not None
    assert monitor.distance < 1e-9


def test_scene_without_collisions_is_trusted_without_a_twin() -> None:
    session = Session(load(find("fireworks")))
    monitor = DivergenceMonitor(session.simulation.checkpoint())
    assert not monitor.can_diverge
    update_monitor(monitor, session)
    assert monitor.state == "trusted"
    assert monitor.distance is None
    monitor.close()


def test_twin_that_stops_leaves_trust_unknown(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "CATCH_UP_TIME", 0.0)
    scene = load(find("gas"), [("grid.atom.velocity_jitter", 100.0), ("solver.dt", 10.0)])
    session = Session(scene, "exact")
    monitor = DivergenceMonitor(session.simulation.checkpoint())
    monitor.follow(1)
    monitor.update(session.frame, 1)
    assert monitor.state == "unknown"
    monitor.follow(2)
    monitor.apply(Impulse(time=0.0, body="atom-1", impulse=(1.0, 0.0)))
    monitor.close()


def test_diagnostics_after_seeking_equal_those_of_the_first_pass() -> None:
    session, diagnostics = watched(divergence=True)
    kick = Impulse(time=0.0, body="ball", impulse=(0.5, 1.0))
    advance_both(session, diagnostics, 200)
    diagnostics.apply(session.apply(kick))
    distance = {}
    for _ in range(200):
        advance_both(session, diagnostics, 1)
        distance[session.step_number] = diagnostics.ghost_distance
    seek(session, diagnostics, 250)
    assert diagnostics.ghost_distance == distance[250]
    seek(session, diagnostics, 100)
    for step in range(101, 401):
        advance_both(session, diagnostics, 1)
        assert diagnostics.ghost_distance == distance.get(step, diagnostics.ghost_distance)
    advance_both(session, diagnostics, 100)  # and beyond the previous end
    assert ghost_of(diagnostics)[1] < 0.01  # g·h·t/2 is 2.5 mm at 0.5 s; 0.2 m without the kick
    assert monitor_of(diagnostics).state == "trusted"


def test_diagnostics_restart_when_the_past_is_changed() -> None:
    session, diagnostics = watched(divergence=True)
    advance_both(session, diagnostics, 300)
    seek(session, diagnostics, 100)
    diagnostics.apply(session.apply(Impulse(time=0.0, body="ball", impulse=(0.5, 1.0))))
    assert diagnostics.ghost_distance == 0.0
    advance_both(session, diagnostics, 10)
    monitor = monitor_of(diagnostics)
    assert monitor.state == "trusted"
    assert monitor.distance is not None
    assert monitor.distance < 1e-9  # m: ten steps of free flight add nothing to 1e-12


def test_divergence_state_follows_the_time_after_seeking() -> None:
    session = Session(GAS, "pymunk")
    diagnostics = Diagnostics(session)
    diagnostics.watch_divergence(True)
    monitor_of(diagnostics).tolerance = 1e-11
    while monitor_of(diagnostics).state == "trusted" and session.time < 5.0:
        advance_both(session, diagnostics, 1)
    lost = session.step_number
    assert monitor_of(diagnostics).horizon is not None
    advance_both(session, diagnostics, 10)
    for step, state in ((lost - 10, "trusted"), (lost + 5, "lost"), (lost - 1, "trusted")):
        seek(session, diagnostics, step)
        assert monitor_of(diagnostics).state == state
    diagnostics.close()


def test_missed_contacts_are_counted_marked_and_discarded_after_seeking_back() -> None:
    """A fast ball passes through a thin wall within a step."""
    scene = from_document(
        {
            "ball": [{"name": "a", "position": [0, 0], "radius": 0.1, "velocity": [100, 0]}],
            "wall": [{"points": [[5.5, -5], [5.5, 5]]}, {"points": [[10.5, -5], [10.5, 5]]}],
            "solver": {"dt": 0.01},
        }
    )
    session = Session(scene, "pymunk")
    diagnostics = Diagnostics(session)
    assert diagnostics.missed_contacts == 0
    counts = []
    for _ in range(14):
        advance_both(session, diagnostics, 1)
        counts.append(diagnostics.missed_contacts)
    assert counts[-1] == 2
    assert all(a is not None and b is not None and a <= b for a, b in pairwise(counts))
    assert len(diagnostics.missed_markers) == 2
    seek(session, diagnostics, 7)
    assert diagnostics.missed_contacts == 1
    advance_both(session, diagnostics, 7)
    assert diagnostics.missed_contacts == 2
    sparks = Diagnostics(Session(load(find("fireworks"))))
    assert sparks.missed_contacts is None
    assert sparks.missed_markers == ()


def test_ghost_action_keeps_only_settings_common_to_all_engines() -> None:
    assert ghost_action(Switch(time=1.0, engine="exact", settings={"integrator": "rk4"})) is None
    assert ghost_action(Switch(time=1.0, settings={"dt": 0.1, "slop": 0.2})) == Switch(time=1.0, settings={"dt": 0.1})
    kick = Impulse(time=0.0, body="a", impulse=(1.0, 0.0))
    assert ghost_action(kick) is kick
    full_settings = Settings(dt=0.1, substeps=3, slop=0.1, integrator="rk4", half_kick=True)
    assert full_settings.common() == Settings(dt=0.1, substeps=3)


def test_max_body_distance_is_over_bodies_present_in_both() -> None:
    one = Session(from_document({"ball": [{"position": [5.0 * k, 0], "radius": 1} for k in range(2)]}))
    two = Session(from_document({"ball": [{"position": [5.0 * k, 4.0 * k], "radius": 1} for k in range(3)]}))
    assert max_body_distance(one.frame, two.frame) == 4.0
    assert max_body_distance(two.frame, one.frame) == 4.0
    two.apply(Remove(time=0.0, body="ball-2"))
    assert max_body_distance(one.frame, two.frame) == 0.0
    empty = Session(from_document({"title": "t"}))
    assert max_body_distance(one.frame, empty.frame) is None
    assert Diagnostics(empty).ghost_distance is None


def test_ghost_with_a_constant_force_uses_an_engine_that_supports_it() -> None:
    session = Session(from_document({"ball": [{"name": "a", "position": [0, 0], "radius": 1}]}), "pymunk")
    session.apply(Force(time=0.0, body="a", force=(1.0, 0.0)))
    diagnostics = Diagnostics(session)
    diagnostics.show_ghost(True)
    advance_both(session, diagnostics, 100)
    ghost, _ = ghost_of(diagnostics)
    assert diagnostics.ghost_engine == "reference"
    assert "exact cannot continue with the constant force on 'a'" in diagnostics.notifications[0][1]
    assert ghost.velocity[0] == pytest.approx([1.0, 0.0], rel=1e-12)  # a hundred sums


def test_shadow_run_that_ended_ignores_further_calls(monkeypatch: pytest.MonkeyPatch) -> None:
    shadow = ShadowRun(Session(BOUNCE).simulation.checkpoint())
    shadow.apply(Remove(time=0.0, body="zzz"))
    assert shadow.ended is not None
    assert shadow.frame is None
    shadow.follow(3)
    shadow.apply(Remove(time=0.0, body="ball"))
    shadow.close()
    monkeypatch.setattr(module, "ENGINES", {})
    with pytest.raises(ActionError, match="no other engine"):
        create_ghost(Session(BOUNCE).simulation.checkpoint())
