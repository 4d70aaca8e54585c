"""Exercises of the lessons: each answer is what an engine, or another program, measures."""

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import shapely

import sandbox
from sandbox.lessons import check, exercises
from sandbox.measure.preflight.tunnelling import largest_safe_dt

LESSONS = Path(__file__).parents[1] / "docs" / "lessons"
DISC = "[[ball]]\nposition = {}\nvelocity = {}\nradius = {}\n"


def changed(name: str, *replacements: tuple[str, str]) -> sandbox.Scene:
    """Return a shipped scene with parts of its text replaced."""
    text = sandbox.dumps(sandbox.load(name))
    for old, new in replacements:
        assert old in text
        text = text.replace(old, new)
    return sandbox.loads(text)


def loop() -> sandbox.Trajectory:
    return sandbox.run("bounce", engine="reference", dt=0.01, slop=1.0)


def euler_error(steps: int) -> float:
    return float(sandbox.run("ball", engine="pymunk", dt=1.0 / steps).position[-1, 0, 1] - 5.095)


def flights(duration: str) -> tuple[float, int]:
    """Return the length of the way of the bouncing ball, m, and the number of its peaks above 1 mm."""
    run = sandbox.run(changed("bounce", ("duration = 6.0", duration)), engine="exact")
    height = run.position[:, 0, 1] - 0.5
    is_peak = (height[1:-1] > height[:-2]) & (height[1:-1] >= height[2:]) & (height[1:-1] > 1e-3)
    return float(np.abs(np.diff(height)).sum()), int(is_peak.sum())


def rest(restitution: float) -> float:
    scene = changed(
        "bounce", ("restitution = 0.8", f"restitution = {restitution}"), ("duration = 6.0", "duration = 20")
    )
    run = sandbox.run(scene, engine="exact")
    return float(run.time[np.abs(run.velocity[:, 0, 1]) > 1e-9][-1])


def top() -> float:
    scene = sandbox.loads("[world]\ngravity = [0, -9.81]\nduration = 2.0\n" + DISC.format("[0, 1]", "[0, 12]", 0.1))
    run = sandbox.run(scene, engine="exact")
    return float(run.time[run.position[:, 0, 1].argmax()])


def gap() -> float:
    along, normal = np.array([-0.8, 0.6]), np.array([0.6, 0.8])
    corners = [100 * along, -100 * along, -100 * along - 100 * normal, 100 * along - 100 * normal]
    return float(shapely.distance(shapely.Polygon(corners), shapely.Point(5.0, 0.0))) - 1.0


def halvings() -> int:
    low, high, count = 0.0, 0.1, 0
    while (high - low) / 2.0 > 1e-6:  # the middle is at most half of the interval away
        low, high, count = low, (low + high) / 2.0, count + 1
    return count


def impact() -> float:
    text = "[world]\nduration = 1.0\n" + DISC.format("[0, 0]", "[2, 0]", 0.5) + DISC.format("[3, 0]", "[-2, 0]", 0.5)
    return float(sandbox.run(sandbox.loads(text), engine="exact").contact_time[0])


def safe_dt(scene: sandbox.Scene) -> float:
    dt = largest_safe_dt(scene)
    assert dt is not None
    return dt


def wall() -> float:
    text = "[world]\nduration = 0.1\n[[wall]]\npoints = [[1, -1], [1, 1]]\nthickness = 0.1\n"
    return safe_dt(sandbox.loads(text + DISC.format("[0, 0]", "[20, 0]", 0.1)))


def bullets() -> float:
    text = (
        "[world]\nduration = 0.1\n" + DISC.format("[0, 0]", "[100, 0]", 0.01) + DISC.format("[3, 0]", "[-100, 0]", 0.01)
    )
    return safe_dt(sandbox.loads(text))


def depth(mass: float) -> float:
    scene = changed("rest_depth", ("radius = 0.1", f"radius = 0.1\nmass = {mass}"))
    spring = {"response": "penalty", "stiffness": 9810.0, "damping": 1.0, "dt": 0.001}
    return float(0.1 - sandbox.run(scene, engine="reference", **spring).position[-1, 0, 1])


