"""Known boundaries, where engines tunnel and where springs become unstable; axes and pairs have valid scenes."""

import math

import pytest

from sandbox.measure.extremes.boundary import Boundary, run_axis
from sandbox.measure.extremes.experiment import Axis
from sandbox.measure.extremes.outcome import Sample, Task
from sandbox.measure.extremes.scenarios import AXES, PAIRS
from sandbox.measure.extremes.worker import evaluate_task
from sandbox.scene.files.load import dumps, from_document

pytestmark = pytest.mark.fail_slow(60)  # long runs and sweeps


def limit_of(axis: Axis, levels: tuple[float, ...], name: str) -> Boundary:
    (setup,) = (setup for setup in axis.setups if setup.name == name)
    samples: list[Sample] = []
    found = run_axis(axis, setup, levels, (), evaluate_task, samples.append)
    assert found.monotone
    return found


@pytest.mark.parametrize(
    ("setup", "known"), [("pymunk", 1.0), ("pymunk, 4 substeps", 4.0), ("reference", 1.0), ("reference, bisect", 1.0)]
)
def test_bullet_tunnels_beyond_a_substep_of_its_radius_plus_half_the_wall(setup: str, known: float) -> None:
    found = limit_of(AXES["speed"], (0.5, 100.0), setup)
    assert found.rule == "through"
    assert found.limit == pytest.approx(known, rel=0.01)  # the accuracy of boundaries
    assert found.first_failure == pytest.approx(known, rel=0.0101)  # as above, on the other side


@pytest.mark.parametrize("setup", ["reference, swept", "reference, shrink", "exact"])
def test_bullet_does_not_tunnel_with_continuous_detection(setup: str) -> None:
    assert limit_of(AXES["speed"], (0.5, 100.0), setup).first_failure is None


@pytest.mark.parametrize(
    ("setup", "known"),
    [("pymunk", 2.0), ("reference, velocity_verlet", 2.0), ("reference, rk4", 2.0 * math.sqrt(2.0))],
)
def test_spring_becomes_unstable_at_the_limit_of_its_scheme(setup: str, known: float) -> None:
    found = limit_of(AXES["stiffness"], (1.0, 10.0), setup)
    # Within 1 %; just above its limit rk4 grows too slowly to show in 200 steps, by 1e-4 a step at 0.3 % beyond.
    assert found.limit == pytest.approx(known, rel=0.011)


@pytest.mark.parametrize("name", AXES)
def test_axis_has_distinct_scenes_at_its_quick_levels(name: str) -> None:
    axis = AXES[name]
    assert set(axis.quick) <= set(axis.levels)
    increasing = axis.levels[-1] > axis.levels[0]
    assert list(axis.levels) == sorted(axis.levels, reverse=not increasing)
    assert list(axis.quick) == sorted(axis.quick, reverse=not increasing)
    scenes = [from_document(axis.document(level)) for level in axis.quick]
    assert len({dumps(scene) for scene in scenes}) == len(scenes)


def test_pairs_have_scenes_at_their_corners() -> None:
    for pair in PAIRS:
        for a in (pair.first.levels[0], pair.first.levels[-1]):
            for b in (pair.second.levels[0], pair.second.levels[-1]):
                from_document(pair.case.document({pair.first.parameter: a, pair.second.parameter: b}))
    assert len({pair.name for pair in PAIRS}) == len(PAIRS)


def test_unknown_parameter_is_an_error() -> None:
    with pytest.raises(KeyError, match="bullet has no colour"):
        AXES["speed"].case.document({"colour": 1.0})


@pytest.mark.parametrize(
    ("task", "words"),
    [
        (Task("drop", {"dt": 11.0}, "pymunk"), "invalid scene: "),
        (Task("drop", {"dt": 0.01}, "pymunk", {"iterations": 0}), "invalid scene: solver.iterations: must be"),
        (Task("two boxes", {}, "exact"), "it does not model polygons"),
        (Task("overlap", {"depth": 0.5}, "exact"), "overlap"),
        (Task("drop", {}, "pymunk", {"detection": "swept"}), "detection 'swept' is not supported"),
    ],
)
def test_refused_task_has_its_reason(task: Task, words: str) -> None:
    outcome = evaluate_task(task)
    assert outcome.verdict == "refused"
    assert words in outcome.reason
