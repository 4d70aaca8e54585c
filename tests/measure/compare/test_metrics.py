"""Metrics on synthetic runs with known values."""

import math
from dataclasses import replace

import numpy as np
import pytest

from sandbox.jsonable import to_json
from sandbox.measure.compare import compare
from sandbox.measure.compare.metrics import METRICS, default_zoom, displacement, measure_all
from sandbox.measure.run.runner import run as run_scene
from sandbox.measure.tradeoff.objective import choose_metric, default_metric_tolerance
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import loads
from sandbox.trajectory import Trajectory
from tests.measure.tradeoff.evaluations_by_hand import context_of, shifted
from tests.runs_by_hand import BALLS, run_of, scene_of

NEEDS_TRUTH = (
    "max_position",
    "final_position",
    "rms_position",
    "pixels",
    "bounce_height",
    "settle_time",
    "drift",
    "max_angle",
)


@pytest.fixture
def scene() -> Scene:
    return scene_of()


def test_max_position_is_of_the_worst_body_and_frame(scene: Scene) -> None:
    resting = run_of(scene)
    run = run_of(scene, shifted(resting, 7, 1, (0.03, 0.04)))
    found = measure_all(run, context_of(scene, zoom=200.0))
    assert found["max_position"] == pytest.approx(0.05, rel=1e-12)  # 3-4-5, to rounding
    assert found["pixels"] == pytest.approx(10.0, rel=1e-12)  # × 200 px/m
    assert found["final_position"] == 0.0
    # One of 21 frames × 2 bodies that move.
    assert found["rms_position"] == pytest.approx(0.05 / math.sqrt(42.0), rel=1e-12)


def test_max_angle_counts_whole_turns(scene: Scene) -> None:
    resting = run_of(scene)
    angle = resting.angle.copy()
    angle[7:, 1] += 2.0 * math.pi
    angle[3, 0] = -0.25
    found = measure_all(replace(resting, angle=angle), context_of(scene))
    assert found["max_angle"] == pytest.approx(2.0 * math.pi, rel=1e-15)
    assert found["max_position"] == 0.0


def test_angle_and_position_of_a_compound_pendulum_are_off_by_one_arc() -> None:
    """About a fixed pivot at the distance L, a difference of angles Δ moves the centre by the chord 2 L sin(Δ/2)."""
    scene = loads(
        "[world]\nduration = 1.0\ngravity = [0, -9.81]\n[[box]]\nname = 'bar'\nposition = [0.5, 0]\nsize = [1.0, 0.1]\n"
        "[[joint]]\nkind = 'pivot'\nbetween = ['bar']\nat = [0, 0]\n"
    )
    (row,) = compare(scene, ["reference"], dt=0.01, joints="rattle").rows
    assert row.score.max_angle is not None and row.score.max_angle > 1e-5
    chord = 2.0 * 0.5 * math.sin(row.score.max_angle / 2.0)
    assert row.score.max_position == pytest.approx(chord, rel=1e-3)  # the joint itself is off by less
    document = to_json(row)
    assert document["max_angle_error"] == row.score.max_angle


def test_every_metric_has_a_default_tolerance_and_an_unknown_unit_none() -> None:
    for metric in METRICS.values():
        assert default_metric_tolerance(metric, 0.01) >= 0.0
    with pytest.raises(ValueError, match="furlong"):
        default_metric_tolerance(METRICS["max_angle"]._replace(unit="furlong"), 0.01)


def test_fixed_bodies_do_not_count(scene: Scene) -> None:
    run = run_of(scene, shifted(run_of(scene), slice(None), 2, (1.0, 0.0)))
    assert measure_all(run, context_of(scene))["max_position"] == 0.0


def test_frames_after_the_trusted_time_do_not_count(scene: Scene) -> None:
    run = run_of(scene, shifted(run_of(scene), slice(11, None), 0, (1.0, 0.0)))
    short, whole = (measure_all(run, context_of(scene, until=until)) for until in (1.0, None))
    assert (short["max_position"], short["final_position"], short["settle_time"]) == (0.0, 0.0, None)
    assert (whole["max_position"], whole["final_position"], whole["settle_time"]) == (1.0, 1.0, 0.0)


def test_metrics_against_the_truth_are_none_without_a_truth(scene: Scene) -> None:
    found = measure_all(run_of(scene), context_of(scene, until=0.0))
    assert [name for name in NEEDS_TRUTH if found[name] is not None] == []
    assert found["energy"] == 0.0


def test_refused_run_has_no_metrics() -> None:
    scene = scene_of(BALLS + "[[joint]]\nkind = 'rod'\nbetween = ['a', 'b']\n")
    run = run_scene(scene, "exact")
    assert run.status == "refused"
    assert set(measure_all(run, context_of(scene)).values()) == {None}


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, 1e300])
def test_non_finite_state_has_a_huge_error(scene: Scene, bad: float) -> None:
    position = run_of(scene).position.copy()
    position[12:, 0] = bad
    velocity = np.zeros_like(position)
    velocity[12:, 0] = bad
    run = run_of(scene, position, velocity=velocity, contacts=[(0.5, (0, -1))])
    found = measure_all(run, context_of(scene, run_of(scene, contacts=[(0.5, (0, -1))])))
    for name in ("max_position", "final_position", "bounce_height", "drift", "settle_time"):
        value = found[name]
        assert value > 1e100
    assert not any(value is not None and math.isnan(value) for value in found.values())


