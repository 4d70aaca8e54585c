"""Advice for a game: errors against closed forms, remedies, the recommended setting run again, code, recordings."""

import math
import re
from typing import Any

import pymunk
import pytest

import sandbox
from sandbox.action import Impulse
from sandbox.arrays import FloatArray
from sandbox.engines.pymunk_adapter.engine import SPACE_DEFAULTS
from sandbox.engines.registry import ENGINES
from sandbox.measure.advice import Advice, advise, replays, scoring
from sandbox.measure.advice.game_code import game_code
from sandbox.measure.advice.text import fallback_head, target_text
from sandbox.measure.compare.ground_truth import truth_of
from sandbox.measure.metrics.trajectory_error import errors
from sandbox.measure.starts import Starts
from sandbox.recording import RecordedGame, Recording
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.world import Settings

pytestmark = pytest.mark.fail_slow(60)  # compiles kernels of `exact`, and measures many settings

QUICK = {"effort": 0.2, "repeats": 1}
FPS = 60.0

FLIGHT = """
title = "Flight"
world = { gravity = [0.0, -10.0], duration = 2.0 }
solver = { dt = 0.016666666666666666 }
ball = [{ name = "shell", position = [0.0, 0.0], velocity = [3.0, 10.0], radius = 0.1 }]
"""
BULLET = """
title = "Bullet"
world = { duration = 0.2 }
solver = { dt = 0.016666666666666666 }
wall = [{ name = "pane", points = [[1.0, -1.0], [1.0, 1.0]], thickness = 0.01 }]
ball = [{ name = "bullet", position = [0.0, 0.0], velocity = [20.0, 0.0], radius = 0.05, restitution = 1.0 }]
"""
PENDULUM = """
title = "Pendulum"
world = { gravity = [0.0, -9.81], duration = 3.0 }
solver = { dt = 0.016666666666666666 }
ball = [{ name = "bob", position = [1.0, 0.0], radius = 0.05, mass = 1.0, collides = "none" }]
joint = [{ name = "rod", kind = "rod", between = ["bob"], anchors = [[0.0, 0.0], [0.0, 0.0]], length = 1.0 }]
"""


def scene_of(text: str, *changes: str) -> Scene:
    """Return a scene with texts replaced, each as `old -> new`."""
    for change in changes:
        old, new = change.split(" -> ")
        assert old in text
        text = text.replace(old, new)
    return sandbox.loads(text, "scene.toml")


def advice_of(text: str, *changes: str, **options: Any) -> Advice:
    return advise(scene_of(text, *changes), **{**QUICK, **options})


@pytest.mark.parametrize("substeps", [1, 4])
def test_error_of_the_present_setting_is_that_of_euler_in_flight(substeps: int) -> None:
    advice = advice_of(
        FLIGHT, f"dt = 0.016666666666666666 -> dt = 0.016666666666666666, substeps = {substeps}", zoom=40.0
    )
    assert advice.present.error_px == pytest.approx(40.0 * 10.0 / FPS / substeps * 2.0 / 2.0, rel=1e-9)  # g·h·T/2
    assert (advice.truth, advice.is_predictable, advice.is_in_loop) == ("closed_form", True, True)


@pytest.mark.parametrize("dt", ["0.01", "0.0041", "0.05"])
def test_present_setting_with_another_dt_is_measured_as_it_is(dt: str) -> None:
    advice = advice_of(FLIGHT, f"0.016666666666666666 -> {dt}", "duration = 2.0 -> duration = 2.05")
    frames = math.floor(2.05 / float(dt) + 1e-9)
    bound = 10.0 * float(dt) * 2.05 / 2.0  # g·h·T/2; the last, incomplete step is shorter
    assert advice.present.settings.dt == float(dt)
    assert not advice.is_in_loop
    assert advice.present.error == pytest.approx(bound, rel=2.0 / frames)
    assert advice.recommended.settings.dt == pytest.approx(1.0 / FPS, rel=1e-12)


def test_every_setting_considered_has_the_dt_of_a_frame() -> None:
    advice = advice_of(FLIGHT, fps=50.0)
    settings = [advice.recommended, *(k.setting for k in advice.knobs), *(o.setting for o in advice.others)]
    assert {each.settings.dt for each in settings if each is not None} == {1.0 / 50.0}


