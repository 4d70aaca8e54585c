"""Drag with other forces on pymunk: an equilibrium of the equations of motion is exact at any step."""

import math
from functools import partial
from typing import Any

import numpy as np
import pytest

from sandbox.action import Action, Force, Impulse
from sandbox.engines.energy_ledger import Cause
from sandbox.engines.switching import SwitchableSimulation, start
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import from_document
from tests import accounts
from tests.engines.stepping import advance

pytestmark = pytest.mark.fail_slow(60)  # long runs and sweeps

# Rounding of a few hundreds of sums.
closed_account = partial(accounts.closed_account, engine="pymunk", closes=1e-11)

DT = 0.01
G = 10.0

LINEAR, STRONG, QUADRATIC, BOTH = (
    {"linear_drag": 5.0},
    {"linear_drag": 400.0},  # κh = 4: an explicit step would be unstable
    {"quadratic_drag": 0.8},
    {"linear_drag": 2.0, "quadratic_drag": 0.8},
)
each_drag = pytest.mark.parametrize(
    "drag", [LINEAR, STRONG, QUADRATIC, BOTH], ids=["linear", "strong", "quadratic", "both"]
)
each_wind = pytest.mark.parametrize("wind", [(0.0, 0.0), (3.0, -1.0)], ids=["still", "wind"])


def scene_of(drag: dict[str, Any], gravity: float = -G, wind: tuple[float, float] = (0.0, 0.0), **more: Any) -> Scene:
    world = {"gravity": [0.0, gravity], "duration": 60.0, "wind": list(wind), **drag}
    return from_document({"world": world, "solver": {"dt": DT, **more.pop("solver", {})}, **more})


def ball(name: str, x: float, y: float, mass: float = 1.0, **more: Any) -> dict[str, Any]:
    return {"name": name, "position": [x, y], "radius": 0.05, "mass": mass, "collides": "none", **more}


def spring(a: str, b: str | None, stiffness: float, rest_length: float = 0.0, **more: Any) -> dict[str, Any]:
    between = [a] if b is None else [a, b]
    return {"kind": "spring", "between": between, "stiffness": stiffness, "rest_length": rest_length, **more}


def run(scene: Scene, seconds: float, *actions: Action) -> SwitchableSimulation:
    simulation = start(scene)
    for action in actions:
        simulation.apply(action)
    advance(simulation, round(seconds / DT))
    return simulation


def drag_rate(drag: dict[str, Any], speed: float) -> float:
    """Return κ, 1/s."""
    return float(drag.get("linear_drag", 0.0) + drag.get("quadratic_drag", 0.0) * speed)


def terminal_speed(drag: dict[str, Any], acceleration: float) -> float:
    """Return the speed, m/s, at which drag balances an acceleration, m/s²."""
    k, c = drag.get("linear_drag", 0.0), drag.get("quadratic_drag", 0.0)
    return 2.0 * acceleration / (k + math.sqrt(k * k + 4.0 * c * acceleration))


@each_drag
@each_wind
@pytest.mark.parametrize("substeps", [1, 3])
def test_mass_on_a_spring_stays_at_equilibrium(drag, wind, substeps):
    mass, stiffness = 2.0, 50.0
    held = spring("a", None, stiffness, anchors=[[0.0, 0.0], [0.0, 0.0]], damping=3.0)
    kappa = drag_rate(drag, math.hypot(*wind))
    expected = mass / stiffness * (np.array([0.0, -G]) + kappa * np.asarray(wind))
    scene = scene_of(drag, wind=wind, ball=[ball("a", *expected, mass)], joint=[held], solver={"substeps": substeps})
    frame = run(scene, 5.0).frame()
    assert frame.velocity[0] == pytest.approx(np.zeros(2), abs=1e-12)  # rounding of forces of 2,400 N
    assert frame.position[0] == pytest.approx(expected, rel=1e-12)  # likewise


def test_column_of_masses_on_springs_comes_to_rest_at_equilibrium():
    count, mass, stiffness = 10, 0.5, 400.0
    balls = [ball(f"b{k}", 0.0, -0.5 * (k + 1), mass) for k in range(count)]
    first = spring("b0", None, stiffness, 0.4, anchors=[[0.0, 0.0], [0.0, 0.0]])
    others = [spring(f"b{k}", f"b{k + 1}", stiffness, 0.4) for k in range(count - 1)]
    simulation = run(scene_of({"linear_drag": 5.0}, ball=balls, joint=[first, *others]), 40.0)
    lengths = -np.diff(simulation.frame().position[:, 1], prepend=0.0)
    below = np.arange(count, 0, -1)  # masses that hang from each spring
    assert lengths == pytest.approx(0.4 + below * mass * G / stiffness, rel=1e-11)  # rounding


def test_box_between_two_springs_comes_to_rest_at_equilibrium():
    box = {"name": "box", "position": [0.0, -1.0], "size": [2.0, 0.2], "mass": 3.0, "collides": "none"}
    # asymmetric arms
    held = [{**spring("box", None, 60.0, damping=4.0), "anchors": [[x, 0.0], [x, 0.0]]} for x in (-0.7, 1.0)]
    simulation = run(scene_of(LINEAR, box=[box], joint=held), 60.0)
    # Forces and moments about the centre balance; the box tilts until they do.
    frame = simulation.frame()
    angle, (x, y) = float(frame.angle[0]), frame.position[0]
    ends = [(x + arm * math.cos(angle), y + arm * math.sin(angle)) for arm in (-0.7, 1.0)]
    forces = [np.array([60.0 * (anchor - ex), -60.0 * ey]) for anchor, (ex, ey) in zip((-0.7, 1.0), ends, strict=True)]
    assert np.sum(forces, axis=0) == pytest.approx([0.0, 3.0 * G], abs=1e-10)  # rounding
    moments = [(ex - x) * f[1] - (ey - y) * f[0] for (ex, ey), f in zip(ends, forces, strict=True)]
    assert sum(moments) == pytest.approx(0.0, abs=1e-9)