def test_bounce_height_counts_from_the_first_contact(scene: Scene) -> None:
    truth = run_of(scene, contacts=[(1.05, (0, -1))])
    before = run_of(scene, shifted(truth, slice(0, 11), 0, (0.0, 3.0)))
    assert measure_all(before, context_of(scene, truth))["bounce_height"] == 0.0
    after = run_of(scene, shifted(truth, 15, 0, (5.0, 0.25)))
    assert measure_all(after, context_of(scene, truth))["bounce_height"] == 0.25
    fallen = run_of(scene, shifted(truth, slice(11, None), 0, (0.0, -2.0)))
    assert measure_all(fallen, context_of(scene, truth))["bounce_height"] == 2.0
    weightless = scene_of(BALLS.replace("gravity = [0.0, -10.0]", ""))
    for of, contacts in ((scene, ()), (weightless, [(0.5, (0, -1))])):  # no contact, no gravity
        run = run_of(of, contacts=contacts)
        assert measure_all(run, context_of(of, run))["bounce_height"] is None


def test_bounce_height_uses_common_frames_only(scene: Scene) -> None:
    position = run_of(scene).position.copy()
    position[:, 0, 1] += np.linspace(0.0, -4.0, 21)  # falls by 0.2 m a frame
    truth = run_of(scene, position, contacts=[(0.3, (0, -1))])
    same = run_of(scene, position[::2], time=truth.time[::2])
    # Its first frame after the contact is a step later, and lower, which is no error.
    assert measure_all(same, context_of(scene, truth))["bounce_height"] == 0.0


def test_energy_error_is_a_fraction_of_the_kinetic_energy(scene: Scene) -> None:
    velocity = np.zeros((21, 3, 2))
    velocity[:, 0, 0] = 2.0
    truth = run_of(scene, velocity=velocity)
    for speed, error in ((3.0, 1.25), (1.0, 0.75)):  # 4.5 J or 0.5 J instead of 2 J
        other = velocity.copy()
        other[-1, 0, 0] = speed
        found = measure_all(run_of(scene, velocity=other), context_of(scene, truth))
        assert found["energy"] == pytest.approx(error, rel=1e-12)


def test_penetration_is_the_deepest_of_pairs_with_contacts(scene: Scene) -> None:
    position = shifted(run_of(scene), 4, 0, (0.0, -4.6))  # centre 0.4 m above the ground, radius 0.5 m
    assert measure_all(run_of(scene, position), context_of(scene))["penetration"] is None  # no contact was recorded
    touched = run_of(scene, position, contacts=[(0.4, (0, -1)), (0.5, (1, -1))])
    # rounding of 5 − 4.6
    assert measure_all(touched, context_of(scene))["penetration"] == pytest.approx(0.1, rel=1e-12)
    clear = run_of(scene, contacts=[(0.4, (0, -1))])
    assert measure_all(clear, context_of(scene))["penetration"] == 0.0


def test_initial_overlap_counts_only_if_it_deepens_again(scene: Scene) -> None:
    height = 5.0 + np.asarray([-4.8, -4.7, -4.9, -4.6, -4.4, *[0.0] * 16])  # centre 0.2 m above the ground at first
    position = run_of(scene).position.copy()
    position[:, 0, 1] = height
    run = run_of(scene, position, contacts=[(0.4, (0, -1))])
    assert measure_all(run, context_of(scene))["penetration"] == pytest.approx(0.2, rel=1e-12)  # from 0.2 to 0.4 m deep
    position[:, 0, 1] = np.maximum.accumulate(height)
    assert measure_all(run_of(scene, position, contacts=[(0.4, (0, -1))]), context_of(scene))["penetration"] == 0.0


def test_drift_counts_bodies_that_rest_in_the_second_half_of_the_truth(scene: Scene) -> None:
    moving = run_of(scene).position.copy()
    moving[:, 1, 0] += np.linspace(0.0, 1.0, 21)  # b moves in the truth: it does not count
    moving[:5, 0, 1] += np.linspace(1.0, 0.0, 5)  # a falls in the truth before it rests
    context = context_of(scene, run_of(scene, moving))
    early = shifted(run_of(scene, moving), slice(0, 5), 0, (1.0, 0.0))
    assert measure_all(run_of(scene, early), context)["drift"] == 0.0
    late = shifted(run_of(scene, moving), slice(15, None), 0, (0.0, 0.02))
    assert measure_all(run_of(scene, late), context)["drift"] == pytest.approx(0.02, rel=1e-12)


