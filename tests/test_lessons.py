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
from sandbox.scene.compile.joint_arrays import JointKind

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


def degrees_of_freedom() -> int:
    """Return the number of velocities of the figure that its pivots leave free."""
    scene = sandbox.load("ragdoll_stairs")
    joints, angle = scene.joint_arrays, scene.bodies.angle
    pivots = np.flatnonzero(joints.kind == JointKind.PIVOT)
    rows = np.zeros((len(pivots), 2, len(angle), 3))
    for row, k in zip(rows, pivots, strict=True):
        for body, anchor, sign in ((joints.a[k], joints.anchor_a[k], -1.0), (joints.b[k], joints.anchor_b[k], 1.0)):
            cos, sin, (x, y) = np.cos(angle[body]), np.sin(angle[body]), anchor
            row[:, body, :2] = sign * np.eye(2)
            row[:, body, 2] = sign * np.array([-(x * sin + y * cos), x * cos - y * sin])
    jacobian = rows[:, :, ~scene.bodies.immovable].reshape(2 * len(pivots), -1)
    return int(jacobian.shape[1] - np.linalg.matrix_rank(jacobian))


def axle(*discs: str, limit: float, **settings: float | str) -> sandbox.Trajectory:
    """Run discs that turn about the origin up to a limit of the angle of the last one."""
    names = [f"disc {k}" for k in range(len(discs))]
    text = "[world]\nduration = 0.1\n"
    for name, disc in zip(names, discs, strict=True):
        text += f'[[ball]]\nname = "{name}"\nposition = [0, 0]\ncollides = "none"\n{disc}\n'
        text += f'[[joint]]\nkind = "pivot"\nbetween = {names[max(0, names.index(name) - 1) : names.index(name) + 1]}\n'
        text += "at = [0, 0]\n"
    text += f'[[joint]]\nkind = "rotary_limit"\nbetween = {names}\nleast = {-limit}\nmost = {limit}\n'
    return sandbox.run(sandbox.loads(text), dt=0.001, audit=False, **settings)


def speed_after_limit() -> float:
    run = axle("radius = 0.2\nangular_velocity = 10", "radius = 0.4\nmass = 3", limit=0.5, engine="box2d")
    return float(run.angular_velocity[-1, 0])


def step_for_a_degree() -> float:
    """Return the step for an error of 1°, from the largest error with 1 ms at any phase of the step."""
    limits = np.arange(0.1, 0.12, 1e-4)
    runs = [axle("radius = 0.2\nangular_velocity = 20", limit=limit, engine="pymunk") for limit in limits]
    beyond = max(float(run.angle.max()) - limit for run, limit in zip(runs, limits, strict=True))
    return 0.001 * math.radians(1.0) / beyond


def column(name: str, *replacements: tuple[str, str], duration: float = 10.0, **settings: float) -> sandbox.Trajectory:
    """Run one column of a cloth."""
    text = sandbox.dumps(sandbox.load(name).with_duration(duration))
    for old, new in (("columns = ", "columns = 1 # "), *replacements):
        assert old in text
        text = text.replace(old, new)
    return sandbox.run(sandbox.loads(text), engine="reference", audit=False, **settings)


def bisect(is_low: Callable[[float], bool], low: float, high: float, precision: float = 1e-4) -> float:
    """Return where a condition ends to hold."""
    while high / low > 1.0 + precision:
        middle = math.sqrt(low * high)
        low, high = (middle, high) if is_low(middle) else (low, middle)
    return low


def stretch() -> float:
    run = column("cloth", ("rows = 16", "rows = 24"), ("wind = [4.0, 0.0]", ""), duration=30.0)
    return float(run.position[-1, 0, 1] - run.position[-1, -1, 1]) - 23 * 0.06


def is_stable(dt: float) -> bool:
    changes = ("stiffness = 100.0", "stiffness = 400.0"), ("damping = 0.02", "")
    run = column("cloth", *changes, dt=dt, substeps=1)
    return run.status == "ok" and bool(np.abs(run.velocity[-1]).max() < 1.0)