def tenth_of_contact() -> float:
    scene = changed(
        "rest_depth",
        ("gravity = [0.0, -9.81]", "gravity = [0.0, 0.0]"),
        ("radius = 0.1", "velocity = [0, -1]\nradius = 0.1"),
    )
    spring = {"response": "penalty", "stiffness": 9810.0, "damping": 0.0, "dt": 1e-5}
    run = sandbox.run(scene, engine="reference", audit=False, record_every=10, **spring)
    return float(run.time[run.position[:, 0, 1] < 0.1][-1]) / 10.0


def cradle(*replacements: tuple[str, str]) -> np.ndarray:
    return sandbox.run(changed("newtons_cradle", *replacements), engine="exact").velocity[-1, :, 0]


MEASURED: dict[str, tuple[Callable[[], float], float]] = {
    "loop-1": (lambda: float(loop().contact_time[0]) / 0.01, 1e-9),
    "loop-2": (lambda: 0.5 - float(loop().position[102, 0, 1]), 1e-9),
    "ball-1": (lambda: euler_error(50), 1e-9),
    "ball-4": (lambda: 1000 * euler_error(1000) / 1e-3, 1e-9),  # the error is proportional to the step
    "bounce-1": (lambda: flights("duration = 10")[1], 0.0),
    "bounce-2": (lambda: flights("duration = 10")[0], 2e-3),  # frames of 1 ms miss the turning points
    "bounce-3": (lambda: rest(0.9), 1e-4),  # a frame of 1 ms
    "fireworks-1": (top, 0.005),  # a frame of 10 ms
    "circle_half_plane-2": (gap, 1e-12),
    "bisection-1": (halvings, 0.0),
    "bisection-4": (impact, 1e-12),
    "tunnelling-1": (lambda: 100.0 * safe_dt(sandbox.load("bullet")) * 60.0, 1e-9),
    "tunnelling-2": (wall, 1e-9),
    "tunnelling-3": (bullets, 1e-9),
    "penalty-1": (lambda: 9810.0 * depth(1.0) / 1e-3, 1e-6),
    "penalty-2": (tenth_of_contact, 1e-2),  # a frame of 0.1 ms
    "penalty-3": (lambda: depth(250.0), 1e-3),  # slides into its place slowly
    "newtons_cradle-2": (lambda: float(cradle(('name = "a"', 'name = "a"\nmass = 3.0'))[0]), 1e-9),
    "newtons_cradle-3": (lambda: float(cradle(("restitution = 1.0", "restitution = 0.9"))[-1]), 1e-9),
}


@pytest.mark.fail_slow(60)  # compiles, and runs up to 200,000 steps
@pytest.mark.parametrize("name", exercises())
def test_answer_is_what_is_measured(name: str) -> None:
    measure, tolerance = MEASURED[name]
    assert exercises()[name].answer() == pytest.approx(measure(), rel=tolerance, abs=0.0)


@pytest.mark.parametrize("name", exercises())
def test_answers_and_mistakes_are_told_apart(name: str) -> None:
    exercise = exercises()[name]
    answer = exercise.answer()
    assert check(name, answer)
    for hint, mistaken in exercise.mistakes.items():
        mark = check(name, mistaken())
        assert (mark.result, mark.hint) == ("wrong", hint)


@pytest.mark.parametrize(
    ("factor", "word"),
    [(-1.0, "sign"), (2.0, "twice"), (0.5, "half"), (180.0 / math.pi, "degrees"), (1e3, "unit"), (1e-3, "unit")],
)
def test_kind_of_mistake_is_named(factor: float, word: str) -> None:
    mark = check("fireworks-1", 1.223 * factor)
    assert not mark
    assert word in mark.hint


def test_nearly_right_is_not_right() -> None:
    assert check("fireworks-1", 1.25).result == "nearly"
    assert check("bounce-1", 20).result == "nearly"
    assert check("bounce-1", 19.08).hint == "it is a whole number"
    assert repr(check("fireworks-1", 7.7)) == "not right"


def test_unknown_exercise_lists_the_known_ones() -> None:
    with pytest.raises(ValueError, match=r"no exercise 'bounce-9'; exercises: .*bounce-3"):
        check("bounce-9", 1.0)


@pytest.mark.parametrize("name", exercises())
def test_question_is_on_the_page_of_its_lesson(name: str) -> None:
    page, _, number = name.rpartition("-")
    questions = (LESSONS / f"{page}.md").read_text(encoding="utf-8").partition("## Questions")[2]
    assert f"\n{number}. " in questions.partition(":::")[0]