@each_drag
@pytest.mark.parametrize("by", ["thrust", "force", "zone", "gravity"])
def test_terminal_speed_under_any_force_is_exact(drag, by):
    mass, force = 2.0, 6.0
    more: dict[str, Any] = {}
    actions: list[Action] = []
    if by == "thrust":
        more["thrust"] = [{"body": "a", "force": [force, 0.0]}]
    elif by == "force":
        actions.append(Force(time=0.0, body="a", force=(force, 0.0)))
    elif by == "zone":
        more["zone"] = [{"position": [0.0, 0.0], "radius": 1e4, "gravity": [force / mass, 0.0]}]
    body = ball("a", 0.0, 0.0, mass) | {"collides": "fixed"}  # collides with nothing but is subject to zones
    scene = scene_of(drag, 0.0, ball=[body], **more)
    if by == "gravity":
        scene = scene.model_copy(update={"world": scene.world.model_copy(update={"gravity": (force / mass, 0.0)})})
    simulation = run(scene, 10.0, *actions)
    assert simulation.frame().velocity[0, 0] == pytest.approx(terminal_speed(drag, force / mass), rel=1e-12)  # rounding


@each_drag
@each_wind
@pytest.mark.parametrize("moving", [True, False], ids=["body", "place"])
def test_attraction_balances_a_spring(drag, wind, moving):
    """Equilibrium on a spring under the attraction of a point or of a fixed body, and in wind."""
    mass, stiffness, strength = 1.0, 400.0, 6.0
    sun = {"sun": ball("sun", 4.0, 0.0, 1.0, fixed=True)} if moving else {}
    held = spring("a", None, stiffness, anchors=[[0.0, 0.0], [0.0, 0.0]], damping=2.0)
    attraction = {"toward": "sun" if moving else [4.0, 0.0], "strength": strength}
    position = np.zeros(2)
    for _ in range(60):  # fixed-point iteration: the attraction varies by a hundredth of the spring force
        offset = np.array([4.0, 0.0]) - position
        acceleration = strength * offset / np.hypot(*offset) ** 3 + drag_rate(drag, math.hypot(*wind)) * np.asarray(
            wind
        )
        position = mass / stiffness * acceleration
    scene = scene_of(
        drag, 0.0, wind, ball=[ball("a", *position, mass), *sun.values()], joint=[held], attraction=[attraction]
    )
    frame = run(scene, 5.0).frame()
    assert frame.position[0] == pytest.approx(position, rel=1e-11)  # rounding
    assert frame.velocity[0] == pytest.approx(np.zeros(2), abs=1e-12)


@pytest.mark.parametrize("drag", [LINEAR, QUADRATIC, BOTH], ids=["linear", "quadratic", "both"])
@pytest.mark.parametrize("fixed", [True, False])
def test_ledger_closes_with_drag_and_every_other_force(drag, fixed):
    balls = [
        ball("a", 0.1, 0.0, 1.0, velocity=[1.0, 2.0]),
        ball("b", 1.3, 0.2, 2.0),
        ball("sun", 4.0, 0.0, 3.0, fixed=fixed),
        ball("free", -2.0, 1.0, 1.0, velocity=[0.0, 3.0]),
    ]
    joints = [spring("a", None, 40.0, anchors=[[0.0, 0.0], [0.0, 0.0]], damping=0.5), spring("a", "b", 30.0, 0.5)]
    scene = scene_of(
        drag,
        wind=(2.0, 0.5),
        ball=balls,
        joint=joints,
        attraction=[{"toward": "sun", "strength": 6.0}, {"toward": [0.0, 5.0], "strength": 2.0, "softening": 0.5}],
        thrust=[{"body": "b", "force": [1.0, 2.0], "point": [0.01, 0.02]}],
    )
    account = closed_account(scene, 100)
    assert account[Cause.DRAG] != 0.0


def test_ledger_closes_with_drag_where_a_spring_presses_balls_into_a_floor():
    """The correction of overlap moves the ends of the spring after its force in the step was predicted."""
    balls = [
        {**ball(name, x, y), "radius": 0.1, "collides": "all"} for name, x, y in (("a", 0.0, 0.02), ("c", 0.15, 0.05))
    ]
    floor = {"point": [0.0, 0.0], "normal": [0.0, 1.0]}
    scene = scene_of(
        {"linear_drag": 30.0},
        ball=balls,
        plane=[floor],
        joint=[spring("a", "c", 3000.0, 0.5, anchors=[[0.0, 0.0], [0.0, 0.0]])],
    )
    closed_account(scene, 100)


def test_forces_are_unscaled_without_drag():
    """Without drag a mass on a spring follows semi-implicit Euler exactly."""
    held = spring("a", None, 50.0, anchors=[[0.0, 0.0], [0.0, 0.0]])
    simulation = start(scene_of({}, 0.0, ball=[ball("a", 0.3, 0.0)], joint=[held]))
    simulation.apply(Impulse(time=0.0, body="a", impulse=(0.2, 0.0)))
    x, v = 0.3, 0.2
    for _ in range(200):
        simulation.step()
        x += v * DT
        v -= 50.0 * x * DT
        assert simulation.frame().position[0, 0] == pytest.approx(x, abs=1e-13)  # rounding