def holds(mass: float) -> bool:
    """Return whether no thread breaks in air so thick that the column sinks slowly."""
    changes = ("mass = 0.005", f"mass = {mass}"), ("[world]", "[world]\nlinear_drag = 15"), ("7.5, 4.0", "0, 0")
    return not np.isfinite(column("tearing_cloth", *changes, duration=4.0).broken_time).any()


def landing(degrees: float, engine: str = "exact", **settings: float | str) -> float:
    """Return where a shell of 65 m/s without drag crosses the height of its launch, m."""
    angle = math.radians(degrees)
    velocity = [65.0 * math.cos(angle), 65.0 * math.sin(angle)]
    text = "[world]\ngravity = [0, -9.81]\nduration = 14.0\n" + DISC.format("[0, 0]", velocity, 0.1)
    x, y = sandbox.run(sandbox.loads(text), engine=engine, audit=False, **settings).position[:, 0].T
    last = np.flatnonzero(y >= 0.0)[-1]
    return float(np.interp(0.0, [y[last + 1], y[last]], [x[last + 1], x[last]]))


def long_fall() -> float:
    text = "[world]\ngravity = [0, -9.81]\nlinear_drag = 0.2\nduration = 60.0\n" + DISC.format("[0, 0]", "[0, 0]", 0.1)
    return -float(sandbox.run(sandbox.loads(text), engine="reference", integrator="rk4").velocity[-1, 0, 1])


def spring_error(dt: float) -> float:
    run = sandbox.run("spring", engine="reference", integrator="semi_implicit_euler", dt=dt)
    error = np.abs(run.position[:, 0, 0] - 1.0 - 0.1 * np.cos(2.0 * np.pi * run.time))
    return float(error[run.time < 1.0 + dt / 2.0].max())


def orbit(speed: float = 3**0.5) -> sandbox.Trajectory:
    """Run the planet for about a turn."""
    scene = changed("kepler", ("1.7320508075688772", f"{speed}"), ("duration = 31.416", "duration = 6.0"))
    return sandbox.run(scene, engine="reference", integrator="rk4")


def swept_area() -> float:
    x, y = orbit().position[:, 0].T
    return float(np.mean(x[:-1] * y[1:] - x[1:] * y[:-1]) / 2.0)


def load_of_contact() -> float:
    """Return the mean force of box 10 on box 9, N, from the impulses of their contacts."""
    run = sandbox.run("tower", engine="reference", audit=False)
    lower, upper = run.number("box-9"), run.number("box-10")
    impulses = run.contact_impulse[(run.contact_pair == (lower, upper)).all(axis=1)]
    return float(np.abs(impulses[:, 1]).sum() / run.time[-1])


def rolling_speed() -> float:
    text = "[world]\nduration = 1.0\n[surface]\nsliding_friction = 0.2\nrolling_friction = 0.0\n"
    run = sandbox.run(sandbox.loads(text + DISC.format("[0, 0]", "[2, 0]", 0.03)), engine="exact")
    return float(run.velocity[-1, 0, 0])


def is_bounded(stiffness: float) -> bool:
    """Return whether a mass of 0.1 kg swings on without growing at 240 steps a second."""
    scene = changed("stiff_spring", ("3960100.0", f"{stiffness}"), ('name = "mass"', 'name = "mass"\nmass = 0.1'))
    settings = {"integrator": "semi_implicit_euler", "dt": 1.0 / 240.0}
    run = sandbox.run(scene.with_duration(20.0), engine="reference", audit=False, **settings)
    return run.status == "ok" and bool(np.abs(run.position[:, 0, 0] - 10.0).max() < 10.0)