def test_drift_of_a_body_at_rest_in_truth_counts_from_the_start(scene: Scene) -> None:
    """A stack that falls at once rests in the second half too."""
    context = context_of(scene, run_of(scene))
    fallen = shifted(run_of(scene), slice(5, None), 0, (0.3, -0.4))
    assert measure_all(run_of(scene, fallen), context)["drift"] == pytest.approx(0.5, rel=1e-12)


def test_drift_is_chosen_for_resting_bodies_with_a_short_trusted_time(scene: Scene) -> None:
    metric, reason = choose_metric(context_of(scene, run_of(scene), until=0.5))
    assert metric.name == "drift"
    assert reason == "the truth of positions is trusted for 0.5 s of 2 s only, and 2 bodies should stay at rest"
    tumbling = run_of(scene).position + np.linspace(0.0, 1.0, 21)[:, None, None]
    metric, _ = choose_metric(context_of(scene, run_of(scene, tumbling), until=0.5))
    assert metric.name == "penetration"
    assert measure_all(run_of(scene, tumbling), context_of(scene, run_of(scene, tumbling)))["drift"] is None
    metric, reason = choose_metric(context_of(scene, run_of(scene)))
    assert (metric.name, reason) == ("max_position", "the truth (exact) is trusted to the end, 2 s")


def test_missed_contacts_and_passes_are_counted_in_audited_runs_only(scene: Scene) -> None:
    rows = [(0.1 * k, (0, -1)) for k in range(3)]
    unaudited = run_of(scene, contacts=rows)
    assert [measure_all(unaudited, context_of(scene))[name] for name in ("missed_contacts", "passes")] == [None, None]
    run = run_of(scene, contacts=rows, audited=True)
    assert [measure_all(run, context_of(scene))[name] for name in ("missed_contacts", "passes")] == [0.0, 0.0]
    missed = with_missed(run, 1)
    assert [measure_all(missed, context_of(scene))[name] for name in ("missed_contacts", "passes")] == [1.0, 0.25]
    assert measure_all(run_of(scene, audited=True), context_of(scene))["passes"] is None  # no contacts at all


def with_missed(run: Trajectory, count: int) -> Trajectory:
    values = {name: getattr(run, name) for name in run.__dataclass_fields__}
    lost = {"missed_time": np.zeros(count), "missed_pair": np.zeros((count, 2), np.int64)}
    return Trajectory(**{**values, **lost})


def test_settle_time_is_of_the_last_body_and_may_be_infinite(scene: Scene) -> None:
    def settling(frame: int) -> Trajectory:
        velocity = np.zeros((21, 3, 2))
        velocity[:frame, 1, 0] = 1.0
        return run_of(scene, velocity=velocity)

    context = context_of(scene, settling(10))
    assert measure_all(settling(10), context)["settle_time"] == 0.0
    assert measure_all(settling(13), context)["settle_time"] == pytest.approx(0.3, rel=1e-12)  # 1.3 s − 1.0 s
    assert measure_all(settling(6), context)["settle_time"] == pytest.approx(0.4, rel=1e-12)
    assert measure_all(settling(21), context)["settle_time"] == math.inf
    assert measure_all(settling(10), context_of(scene, settling(21)))["settle_time"] is None


def test_retired_bodies_do_not_count(scene: Scene) -> None:
    truth = run_of(scene, retired=[0.95, 0.95, np.nan])
    run = run_of(scene, shifted(truth, slice(10, None), 0, (7.0, 0.0)), retired=[0.95, 0.95, np.nan])
    found = measure_all(run, context_of(scene, truth))
    assert found["max_position"] == 0.0
    assert found["final_position"] == 0.0
    displaced = run_of(scene, shifted(truth, slice(None), 0, (0.5, 0.0)), retired=[0.95, 0.95, np.nan])
    assert measure_all(displaced, context_of(scene, truth))["final_position"] == 0.5  # of the last frame with a body
    # Retired from the first frame on: no metric is defined.
    retired = run_of(scene, retired=[0.0, 0.0, np.nan])
    metrics = measure_all(retired, context_of(scene, retired))
    assert [metrics[name] for name in ("max_position", "final_position", "rms_position")] == [None, None, None]


def test_default_zoom_fits_the_scene_into_the_window() -> None:
    scene = loads("[[ball]]\nname = 'a'\nposition = [0, 0]\nradius = 1.0\n")
    assert default_zoom(scene, None) == 0.9 * 720.0 / 2.0  # 2 m high
    empty = loads(
        "[[plane]]\nname = 'p'\npoint = [0, 0]\nnormal = [0, 1]\n[[ball]]\nposition = [1e9, 0]\nradius = 1e-9\n"
    )
    assert math.isfinite(default_zoom(empty, None))


def test_displacement_is_of_the_second_half(scene: Scene) -> None:
    run = run_of(scene)
    assert displacement(run_of(scene, shifted(run, 9, 0, (9.0, 0.0)))).tolist() == [0.0, 0.0, 0.0]
    middle = run_of(scene, shifted(run, 10, 0, (0.0, 2.0)))
    assert displacement(middle).tolist() == [2.0, 0.0, 0.0]  # the middle frame counts
