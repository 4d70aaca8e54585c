"""Companions: the ghost, the twin, and the audit beside a session."""

from itertools import pairwise

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
from sandbox.window.playback import diagnostics as companions
from sandbox.window.playback.diagnostics import (
    Diagnostics,
    DivergenceMonitor,
    ShadowRun,
    create_ghost,
    ghost_action,
    max_body_distance,
)
from sandbox.window.playback.session import Session

pytestmark = pytest.mark.full  # a window or a film

BOUNCE = load(find("bounce"))


def gas(duration: float = 12.0) -> Scene:
    return load(find("gas"), [("world.duration", duration)])


def pile() -> Scene:
    return load(find("pile"), [("grid.ball.rows", 3), ("grid.ball.columns", 10)])


def together(session: Session, company: Diagnostics, steps: int) -> None:
    for _ in range(steps):
        session.advance()
        company.advance(session.take_replayed_actions())


def beside(trust: DivergenceMonitor, session: Session) -> None:
    trust.follow(session.step_number)
    trust.update(session.frame, session.step_number)


@pytest.mark.parametrize("engine", ENGINES)
def test_ghost_is_exact_where_it_can_be_else_another_engine(engine: str) -> None:
    ghost, note = create_ghost(Session(BOUNCE, engine).simulation.checkpoint())
    assert ghost.engine == ("reference" if engine == "exact" else "exact")
    assert note == ""
    ghost.close()


def test_ghost_says_why_it_is_not_exact() -> None:
    session = Session(from_document({"ball": [{"position": [k * 0.5, 0], "radius": 1} for k in range(2)]}))
    ghost, note = create_ghost(session.simulation.checkpoint())
    assert ghost.engine == "reference"
    assert "exact refuses" in note
    company = Diagnostics(session)
    company.show_ghost(True)
    assert company.ghost_engine == "reference"
    assert [level for level, _ in company.notifications] == ["info"]


def test_distance_to_the_ghost_in_free_fall_is_the_error_of_explicit_euler() -> None:
    """x(k·h) is g·h·t/2 too high; `exact` has the parabola."""
    session, h = Session(BOUNCE, "pymunk"), BOUNCE.solver.dt
    company = Diagnostics(session)
    company.show_ghost(True)
    assert company.ghost_distance == 0.0
    for k in range(1, 1000):
        together(session, company, 1)
        assert company.ghost_distance == pytest.approx(0.5 * 9.81 * h * k * h, rel=1e-9)  # rounding of sums of ~5 m
    ghost = company.ghost_frame
    assert ghost is not None
    assert ghost.position[0, 1] == pytest.approx(5.5 - 0.5 * 9.81 * 0.999**2, rel=1e-14)  # rounding
    together(session, company, 3000)
    assert company.ghost_distance is not None
    assert company.ghost_distance < 0.2  # it lands within some steps of 1 ms at up to 10 m/s, and again at each bounce
    assert company.notifications == []


def test_ghost_does_what_the_session_does_and_keeps_its_engine() -> None:
    session = Session(BOUNCE, "pymunk")
    company = Diagnostics(session)
    company.show_ghost(True)
    for action in (
        Impulse(time=0.0, body="ball", impulse=(1.0, 0.0)),
        Spawn(time=0.0, ball=Ball(name="new", position=(5.0, 5.0), radius=0.1)),
        Pull(time=0.0, body="new", target=(5.0, 6.0)),
        Switch(time=0.0, engine="reference", settings={"dt": 0.002, "integrator": "rk4"}),
        Remove(time=0.0, body="ball"),
    ):
        company.apply(session.apply(action))
        together(session, company, 20)
        ghost = company.ghost_frame
        assert ghost is not None
        assert ghost.time == pytest.approx(session.time, rel=1e-14)  # counted in steps by each
        assert ghost.present.tolist() == session.frame.present.tolist()
        assert company.ghost_distance is not None
        assert company.ghost_distance < 1e-2  # of so short a time: g·h·t/2, and a pull of first order
    assert company.ghost_engine == "exact"
    assert session.engine == "reference"