def test_remedy_of_a_ball_that_tunnels_removes_it() -> None:
    advice = advice_of(BULLET)
    assert advice.present.missed_contacts == 1
    assert not advice.is_within_tolerance(advice.present)
    first = advice.risks[0]
    assert (first.kind, first.element, first.is_observed) == ("tunnelling", "bullet", True)
    assert first.odds == pytest.approx(1.0 - 0.055 * FPS / 20.0, abs=2 / 30)  # 30 starts with evenly divided phases
    assert first.safe_substeps == math.ceil(20.0 / FPS / (0.05 + 0.005))  # v·h ≤ r + half the thickness
    chosen = advice.recommended
    again = sandbox.run(scene_of(BULLET), "pymunk", **chosen.asked.model_dump())
    assert again.missed_contacts == 0
    assert again.velocity[-1, 0, 0] < 0.0
    safe = chosen.asked.replace(substeps=first.safe_substeps)
    assert sandbox.run(scene_of(BULLET), "pymunk", **safe.model_dump()).missed_contacts == 0


@pytest.mark.fail_slow(60)  # takes over half a second
@pytest.mark.parametrize("text", [FLIGHT, BULLET, PENDULUM])
def test_recommended_setting_meets_the_tolerance_when_run_again(text: str) -> None:
    advice, scene = advice_of(text, effort=1.0), scene_of(text)
    own = advice.recommended.asked
    truth = truth_of(scene, own, 1e-4)
    run = sandbox.run(scene, "pymunk", **own.model_dump())
    found = errors(run, truth.trajectory, ~scene.bodies.fixed).largest("position", truth.trusted_until)
    assert found == pytest.approx(advice.recommended.error, abs=1e-4)
    assert found is not None and found <= advice.tolerance


@pytest.mark.fail_slow(60)  # takes over half a second
def test_recommended_setting_leaves_the_margin_unused() -> None:
    without, found = advice_of(PENDULUM, effort=0.5), advice_of(PENDULUM, effort=0.5, margin=0.8)
    assert without.recommended.error > 0.2 * without.tolerance, "otherwise the margin changes nothing"
    assert found.recommended.error <= 0.2 * found.tolerance
    assert "less a margin of 80 %" in target_text(found)


def test_knobs_of_a_flight_have_the_errors_of_euler() -> None:
    knobs = {knob.change: knob for knob in advice_of(FLIGHT).knobs}
    assert knobs["substeps 1 → 2"].error_ratio == pytest.approx(0.5, rel=1e-9)
    kick = knobs["half_kick false → true"].setting
    assert kick.error is not None and kick.error < 1e-9
    assert all(knob.setting.frame_ms is not None and knob.cost_ratio is not None for knob in knobs.values())


@pytest.mark.fail_slow(60)  # takes over half a second
def test_other_engines_have_a_setting_or_a_reason() -> None:
    others = {other.engine: other for other in advice_of(PENDULUM, effort=1.0).others}
    assert set(others) == set(ENGINES) - {"pymunk"}
    exact = others["exact"]
    assert exact.setting is None and exact.missing is not None and "rods" in exact.missing
    for name in set(others) - {"exact"}:
        assert others[name].missing is None
        assert others[name].setting is not None


def test_engine_that_cannot_run_the_scene_is_refused_and_the_others_are_measured() -> None:
    advice = advice_of(PENDULUM, engine="exact")
    assert (advice.present.status, advice.recommended, advice.code, advice.risks) == ("refused", None, None, ())
    assert any(other.setting is not None for other in advice.others)
    assert not advice.is_met


def test_budget_that_no_setting_fits_leaves_the_cheapest_with_its_error() -> None:
    advice = advice_of(FLIGHT, budget=1e-9)
    assert advice.recommended is not None
    assert advice.fits_budget(advice.recommended) is False
    assert not advice.is_met
    assert advice_of(FLIGHT, budget=1e6).is_met


def test_tolerance_that_no_setting_meets_leaves_the_most_accurate_one() -> None:
    advice = advice_of(PENDULUM, tolerance=1e-12)
    assert advice.recommended is None
    assert advice.fallback is not None and advice.fallback_kind == "accuracy"
    assert advice.chosen is advice.fallback
    assert advice.code is not None


