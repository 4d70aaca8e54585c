"""Whole comparisons of engines, against known numbers."""

from dataclasses import replace
from typing import Any, get_args

import pytest

import sandbox
from sandbox.engines.pymunk_adapter.engine import PymunkEngine
from sandbox.measure.compare import compare
from sandbox.measure.compare import ground_truth as truth_module
from sandbox.measure.compare.attribution import NOT_CHANGED, SettingEffect, setting_changes, verdict
from sandbox.measure.compare.ground_truth import truth_of
from sandbox.measure.compare.result import Score
from sandbox.progress import Progress
from sandbox.scene.description.world import DetectionName, IntegratorName, Settings
from sandbox.scene.files.load import load, loads
from sandbox.scene.files.shipped_scenes import find
from tests.measure.compare.altered_engines import AlteredPymunk, install

pytestmark = pytest.mark.fail_slow(60)  # long runs and sweeps

BOUNCE = load(find("bounce"), ["world.duration=2.0"])


def test_bounce_is_matched_with_its_delay() -> None:
    comparison = compare(BOUNCE, ["pymunk"], tolerance=0.002)
    assert (comparison.truth, comparison.trusted_until) == ("closed_form", 2.0)
    (row,) = comparison.rows
    before = [error for error in (9.81 * 0.001 * t / 2.0 for t in (0.407, 0.408)) if error > 0.002]
    assert len(before) == 1  # the tolerance is exceeded between these two frames
    assert row.first_divergence == pytest.approx(0.408, rel=1e-12)
    (event,) = row.events or ()
    assert event.between == ("ball", "ground")
    assert event.time == pytest.approx(1.0096375546923, rel=1e-12)  # √(2·5/9.81)
    assert row.seconds > 0
    assert 0.0 < event.delta_time < 0.002  # late by g·h·T/2 over v = 0.5 ms, and by one step of detection


def test_engine_that_refuses_is_a_row_with_its_reason() -> None:
    comparison = compare(BOUNCE, ["pymunk"], integrator="rk4")
    (row,) = comparison.rows
    assert row.status == "refused"
    assert row.reason is not None
    assert "integrator 'rk4'" in row.reason
    assert row.score == Score()
    assert row.events is row.seconds is row.energy_drift is None
    assert comparison.truth == "closed_form"  # belongs to the scene, not to the compared engine
    assert comparison.trajectories == {}


def test_without_names_every_engine_has_a_row(monkeypatch: pytest.MonkeyPatch) -> None:
    unable = AlteredPymunk("unable", lacks=("it models nothing",))
    install(monkeypatch, pymunk=PymunkEngine(), other=AlteredPymunk("other"), unable=unable)
    comparison = compare(BOUNCE)
    assert [(row.engine, row.status) for row in comparison.rows] == [
        ("pymunk", "ok"),
        ("other", "ok"),
        ("unable", "refused"),
    ]
    assert list(comparison.trajectories) == ["pymunk", "other"]


BOUNDED = "world.bounds=[[-9.0, -9.0], [9.0, 9.0]]"
"""No body gets there, but bounds exclude a closed form, so that an engine computes the truth."""


