"""Refined truths end where a second method contradicts them, or where they violate a conservation law."""

from dataclasses import replace
from typing import Any

import pytest

from sandbox.engines.pymunk_adapter.engine import PymunkEngine
from sandbox.measure.compare import compare
from sandbox.measure.compare import ground_truth as witness
from sandbox.measure.compare import self_convergence as refined
from sandbox.measure.compare.ground_truth import find_truth, truth_of
from sandbox.scene.compile.scene import Scene
from sandbox.scene.compile.setup import Setup
from sandbox.scene.description.world import Settings
from sandbox.scene.files.load import from_document, loads
from tests.measure.compare.altered_engines import AlteredPymunk, install

pytestmark = pytest.mark.fail_slow(60)  # long runs and sweeps

DROP = """
[world]
gravity = [0.0, -10.0]
duration = 1.0
[solver]
dt = 0.01
[[plane]]
point = [0.0, 0.0]
normal = [0.0, 1.0]
[[ball]]
position = [0.0, 0.745]
radius = 0.1
restitution = 0.5
"""
"""The ball falls 0.645 m and hits the floor at √0.129 = 0.359 s."""
IMPACT_TIME = 0.129**0.5
TOLERANCE = 1e-3


@pytest.fixture(autouse=True)
def _no_closed_forms(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sandbox.measure.compare.ground_truth.solution", lambda _: None)


def test_two_engines_that_agree_confirm_each_other(monkeypatch: pytest.MonkeyPatch) -> None:
    install(monkeypatch, pymunk=PymunkEngine(), another=AlteredPymunk())
    truth = truth_of(loads(DROP), loads(DROP).solver, TOLERANCE)
    assert (truth.kind, truth.trusted_until, truth.witness) == ("refined", 1.0, "another")
    assert "confirmed by another" in truth.about


def test_truth_ends_where_two_engines_diverge(monkeypatch: pytest.MonkeyPatch) -> None:
    install(monkeypatch, pymunk=PymunkEngine(), another=AlteredPymunk(restitution=0.5))
    comparison = compare(loads(DROP), ["pymunk"], tolerance=TOLERANCE)
    # After impact at 3.6 m/s they differ by 0.9 m/s, hence by the tolerance within 1.2 ms: 0.36 s is the first frame.
    assert IMPACT_TIME - 0.01 <= comparison.trusted_until <= IMPACT_TIME + 0.01  # frames are 0.01 s apart
    until = f"no truth is known after {comparison.trusted_until:.4g} s"
    assert f"{until}: pymunk and another converge to different results" in comparison.sentence()
    (row,) = comparison.rows
    assert row.count("missed") == row.count("phantom") == 0


@pytest.mark.nightly
def test_there_is_no_truth_if_two_engines_never_agree(monkeypatch: pytest.MonkeyPatch) -> None:
    install(monkeypatch, pymunk=PymunkEngine(), another=AlteredPymunk(gravity=10.0))
    scene = loads(DROP)
    found = find_truth(scene, scene.solver, 1e-4)  # ½·90·0.01² is 4.5 mm in the first frame
    assert isinstance(found, str)
    document = compare(scene, ["pymunk"], tolerance=1e-4).document()
    assert (document["truth"], document["trusted_until"]) == (None, None)
    assert "pymunk and another converge to different results" in document["truth_about"]
    (row,) = document["engines"]
    assert row["status"] == "ok"
    assert row["energy_drift"] is not None  # conserved quantities need no truth
    assert row["max_position_error"] is row["missed_contacts"] is row["first_divergence"] is None


def test_truth_ends_where_energy_grows_without_a_source(monkeypatch: pytest.MonkeyPatch) -> None:
    # e = 1.1: both are wrong equally
    install(monkeypatch, one=AlteredPymunk(restitution=2.2), other=AlteredPymunk(restitution=2.2))
    comparison = compare(loads(DROP), ["one"], tolerance=TOLERANCE)
    assert IMPACT_TIME - 0.01 <= comparison.trusted_until <= IMPACT_TIME + 0.01  # frames are 0.01 s apart
    assert "the energy in one grows" in comparison.sentence()


@pytest.mark.nightly
def test_single_method_is_not_confirmed(monkeypatch: pytest.MonkeyPatch) -> None:
    dragged = loads(DROP.replace("duration", "linear_drag = 0.1\nduration"))  # which excludes half_kick
    install(monkeypatch, pymunk=PymunkEngine())
    found = find_truth(dragged, dragged.solver, TOLERANCE)
    assert isinstance(found, str)
    assert "no second engine or method" in found


@pytest.mark.nightly
def test_second_method_of_the_same_engine_confirms_a_truth(monkeypatch: pytest.MonkeyPatch) -> None:
    install(monkeypatch, pymunk=PymunkEngine())
    scene = loads(DROP)
    truth = truth_of(scene, scene.solver, TOLERANCE)
    assert truth.witness == "pymunk without half_kick"
    assert truth.trusted_until == 1.0


def test_confirmation_takes_at_most_half_the_work_or_three_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(witness, "MIN_WORK", 0)
    steps: dict[str, int] = {}
    for module in (refined, witness):
        original = module.bounded_run

        def counted(
            start: Scene | Setup, engine: str, settings: Settings, limit: float,
            *, name: str = module.__name__, original: Any = original, **options: Any,
        ) -> Any:  # fmt: skip
            steps[name] = steps.get(name, 0) + round(Setup.of(start).scene.world.duration / settings.h)
            return original(start, engine, settings, limit, **options)

        monkeypatch.setattr(module, "bounded_run", counted)
    install(monkeypatch, pymunk=PymunkEngine(), another=AlteredPymunk(restitution=0.9))
    assert truth_of(loads(DROP), loads(DROP).solver, TOLERANCE) is not None
    assert 0 < steps[witness.__name__] <= max(0.5 * steps[refined.__name__], (1 + 2 + 4) * 100)


@pytest.mark.parametrize("tolerance", [1e-2, 1e-4])
def test_first_order_method_confirms_the_limit_of_its_convergence(tolerance: float) -> None:
    scene = from_document(
        {
            "world": {"gravity": [0.0, -9.81], "duration": 1.5, "linear_drag": 1e-4},
            "solver": {"dt": 0.01},
            "plane": [{"point": [0.0, 0.0], "normal": [0.0, 1.0], "restitution": 0.8}],
            "ball": [{"name": "a", "position": [0.0, 5.5], "radius": 0.5}],
        }
    )
    truth = truth_of(scene, scene.solver, tolerance)
    assert truth.witness is not None
    assert truth.trusted_until == 1.5


def test_energy_gained_from_wind_does_not_end_the_truth() -> None:
    scene = from_document(
        {
            "world": {"duration": 1.0, "linear_drag": 1.0, "quadratic_drag": 0.1, "wind": [4.0, 0.0]},
            "solver": {"dt": 0.01},
            "ball": [{"name": "a", "position": [0.0, 0.0], "radius": 0.5}],
        }
    )
    truth = truth_of(scene, scene.solver, 1e-3)
    assert (truth.kind, truth.trusted_until) == ("refined", 1.0)


@pytest.mark.parametrize("air", ["linear_drag = 1e-9", "wind = [4.0, 0.0]"])
def test_energy_that_only_wind_and_drag_together_explain_ends_the_truth(
    air: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = loads(DROP.replace("duration", f"{air}\nduration"))
    install(monkeypatch, one=AlteredPymunk(restitution=2.2), other=AlteredPymunk(restitution=2.2))  # e = 1.1
    truth = truth_of(scene, scene.solver, TOLERANCE)
    assert IMPACT_TIME - 0.01 <= truth.trusted_until <= IMPACT_TIME + 0.01  # frames are 0.01 s apart


def test_second_methods_share_one_limit_of_cost(monkeypatch: pytest.MonkeyPatch) -> None:
    limits: list[float] = []
    original = witness.bounded_run

    def priced(start: Scene | Setup, engine: str, settings: Settings, limit: float) -> Any:
        limits.append(limit)
        return original(start, engine, settings, limit)[0], 1.0

    monkeypatch.setattr(witness, "bounded_run", priced)
    diverging = AlteredPymunk(gravity=1e200)
    install(monkeypatch, pymunk=PymunkEngine(), diverging=diverging, another=AlteredPymunk(restitution=0.9))
    assert truth_of(loads(DROP), loads(DROP).solver, TOLERANCE).witness == "another"
    assert len(limits) > 2
    assert limits == [witness.CONFIRMATION_LIMIT - k for k in range(len(limits))]


def test_second_methods_that_do_not_converge_share_one_limit_of_work(monkeypatch: pytest.MonkeyPatch) -> None:
    tried: list[str] = []
    original = witness.bounded_run

    def noted(start: Scene | Setup, engine: str, settings: Settings, limit: float) -> Any:
        tried.append(engine)
        return original(start, engine, settings, limit)

    monkeypatch.setattr(witness, "bounded_run", noted)
    monkeypatch.setattr(witness, "MIN_WORK", 0)
    monkeypatch.setattr(witness, "IMPACT_STEPS", 1e9)  # so that no method contradicts
    others = {f"other_{k}": AlteredPymunk(gravity=1.01) for k in range(9)}
    install(monkeypatch, pymunk=PymunkEngine(), **others)
    assert "has not converged" in truth_of(loads(DROP), loads(DROP).solver, TOLERANCE).about
    # 8 halvings make the result, 1 + 2 + … + 256 runs' work. A method may take half of that, 1 + 2 + … + 128; after two
    # of them a little is left, so that a third one begins, and after that no other.
    assert {*tried} == {"other_0", "other_1", "other_2"}


@pytest.mark.parametrize(("ends", "reason"), [("agrees_until", "smaller steps disagree"), ("horizon", "unpredictable")])
def test_truth_names_the_first_of_two_reasons_to_end(ends: str, reason: str, monkeypatch: pytest.MonkeyPatch) -> None:
    original = witness.refine

    def ended(*given: Any) -> Any:
        return replace(original(*given), about="smaller steps disagree", **{ends: 0.3})

    monkeypatch.setattr(witness, "refine", ended)
    install(monkeypatch, pymunk=PymunkEngine(), another=AlteredPymunk())
    truth = truth_of(loads(DROP), loads(DROP).solver, TOLERANCE)
    assert truth.trusted_until == 0.3
    assert [word for word in ("smaller steps disagree", "unpredictable") if word in truth.about] == [reason]


def test_second_method_that_has_not_converged_confirms_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(witness, "MIN_WORK", 0)
    monkeypatch.setattr(witness, "WORK_FRACTION", 0.0)  # so that it may halve dt twice
    scene = loads(DROP.replace("duration", "linear_drag = 1e-9\nduration"))  # excludes half_kick: first order
    install(monkeypatch, pymunk=PymunkEngine(), another=AlteredPymunk())
    truth = truth_of(scene, scene.solver, 1e-4)
    assert "another has not converged" in truth.about
    # Its last halving, to 2.5 ms, changes the fall by ½·10 m/s²·t·2.5 ms. Ten tolerances are reached at 0.08 s.
    assert truth.trusted_until == pytest.approx(0.08, abs=0.01)  # frames are 0.01 s apart