@pytest.mark.nightly
def test_errors_of_a_chaotic_scene_count_until_the_horizon() -> None:
    advice = advise(sandbox.load("gas", ["world.duration=9.0"]), **QUICK)
    assert advice.trusted_until is not None and advice.trusted_until < 9.0
    assert advice.invariant == "energy"
    assert advice.present.invariant is not None
    assert advice.present.within_until is not None and advice.present.within_until <= advice.trusted_until


def test_without_a_truth_position_errors_are_absent(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(scoring, "find_truth", lambda *_: "the test has none")
    advice = advice_of(PENDULUM)
    assert (advice.truth, advice.truth_about, advice.trusted_until) == (None, "the test has none", None)
    assert advice.metric == "joint_error"
    assert advice.metric_reason is not None
    assert advice.present.error_px is None


@pytest.mark.parametrize("half_kick", [False, True])
@pytest.mark.parametrize("substeps", [1, 3])
def test_code_gives_a_space_the_recommended_values(substeps: int, half_kick: bool) -> None:
    scene = scene_of(BULLET)
    asked = Settings(dt=1.0 / FPS, substeps=substeps, iterations=17, persistence=5, bias=0.01, half_kick=half_kick)
    resolved = ENGINES["pymunk"].resolve(scene, asked)
    code = game_code("pymunk", resolved, FPS, 50.0, is_slop_stated=False)
    space = pymunk.Space()
    space.gravity = 0.0, -10.0
    body = pymunk.Body(1.0, 1.0)
    space.add(body)
    steps: list[float] = []
    step = space.step
    namespace = {"space": space, "pymunk": pymunk}
    space.step = lambda dt: (steps.append(dt), step(dt))  # type: ignore[method-assign,func-returns-value]
    exec("\n".join(code.lines), namespace)
    assert space.iterations == 17
    assert space.collision_slop == resolved.slop == 0.0005
    assert space.collision_bias == 0.01
    assert space.collision_persistence == 5
    assert steps == pytest.approx([1.0 / FPS / substeps] * substeps, rel=1e-12)
    h = 1.0 / FPS / substeps
    assert body.velocity.y == pytest.approx(-10.0 * (1.0 / FPS + (0.5 * h if half_kick else 0.0)), rel=1e-12)


def test_code_sets_the_sleep_of_a_space() -> None:
    asked = Settings(dt=1.0 / FPS, sleeping=True, idle_speed=0.2)
    code = game_code("pymunk", ENGINES["pymunk"].resolve(scene_of(BULLET), asked), FPS, 50.0, is_slop_stated=False)
    space = pymunk.Space()
    exec("\n".join(code.lines), {"space": space})
    assert (space.sleep_time_threshold, space.idle_speed_threshold) == (0.5, 0.2)


def test_defaults_of_pymunk_are_those_of_a_new_space() -> None:
    space = pymunk.Space()
    for name, value in SPACE_DEFAULTS.items():
        assert getattr(space, name) == pytest.approx(value, rel=1e-5), name  # pymunk rounds them to 32 bits


def test_code_leaves_out_values_that_are_the_defaults() -> None:
    scene = scene_of(BULLET)
    resolved = ENGINES["pymunk"].resolve(scene, Settings(dt=1.0 / FPS, slop=0.1))
    assert game_code("pymunk", resolved, FPS, 50.0, is_slop_stated=True).lines == (
        "dt = 1 / 60",
        "space.step(dt)  # every frame",
    )


def test_remark_states_that_the_slop_differs_from_the_default_of_pymunk() -> None:
    code = advice_of(BULLET).code
    assert code is not None and code.language == "python"
    assert any("collision_slop" in remark and "0.1" in remark for remark in code.remarks)


def test_code_of_box2d_steps_with_the_recommended_substeps() -> None:
    pytest.importorskip("pyb2d3")
    advice = advice_of(FLIGHT, engine="box2d")
    assert advice.chosen is not None and advice.code is not None
    assert advice.code.language == "c"
    assert f"b2World_Step(world, 1.0f / 60f, {advice.chosen.settings.substeps});" in advice.code.lines[-1]


def test_recording_is_advised_on_without_its_actions_and_replayed_with_them() -> None:
    scene = scene_of(BULLET, "velocity = [20.0, 0.0] -> velocity = [0.5, 0.0]")
    push = Impulse(time=0.05, body="bullet", impulse=(19.5, 0.0))  # of 1 kg
    recording = Recording(scene, "pymunk", scene.solver, (push,), duration=0.2)
    advice = advise(recording, **QUICK)
    assert (advice.engine, advice.recorded_actions, advice.duration) == ("pymunk", 1, 0.2)
    assert advice.present.missed_contacts == 0
    replays = {each.setting: each for each in advice.replays}
    assert (replays["present"].status, replays["present"].missed_contacts) == ("ok", 1)
    # The cheapest setting without the actions lets the bullet pass with them.
    assert (replays["rejected"].status, replays["rejected"].missed_contacts) == ("ok", 1)
    assert (replays["recommended"].status, replays["recommended"].missed_contacts) == ("ok", 0)
    again = sandbox.run(scene, "pymunk", actions=[push], **advice.recommended.asked.model_dump())
    assert again.missed_contacts == 0


@pytest.mark.fail_slow(60)  # some hundred runs
def test_recording_is_replayed_from_perturbed_starts_with_later_actions() -> None:
    """Whether the bullet passes the wall depends on the phase of the step, and on the step in which it is pushed."""
    scene = scene_of(BULLET, "velocity = [20.0, 0.0] -> velocity = [6.0, 0.0]")
    push = Impulse(time=0.04, body="bullet", impulse=(14.0, 0.0))  # of 1 kg
    recording = Recording(scene, "pymunk", scene.solver, (push,), duration=0.2)
    advice = advise(recording, starts=30, **QUICK)
    found = {each.setting: each.over_starts for each in advice.replays}
    present, recommended = found["present"], found["recommended"]
    assert present is not None
    assert 0 < present.hits < present.trials == 30
    assert recommended is not None
    assert recommended.hits >= 0.95 * recommended.trials
    drawn, actions = Starts(scene, step=1.0 / FPS), [push]
    again = [
        sandbox.run(drawn.start(k), "pymunk", actions=drawn.actions(actions, k)).missed_contacts for k in range(1, 31)
    ]
    assert again.count(0) == present.hits


def test_recording_is_replayed_from_as_few_starts_as_asked_for() -> None:
    scene = scene_of(BULLET, "velocity = [20.0, 0.0] -> velocity = [6.0, 0.0]")
    push = Impulse(time=0.04, body="bullet", impulse=(14.0, 0.0))  # of 1 kg
    advice = advise(Recording(scene, "pymunk", scene.solver, (push,), duration=0.2), starts=2, **QUICK)
    assert [each.over_starts.trials for each in advice.replays if each.over_starts is not None][:1] == [2]


PUSHED_TOWER = """
world = { gravity = [0.0, -10.0], duration = 1.0 }
solver = { dt = 0.016666666666666666, iterations = 30 }
plane = [{ name = "floor", point = [0.0, 0.0], normal = [0.0, 1.0], friction = 1.0 }]
stack = [{ name = "box", base = [0.0, 0.0], size = [0.5, 0.5], columns = 1, rows = 5, friction = 0.5 }]
ball = [{ name = "ball", position = [-2.0, 1.2], velocity = [0.0, 0.0], radius = 0.2, fixed_rotation = true }]
"""


def test_setting_that_departs_sooner_from_finer_steps_with_the_actions_is_not_recommended() -> None:
    """Without its push the tower stands with any number of iterations; with it, the cheapest setting leans first."""
    scene = scene_of(PUSHED_TOWER)
    push = Impulse(time=0.1, body="ball", impulse=(8.0, 0.0))
    advice = advise(Recording(scene, "pymunk", scene.solver, (push,), duration=1.0), tolerance=0.01, **QUICK)
    assert not advice.is_still_without_actions
    present = advice.replays[0]
    assert present.setting == "present"
    assert present.finer_substeps == 8
    for each in advice.replays[1:]:
        is_hasty = each.departs_at is not None and (
            present.departs_at is None or each.departs_at < 0.8 * present.departs_at
        )
        assert (each.setting == "rejected") == (bool(each.missed_contacts) or is_hasty)
    own, finer = (
        sandbox.run(scene, "pymunk", actions=[push], iterations=30, substeps=substeps).position for substeps in (1, 8)
    )
    distance = ((own - finer) ** 2).sum(axis=2) ** 0.5
    assert present.farthest == pytest.approx(distance.max(), rel=1e-12)
    assert present.departs_at == pytest.approx((distance > 0.01).any(axis=1).argmax() / FPS, rel=1e-9)


@pytest.mark.fail_slow(60)  # some hundred runs
def test_departures_from_finer_steps_are_compared_over_starts() -> None:
    """Each setting departs from the run of eight substeps with the same start and the same later push."""
    scene, push = scene_of(PUSHED_TOWER), Impulse(time=0.1, body="ball", impulse=(8.0, 0.0))
    recording = Recording(scene, "pymunk", scene.solver, (push,), duration=1.0)
    advice = advise(recording, tolerance=0.04, starts=10, effort=2.0, repeats=1)
    present, chosen = advice.replays
    assert (present.setting, chosen.setting) == ("present", "recommended")
    assert (present.finer_substeps, chosen.finer_substeps) == (8, 8)
    assert present.sooner_over_starts is None
    assert chosen.sooner_over_starts is not None
    drawn = Starts(scene, step=1.0 / FPS)

    def run_from(number: int, settings: Settings) -> FloatArray:
        actions = drawn.actions([push], number)
        return sandbox.run(drawn.start(number), "pymunk", actions=actions, **settings.model_dump()).position

    sooner = 0
    for number in range(1, 11):
        finer = run_from(number, scene.solver.replace(substeps=8))
        times = []
        for settings in (advice.present.asked, advice.recommended.asked):
            beyond = (((run_from(number, settings) - finer) ** 2).sum(axis=2) ** 0.5 > 0.04).any(axis=1)
            times.append(beyond.argmax() if beyond.any() else math.inf)
        sooner += times[1] < 0.8 * times[0]
    assert (chosen.sooner_over_starts.hits, chosen.sooner_over_starts.trials) == (sooner, 10)
    # From the start of the recording it departs sooner, too; but that is one start of eleven.
    assert chosen.departs_at is not None
    assert present.departs_at is not None
    assert chosen.departs_at < 0.8 * present.departs_at


def test_recommended_setting_is_compared_to_finer_steps_than_its_own() -> None:
    """Its tolerance takes more substeps than the 8 to which the present setting is compared."""
    text = """
world = { gravity = [0.0, -10.0], duration = 2.0 }
solver = { dt = 0.016666666666666666 }
plane = [{ name = "floor", point = [0.0, 0.0], normal = [0.0, 1.0] }]
ball = [{ name = "ball", position = [0.0, 2.0], radius = 0.2, restitution = 0.9 }]
"""
    scene = scene_of(text)
    push = Impulse(time=0.5, body="ball", impulse=(0.01, 0.0))
    advice = advise(Recording(scene, "pymunk", scene.solver, (push,), duration=2.0), tolerance=0.01, **QUICK)
    assert advice.recommended is not None
    assert advice.recommended.settings.substeps > 8
    replays = {each.setting: each for each in advice.replays}
    assert replays["present"].finer_substeps == 8
    assert replays["recommended"].finer_substeps == 2 * advice.recommended.settings.substeps
    assert replays["recommended"].departs_at is None


PUCK = """
world = { duration = 1.0 }
solver = { dt = 0.016666666666666666 }
ball = [{ name = "puck", position = [0.0, 0.0], radius = 0.2, mass = 1.0 }]
wall = [{ name = "edge", points = [[1.0, -9.0], [1.0, 9.0]], restitution = 1.0 }]
joint = [{ kind = "pivot", between = ["puck"], anchors = [[0.0, 0.0], [0.0, 0.0]], max_bias = 0.0, max_force = 2.0 }]
"""


def advice_on_a_puck() -> Advice:
    """Return the advice on a puck on a table seen from above, which is pushed."""
    scene = scene_of(PUCK)
    push = Impulse(time=0.1, body="puck", impulse=(5.0, 0.0))
    return advise(Recording(scene, "pymunk", scene.solver, (push,), duration=1.0), **QUICK)


def test_scene_at_rest_without_its_actions_gives_no_recommendation() -> None:
    """The recording compares more substeps instead."""
    advice = advice_on_a_puck()
    assert advice.is_still_without_actions
    assert (advice.recommended, advice.fallback, advice.code) == (None, None, None)
    assert [each.setting for each in advice.replays] == ["present", "tried", "tried"]
    farthest = [each.farthest for each in advice.replays]
    assert farthest == sorted(farthest, reverse=True)  # the finer, the closer to the finest
    assert farthest[-1] < 0.5 * farthest[0]


@pytest.mark.parametrize(("finest", "count"), [(8, 2), (4, 1), (2, 0)])
def test_substeps_are_compared_to_at_least_twice_as_many(
    finest: int, count: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A recording whose runs are expensive is compared to fewer substeps."""
    monkeypatch.setattr(replays, "FINER", (finest,))
    present, *tried = advice_on_a_puck().replays
    assert [each.setting for each in tried] == ["tried"] * count
    assert {each.finer_substeps for each in (present, *tried)} == {finest}


@pytest.mark.parametrize("omitted", [(), ("1 collision callback (space.on_collision)",)])
def test_code_with_other_substeps_names_the_impulses_of_callbacks(omitted: tuple[str, ...]) -> None:
    scene = scene_of(BULLET)
    push = Impulse(time=0.01, body="bullet", impulse=(1.0, 0.0))
    game = RecordedGame(omitted)
    advice = advise(Recording(scene, "pymunk", scene.solver, (push,), duration=0.2, game=game), zoom=50.0, **QUICK)
    assert advice.recommended is not None and advice.code is not None
    substeps = advice.recommended.settings.substeps
    assert substeps > 1
    remarks = [each for each in advice.code.remarks if "callbacks" in each]
    assert [f"{1.0 / substeps:.3g} times as long" in each for each in remarks] == [True] * len(omitted)


@pytest.mark.parametrize("zoom", [1.0, 50.0])
def test_forecast_is_in_px_if_the_unit_of_length_is_the_pixel(zoom: float) -> None:
    advice = advice_of(BULLET, zoom=zoom)
    (text,) = {risk.message for risk in advice.risks if risk.kind == "tunnelling"}
    assert ("20 px/s, 0.333 px per substep" in text, "20 m/s, 0.333 m per substep" in text) == (
        zoom == 1.0,
        zoom != 1.0,
    )


@pytest.mark.parametrize(("zoom", "unit"), [(1.0, "px"), (50.0, "m")])
def test_distance_of_a_refined_truth_is_in_the_unit_of_length(zoom: float, unit: str) -> None:
    advice = advice_of(PENDULUM, "duration = 3.0 -> duration = 1.0, linear_drag = 0.5", zoom=zoom)
    assert advice.truth == "refined"
    assert re.search(rf"within [\d.e-]+ {unit}($|[ ,;])", advice.truth_about)


def test_no_setting_that_misses_contacts_with_the_actions_is_recommended(monkeypatch: pytest.MonkeyPatch) -> None:
    """The bullet becomes so fast that no number of substeps that is tried stops it."""
    monkeypatch.setattr(replays, "MAX_DOUBLINGS", 1)
    scene = scene_of(BULLET, "velocity = [20.0, 0.0] -> velocity = [0.5, 0.0]")
    push = Impulse(time=0.05, body="bullet", impulse=(9e3, 0.0))  # of 1 kg
    advice = advise(Recording(scene, "pymunk", scene.solver, (push,), duration=0.2), **QUICK)
    assert advice.recommended is None
    assert not advice.is_met
    assert {each.setting for each in advice.replays} == {"present", "rejected"}
    assert (advice.fallback_kind, advice.is_within_tolerance(advice.fallback)) == ("actions", True)
    assert "without the actions" in fallback_head(advice)


@pytest.mark.parametrize("name", ["fps", "zoom", "tolerance", "budget", "effort", "time_limit"])
@pytest.mark.parametrize("value", [0.0, -1.0, math.inf, math.nan])
def test_number_out_of_range_is_refused(name: str, value: float) -> None:
    with pytest.raises(ValueError, match=name.split("_")[0]):
        advice_of(FLIGHT, **{name: value})


def test_scene_shorter_than_four_frames_is_refused() -> None:
    with pytest.raises(ValueError, match="fewer than 4 frames"):
        advice_of(FLIGHT, fps=1.0)