def test_exact_is_the_truth_if_it_models_the_scene(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = load(find("two_balls"), ["solver.dt=0.01", BOUNDED])
    install(monkeypatch, pymunk=PymunkEngine(), exact=AlteredPymunk("exact"))
    comparison = compare(scene, ["pymunk"])
    assert comparison.truth == "exact"
    assert comparison.rows[0].score.max_position == 0.0
    install(monkeypatch, pymunk=PymunkEngine(), exact=AlteredPymunk("exact", lacks=("it does not model this",)))
    assert compare(scene, ["pymunk"]).truth == "refined"


def test_only_the_run_that_is_the_truth_is_marked() -> None:
    found = compare("bullet", ("exact", "box2d"), sweep={"solver.dt": [0.001, 0.0005]})
    assert [(row.engine, row.is_truth) for row in found.rows] == [
        ("exact", True),
        ("box2d", False),
        ("exact", True),
        ("box2d", False),
    ]
    assert [row.score.max_position for row in found.rows if row.is_truth] == [0.0, 0.0]
    formula = compare("two_balls", ("exact",)).rows[0]
    assert formula.truth == "closed_form" and formula.score.max_position == 0.0
    assert not formula.is_truth, "an error of 0 against a formula is measured"


def test_refined_truth_is_the_run_with_its_settings() -> None:
    scene = load(find("double_pendulum"), ["world.duration=0.5"])
    truth = truth_of(scene, scene.solver, 0.05)
    assert truth is not None and truth.kind == "refined"
    engine, settings = truth.trajectory.info["engine"], Settings.model_validate(truth.trajectory.info["settings"])
    assert truth.is_run_of(engine, settings)
    assert truth.is_run_of(engine, settings.replace(record_every=1))
    assert not truth.is_run_of(engine, settings.replace(dt=2.0 * settings.dt))
    assert not truth.is_run_of("pymunk" if engine != "pymunk" else "box2d", settings)


def test_exact_stopped_by_its_limit_is_replaced_by_a_refined_truth(monkeypatch: pytest.MonkeyPatch) -> None:
    install(monkeypatch, pymunk=PymunkEngine(), exact=AlteredPymunk("exact"))
    monkeypatch.setattr(truth_module, "EXACT_LIMIT", -1.0)
    scene = load(find("two_balls"), ["solver.dt=0.01", BOUNDED])
    truth = truth_of(scene, scene.solver, 1e-3)
    assert truth.kind == "refined"
    assert "; exact was stopped: more counted work than" in truth.about


def test_truth_does_not_depend_on_the_compared_settings(monkeypatch: pytest.MonkeyPatch) -> None:
    install(monkeypatch, pymunk=PymunkEngine())
    scene = load(find("newtons_cradle"), ["world.duration=0.4", BOUNDED])
    rough, fine = (compare(scene, ["pymunk"], iterations=n, slop=s) for n, s in ((2, 0.01), (20, 0.0)))
    assert (rough.best.trajectory.position == fine.best.trajectory.position).all()


def test_missed_wall_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    install(monkeypatch, pymunk=PymunkEngine())
    (row,) = compare(load(find("bullet")), ["pymunk"]).rows
    assert [(e.kind, e.between) for e in row.events or ()] == [("missed", ("bullet", "wall"))]
    assert row.energy_drift == pytest.approx(0.75, rel=1e-9)  # it kept all of its energy instead of e² = ¼


def test_why_names_half_kick_and_the_effect_of_finer_steps() -> None:
    (row,) = compare(load(find("ball")), ["pymunk"], why=True).rows
    tried = {(effect.setting, effect.value): effect for effect in row.why}
    assert tried["dt", 0.005].ratio == pytest.approx(0.5, rel=1e-9)  # first order; hundreds of roundings of 10 m
    assert tried["substeps", 4].ratio == pytest.approx(0.25, rel=1e-9)  # likewise
    assert tried["slop", 0.0].ratio == tried["iterations", 40].ratio == 1.0
    assert tried["integrator", "rk4"].status == "refused"
    assert tried["detection", "swept"].status == "refused"
    assert tried["half_kick", True].max_position_error == pytest.approx(0.0, abs=1e-12)  # roundings of 10 m
    assert row.verdict.startswith("pymunk: the most effective change is half_kick = True: ")
    assert not any(" and " in effect.label for effect in row.why)  # a single change suffices


@pytest.mark.nightly
def test_why_combines_two_methods_if_neither_suffices_alone() -> None:
    """A bounce is exact to rounding with both exact flight and exact impact times, and with neither alone."""
    (row,) = compare(BOUNCE, ["reference"], why=True).rows
    tried = {effect.label: effect for effect in row.why}
    flight, impact = "integrator = velocity_verlet", "detection = bisect"
    alone = min(tried[flight].ratio or 0.0, tried[impact].ratio or 0.0)
    both = tried[f"{flight} and {impact}"]
    assert alone > 0.1
    assert both.ratio < 1e-6 * alone
    assert dict(both.changes) == {"integrator": "velocity_verlet", "detection": "bisect"}
    assert row.verdict is not None
    assert f"the most effective change is {flight} and {impact}" in row.verdict


def test_why_is_empty_for_an_engine_without_error() -> None:
    (row,) = compare(load(find("ball")), ["pymunk"], why=True, half_kick=True).rows
    assert (row.why, row.verdict) == ((), None)


def sample_value(annotation: Any) -> Any:
    """Return a value of the type of a setting."""
    parts = [part for part in get_args(annotation) if part is not type(None)]
    if parts and isinstance(parts[0], str):
        return parts[0]
    kind = next((part for part in (annotation, *parts) if part in (bool, int, float)), None)
    return {bool: False, int: 3, float: 0.25}[kind] if kind else sample_value(parts[0])


def test_every_setting_is_changed_or_excluded_with_a_reason() -> None:
    """Every setting, including later ones, yields a valid change if it has a value."""
    filled = Settings(**{name: sample_value(info.annotation) for name, info in Settings.model_fields.items()})
    tried: dict[str, list[dict[str, Any]]] = {}
    for name, _, changes in setting_changes(filled):
        tried.setdefault(name, []).append(changes)
        other = filled.replace(**changes)
        assert other != filled
        assert other.dt * other.record_every == filled.dt * filled.record_every  # the same frames are recorded
    assert set(tried) | set(NOT_CHANGED) == set(Settings.model_fields)
    assert not set(tried) & set(NOT_CHANGED)
    assert all(NOT_CHANGED.values())
    counts = {name: len(set(map(str, values))) for name, values in tried.items()}
    assert counts["integrator"] == len(get_args(IntegratorName)) - 1
    assert counts["detection"] == len(get_args(DetectionName)) - 1


def test_verdict_names_the_first_of_equal_effects() -> None:
    effect = SettingEffect("dt", 0.5, "ok", None, 0.4, 0.4)
    others = [
        replace(effect, setting="integrator", value=value, max_position_error=r, ratio=r)
        for value, r in (("a", 2e-13), ("b", 1e-13))
    ]
    assert "integrator = a" in verdict("e", (effect, *others), 1.0)
    assert "no other setting lowers" in verdict("e", (replace(effect, ratio=0.95), replace(effect, ratio=3.0)), 1.0)
    assert "no other setting could be tried" in verdict("e", (replace(effect, status="refused", ratio=None),), 1.0)


def test_scene_without_bodies_can_be_compared() -> None:
    comparison = compare(loads("[world]\nduration = 0.1\n"), ["pymunk"])
    (row,) = comparison.rows
    assert (row.status, row.score.max_position, row.energy_drift, row.momentum_drift) == ("ok", None, 0.0, 0.0)


def test_diverged_engine_is_a_row_with_its_status() -> None:
    scene = load(find("bounce"), ["world.duration=10.0", "world.gravity=[1e9, 0.0]"])
    comparison = compare(scene, ["pymunk"], dt=0.1)
    (row,) = comparison.rows
    assert row.status == "diverged"
    assert row.energy_drift is None
    assert comparison.document()["engines"][0]["status"] == "diverged"


@pytest.mark.parametrize("tolerance", [0.0, -1.0, float("nan"), float("inf")])
def test_tolerance_out_of_range_is_rejected(tolerance: float) -> None:
    with pytest.raises(ValueError, match="positive and finite"):
        compare(BOUNCE, ["pymunk"], tolerance=tolerance)


def test_progress_names_each_stage_of_a_comparison() -> None:
    states: list[Progress] = []
    compare(load(find("ball")), ["pymunk"], why=True, on_progress=states.append)
    assert [state.message for state in states] == ["the truth", "pymunk", "pymunk: why"]


def test_given_truth_is_not_computed_again(monkeypatch: pytest.MonkeyPatch) -> None:
    known = truth_of(BOUNCE, BOUNCE.solver, 1e-3)

    def fail(*_: Any) -> None:
        raise AssertionError("the truth is known")

    monkeypatch.setattr("sandbox.measure.compare.comparison.find_truth", fail)
    monkeypatch.setattr("sandbox.measure.tradeoff.start_trials.find_truth", fail)
    compared = compare(BOUNCE, ("pymunk",), truth=known)
    assert compared.best is known
    studied = sandbox.tradeoff(BOUNCE, ("pymunk",), truth=known, most=1, repeats=1, starts=1)  # others have their own
    assert studied.points[0].error == compared.rows[0].score.max_position