@pytest.mark.parametrize("at_once", [1, 7])
def test_ghost_and_twin_do_all_that_was_done_after_one_step(at_once: int) -> None:
    """As rules do several things at once, and as it is done again on a way back: the last push stands."""
    pushes = tuple(Impulse(time=0.01, body="ball", impulse=(x, 0.0)) for x in (1.0, 2.0, 4.0))
    session = Session(BOUNCE, "pymunk", actions=pushes)
    company = Diagnostics(session)
    company.show_ghost(True)
    company.watch_divergence(True)
    for _ in range(42 // at_once):
        session.advance(at_once)
        company.advance(session.take_replayed_actions())
    assert company.divergence is not None
    assert company.divergence.distance is not None
    ghost = company.ghost_frame
    assert ghost is not None
    np.testing.assert_allclose(ghost.velocity[0, 0], session.frame.velocity[0, 0], rtol=1e-12)  # all three pushes
    assert session.frame.velocity[0, 0] > 0.0
    assert company.divergence.distance < 1e-11  # of 1e-12 m at first: nothing has been hit


def test_ghost_that_cannot_follow_says_why_and_another_engine_goes_on() -> None:
    session = Session(BOUNCE, "pymunk")
    company = Diagnostics(session)
    company.show_ghost(True)
    company.apply(session.apply(Spawn(time=0.0, ball=Ball(position=(0.3, 5.5), radius=0.5))))
    together(session, company, 1)
    assert company.ghost_engine == "reference"
    assert company.ghost_distance == 0.0
    assert [level for level, text in company.notifications if "ghost of exact stopped" in text] == ["warning"]
    together(session, company, 5)
    assert company.ghost_distance is not None


def test_exact_ghost_of_a_heap_gives_up_and_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    """Rigid balls in a heap touch ever more often: it is given up by its own bounds, or its patience."""
    monkeypatch.setattr(companions, "CATCH_UP_TIME", 0.02)
    session = Session(pile(), "pymunk")
    company = Diagnostics(session)
    company.show_ghost(True)
    assert company.ghost_engine == "exact"
    for _ in range(400):
        together(session, company, 1)
        if company.ghost_engine != "exact":
            break
    assert company.ghost_engine == "reference" or company.ghost_engine is None  # which has no more patience either
    assert any("ghost of exact stopped" in text for _, text in company.notifications)
    together(session, company, 3)


def test_twin_loses_trust_when_compare_says_so() -> None:
    scene = gas()
    truth = truth_of(scene, scene.solver, default_tolerance(scene))
    assert truth is not None
    assert truth.trusted_until < scene.world.duration
    for engine in ("pymunk", "exact"):
        session = Session(scene, engine)
        trust = DivergenceMonitor(session.simulation.checkpoint())
        assert trust.tolerance == default_tolerance(scene)
        spreads = []
        while trust.state == "trusted" and session.time < 3.0 * truth.trusted_until:
            session.advance(5)
            beside(trust, session)
            spreads.append(trust.distance)
        assert trust.state == "lost"
        assert trust.horizon == session.time
        # Another engine's impacts come a step later or so, and let errors grow as fast: by a factor a collision.
        assert 0.5 * truth.trusted_until <= trust.horizon <= 2.0 * truth.trusted_until
        assert spreads[0] is not None
        assert spreads[0] < 1e-10
        beside(trust, session)
        assert trust.state == "lost"
        trust.close()


@pytest.mark.parametrize("engine", ENGINES)
def test_bounce_is_trusted_to_its_end(engine: str) -> None:
    session = Session(BOUNCE, engine)
    trust = DivergenceMonitor(session.simulation.checkpoint())
    for _ in range(60):
        session.advance(100)
        beside(trust, session)
    assert trust.state == "trusted"
    assert trust.horizon is None
    assert trust.distance is not None
    assert trust.distance < 1e-9


def test_what_meets_nothing_is_trusted_without_a_twin() -> None:
    session = Session(load(find("fireworks")))
    trust = DivergenceMonitor(session.simulation.checkpoint())
    assert not trust.can_diverge
    beside(trust, session)
    assert trust.state == "trusted"
    assert trust.distance is None
    trust.close()


def test_twin_that_ends_leaves_trust_unknown(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(companions, "CATCH_UP_TIME", 0.0)
    scene = load(find("gas"), [("grid.atom.velocity_jitter", 100.0), ("solver.dt", 10.0)])
    session = Session(scene, "exact")
    trust = DivergenceMonitor(session.simulation.checkpoint())
    trust.follow(1)
    trust.update(session.frame, 1)
    assert trust.state == "unknown"
    trust.follow(2)
    trust.apply(Impulse(time=0.0, body="atom-1", impulse=(1.0, 0.0)))
    trust.close()


def test_company_waits_while_the_session_goes_back_and_comes_again() -> None:
    session = Session(BOUNCE, "pymunk")
    company = Diagnostics(session)
    company.show_ghost(True)
    company.watch_divergence(True)
    kick = Impulse(time=0.0, body="ball", impulse=(0.5, 1.0))
    together(session, company, 200)
    company.apply(session.apply(kick))
    distance = {}
    for _ in range(200):
        together(session, company, 1)
        distance[session.step_number] = company.ghost_distance
    for _ in session.seek(250):
        pass
    company.restart()
    assert company.ghost_distance == distance[250]
    for _ in session.seek(100):
        pass
    company.restart()
    for step in range(101, 401):
        together(session, company, 1)
        assert company.ghost_distance == distance.get(step, company.ghost_distance)
    together(session, company, 100)  # and further than it had been
    assert company.ghost_distance is not None
    assert company.ghost_distance < 0.01  # g·h·t/2 is 2.5 mm at 0.5 s; 0.2 m without the kick
    assert company.divergence is not None
    assert company.divergence.state == "trusted"


def test_company_begins_anew_where_the_past_is_changed() -> None:
    session = Session(BOUNCE, "pymunk")
    company = Diagnostics(session)
    company.show_ghost(True)
    company.watch_divergence(True)
    together(session, company, 300)
    for _ in session.seek(100):
        pass
    company.restart()
    company.apply(session.apply(Impulse(time=0.0, body="ball", impulse=(0.5, 1.0))))
    assert company.ghost_distance == 0.0
    together(session, company, 10)
    assert company.divergence is not None
    assert company.divergence.state == "trusted"
    assert company.divergence.distance is not None
    assert company.divergence.distance < 1e-9  # m: ten steps of free flight add nothing to 1e-12


def test_companions_do_what_a_recording_does_again() -> None:
    first = Session(BOUNCE, "pymunk")
    first.advance(300)
    first.apply(Impulse(time=0.0, body="ball", impulse=(3.0, 4.0)))
    first.advance(300)
    session = Session(BOUNCE, "pymunk", actions=first.actions)
    company = Diagnostics(session)
    company.show_ghost(True)
    company.watch_divergence(True)
    for _ in range(12):
        session.advance(50)  # the kick lies within a batch
        company.advance(session.take_replayed_actions())
    assert company.ghost_distance is not None
    assert company.ghost_distance < 0.01  # g·h·t/2; without the kick it would be 1.5 m off
    assert company.divergence is not None
    assert company.divergence.state == "trusted"


def test_horizon_is_known_before_and_after_it_when_going_back() -> None:
    session = Session(gas(), "pymunk")
    company = Diagnostics(session)
    company.watch_divergence(True)
    assert company.divergence is not None
    company.divergence.tolerance = 1e-11
    while company.divergence.state == "trusted" and session.time < 5.0:
        together(session, company, 1)
    horizon, lost = company.divergence.horizon, session.step_number
    assert horizon is not None
    together(session, company, 10)
    for step, state in ((lost - 10, "trusted"), (lost + 5, "lost"), (lost - 1, "trusted")):
        for _ in session.seek(step):
            pass
        company.restart()
        assert company.divergence.state == state
    company.close()


def test_misses_are_counted_and_flash_and_those_of_the_future_are_forgotten() -> None:
    """A fast ball passes through a thin wall within a step."""
    scene = from_document(
        {
            "ball": [{"name": "a", "position": [0, 0], "radius": 0.1, "velocity": [100, 0]}],
            "wall": [{"points": [[5.5, -5], [5.5, 5]]}, {"points": [[10.5, -5], [10.5, 5]]}],
            "solver": {"dt": 0.01},
        }
    )
    session = Session(scene, "pymunk")
    company = Diagnostics(session)
    assert company.missed_contacts == 0
    seen = []
    for _ in range(14):
        together(session, company, 1)
        seen.append(company.missed_contacts)
    assert seen[-1] == 2
    assert all(a is not None and b is not None and a <= b for a, b in pairwise(seen))
    assert len(company.missed_markers) == 2
    for _ in session.seek(7):
        pass
    company.restart()
    assert company.missed_contacts == 1
    together(session, company, 7)
    assert company.missed_contacts == 2
    sparks = Diagnostics(Session(load(find("fireworks"))))
    assert sparks.missed_contacts is None
    assert sparks.missed_markers == ()


def test_follower_is_told_only_what_every_engine_knows() -> None:
    assert ghost_action(Switch(time=1.0, engine="exact", settings={"integrator": "rk4"})) is None
    assert ghost_action(Switch(time=1.0, settings={"dt": 0.1, "slop": 0.2})) == Switch(time=1.0, settings={"dt": 0.1})
    kick = Impulse(time=0.0, body="a", impulse=(1.0, 0.0))
    assert ghost_action(kick) is kick
    wanted = Settings(dt=0.1, substeps=3, slop=0.1, integrator="rk4", half_kick=True)
    assert wanted.common() == Settings(dt=0.1, substeps=3)


def test_apart_is_the_largest_distance_of_those_in_both() -> None:
    one = Session(from_document({"ball": [{"position": [5.0 * k, 0], "radius": 1} for k in range(2)]}))
    two = Session(from_document({"ball": [{"position": [5.0 * k, 4.0 * k], "radius": 1} for k in range(3)]}))
    assert max_body_distance(one.frame, two.frame) == 4.0
    assert max_body_distance(two.frame, one.frame) == 4.0
    two.apply(Remove(time=0.0, body="ball-2"))
    assert max_body_distance(one.frame, two.frame) == 0.0
    empty = Session(from_document({"title": "t"}))
    assert max_body_distance(one.frame, empty.frame) is None
    assert Diagnostics(empty).ghost_distance is None


def test_ghost_takes_over_a_steady_force_or_leaves_it_to_who_can() -> None:
    session = Session(from_document({"ball": [{"name": "a", "position": [0, 0], "radius": 1}]}), "pymunk")
    session.apply(Force(time=0.0, body="a", force=(1.0, 0.0)))
    company = Diagnostics(session)
    company.show_ghost(True)
    together(session, company, 100)
    ghost = company.ghost_frame
    assert ghost is not None
    assert company.ghost_engine == "reference"
    assert "exact cannot continue with the constant force on 'a'" in company.notifications[0][1]
    assert ghost.velocity[0] == pytest.approx([1.0, 0.0], rel=1e-12)  # a hundred sums


def test_companion_that_ended_is_quiet(monkeypatch: pytest.MonkeyPatch) -> None:
    companion = ShadowRun(Session(BOUNCE).simulation.checkpoint())
    companion.apply(Remove(time=0.0, body="zzz"))
    assert companion.ended is not None
    assert companion.frame is None
    companion.follow(3)
    companion.apply(Remove(time=0.0, body="ball"))
    companion.close()
    monkeypatch.setattr(companions, "ENGINES", {})
    with pytest.raises(ActionError, match="no other engine"):
        create_ghost(Session(BOUNCE).simulation.checkpoint())
    assert np.isfinite(Session(BOUNCE).frame.position).all()