def two_masses() -> float:
    """Return the frequency of two masses of 1 kg on a spring of 1 N/m, 1/s."""
    text = "[world]\nduration = 12.0\n[solver]\ndt = 0.01\n"
    for name, x in (("left", 0.0), ("right", 1.1)):
        text += DISC.format([x, 0.0], "[0, 0]", 0.1) + f'name = "{name}"\ncollides = "none"\n'
    text += '[[joint]]\nkind = "spring"\nbetween = ["left", "right"]\nrest_length = 1.0\nstiffness = 1.0\n'
    run = sandbox.run(sandbox.loads(text), engine="reference", integrator="rk4")
    stretch = run.position[:, 1, 0] - run.position[:, 0, 0] - 1.0
    crossings = np.flatnonzero((stretch[:-1] > 0.0) & (stretch[1:] <= 0.0))  # one in each swing
    times = [np.interp(0.0, stretch[[k + 1, k]], run.time[[k + 1, k]]) for k in crossings]
    return float(2.0 * np.pi / np.diff(times).mean())


def rises(mass: float) -> bool:
    """Return whether the load of the right pair falls, so that `pull` rises."""
    run = sandbox.run(changed("atwood", ("mass = 1.2", f"mass = {mass}")), engine="reference")
    return bool(run.position[-1, run.number("pull"), 1] > -0.6)


def slack() -> float:
    scene = changed("atwood", ("wheels = [[-2.0, 0.0]", "length = 3.4\nwheels = [[-2.0, 0.0]"))
    run = sandbox.run(scene, engine="reference", dt=1e-4)
    return float(run.time[run.velocity[:, run.number("light"), 1].argmin()])  # falls freely until then


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
    "order-1": (lambda: math.log2(spring_error(0.2) / spring_error(0.1)), 1e-9),
    "kepler-1": (lambda: bisect(lambda v: np.hypot(*orbit(v).position[:, 0].T).max() <= 0.5 + 1e-6, 1.0, 1.9), 2e-4),
    "kepler-3": (swept_area, 1e-4),  # triangles are smaller than sectors, by (ω h)²/6
    "stacks-1": (load_of_contact, 1e-2),  # the tower sinks in at the start
    "billiards-1": (rolling_speed, 1e-9),
    "springs-1": (lambda: bisect(is_bounded, 1e4, 5e4), 2e-4),  # grows slowly just above the limit
    "springs-2": (two_masses, 1e-5),  # crossings between two steps of 0.01 s
    "machines-1": (lambda: bisect(rises, 0.5, 1.9), 2e-4),
    "machines-2": (slack, 1e-3),  # a frame of 0.1 ms
    "penalty-1": (lambda: 9810.0 * depth(1.0) / 1e-3, 1e-6),
    "penalty-2": (tenth_of_contact, 1e-2),  # a frame of 0.1 ms
    "penalty-3": (lambda: depth(250.0), 1e-3),  # slides into its place slowly
    "ragdoll-1": (degrees_of_freedom, 0.0),
    "ragdoll-2": (speed_after_limit, 1e-5),  # 32-bit numbers
    "ragdoll-3": (step_for_a_degree, 1e-2),  # phases of a step of 20 mrad, 0.1 mrad apart
    "cloth-1": (stretch, 1e-4),  # e^(−15) of the start is left in the air
    "cloth-2": (lambda: bisect(is_stable, 2e-3, 3e-3, 1e-3), 1e-2),  # 15 masses: 0.5 % below the bound
    "cloth-3": (lambda: bisect(holds, 0.035, 0.045, 1e-3), 2e-3),  # the bisection ends at 0.1 %
    "artillery-1": (lambda: max(landing(degrees) for degrees in np.arange(44.0, 46.0, 0.1)), 1e-4),  # frames of 10 ms
    "artillery-2": (lambda: bisect(lambda degrees: landing(degrees) < 210.0, 5.0, 40.0), 2e-4),  # frames of 10 ms
    "artillery-3": (long_fall, 1e-4),  # e^(−12) of the velocity is missing
    "artillery-4": (
        lambda: landing(30.0, "reference", integrator="explicit_euler", dt=0.05) - landing(30.0),
        5e-3,  # lands within a step, between two of its positions
    ),
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
    assert f"\n{number}. " in questions.partition("<details>")[0]
