"""Energy ledger of the exact engine: it closes to rounding, obeys closed forms and does not affect the run."""

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sandbox
from sandbox.action import Impulse, Move, Remove, SetParameter, Spawn
from sandbox.engines.energy_ledger import Cause
from sandbox.engines.registry import start
from sandbox.scene.compile.scene import Scene
from tests import accounts
from tests.engines.builders import make_scene
from tests.engines.stepping import advance

SCENES = Path(__file__).parents[3] / "scenes"
G = 10.0
# Rounding of thousands of sums; a thousandth of the documented bound.
closed_account = partial(accounts.closed_account, engine="exact", closes=1e-12)


def scene_of(*balls: dict[str, Any], e: float = 0.5, mu: float = 0.0, slope: float = 0.0, g: float = G) -> Scene:
    coefficients = {"restitution": e, "friction": mu}
    gravity = [-g * np.sin(slope), -g * np.cos(slope)]
    return make_scene(
        world={"gravity": gravity, "duration": 5.0},
        solver={"dt": 0.01},
        plane=[{"point": [0, 0], "normal": [0, 1], "material": "coat"}],
        material=[{"name": "coat"}],
        pair=[{"between": ["coat", "coat"], **coefficients}],
        ball=[{"material": "coat", **ball} for ball in balls],
    )


def ball(name: str, x: float, y: float, **more: Any) -> dict[str, Any]:
    return {"name": name, "position": [x, y], "radius": 0.5, "mass": 2.0, **more}


@pytest.mark.parametrize(
    ("name", "steps"),
    [
        ("tutorial/fireworks", 60),
        ("tutorial/bounce", 200),
        ("benchmark/two_balls", 150),
        ("benchmark/newtons_cradle", 150),
        ("benchmark/incline", 150),
        ("benchmark/slide_to_roll", 150),
        ("benchmark/gas", 150),
    ],
)
def test_ledger_of_a_shipped_scene_closes(name: str, steps: int) -> None:
    closed_account(sandbox.load(SCENES / f"{name}.toml"), steps)


def test_infinite_bounces_book_all_potential_energy_as_restitution() -> None:
    account = closed_account(scene_of(ball("a", 0, 1.5)), 300)
    assert account[Cause.RESTITUTION] == pytest.approx(-2.0 * G * 1.0, rel=1e-12)  # rounding of some 50 bounces
    assert account[Cause.PHANTOM] == pytest.approx(0.0, abs=1e-14)  # rounding


def test_sliding_ball_loses_a_third_of_its_energy_to_friction_until_it_rolls() -> None:
    account = closed_account(scene_of(ball("a", 0, 0.5, velocity=[3.0, 0.0]), mu=0.2), 200)
    # A disc rolls at two thirds of its speed, which removes a third of ½ m v².
    assert account[Cause.FRICTION] == pytest.approx(-0.5 * 2.0 * 9.0 / 3.0, rel=1e-12)  # rounding
    assert account[Cause.RESTITUTION] == pytest.approx(0.0, abs=1e-14)  # rounding


def test_friction_work_downhill_is_force_times_slip_distance() -> None:
    slope, mu, steps = 0.8, 0.2, 150
    account = closed_account(scene_of(ball("a", 0, 0.5), mu=mu, slope=slope), steps)
    force, time = mu * 2.0 * G * np.cos(slope), steps * 0.01
    # From rest it slides and rotates: gravity increases the slip velocity, and friction reduces it by 3 F/m.
    slip = 0.5 * (G * np.sin(slope) - 3.0 * force / 2.0) * time**2
    assert account[Cause.FRICTION] == pytest.approx(-force * slip, rel=1e-12)  # rounding


def test_energy_loss_of_a_head_on_impact_follows_restitution() -> None:
    e, v, m1, m2 = 0.5, 4.0, 2.0, 6.0
    balls = ball("a", 0, 3, velocity=[v, 0]), ball("b", 2, 3, mass=m2)
    account = closed_account(scene_of(*balls, e=e, g=0.0), 60)
    assert account[Cause.RESTITUTION] == pytest.approx(-0.5 * m1 * m2 / (m1 + m2) * (1 - e**2) * v**2, rel=1e-14)
    assert account[Cause.FRICTION] == 0.0


def test_oblique_impact_books_friction_and_restitution_separately() -> None:
    mu, e, v, w = 0.1, 0.5, 3.0, 4.0
    account = closed_account(scene_of(ball("a", 0, 0.8, velocity=[w, -v]), e=e, mu=mu, g=0.0), 20)
    normal = 2.0 * (1 + e) * v
    # The contact slips throughout: friction removes μ J times the mean slip, w − ½·3 μ J/m.
    assert account[Cause.FRICTION] == pytest.approx(-mu * normal * (w - 1.5 * mu * normal / 2.0), rel=1e-14)
    assert account[Cause.RESTITUTION] == pytest.approx(-0.5 * 2.0 * (1 - e**2) * v**2, rel=1e-14)  # rounding, as above


ACTIONS: accounts.Timed = [
    (5, Impulse(time=0, body="a", impulse=(1.0, 0.5), angular=0.1)),
    (20, Spawn(time=0, ball={"name": "n", "position": (0.5, 3.0), "radius": 0.1, "mass": 2.0, "velocity": (1.0, 2.0)})),
    (30, Remove(time=0, body="c")),
    (40, SetParameter(time=0, path="world.gravity", value=[1.0, -5.0])),
    (60, Move(time=0, body="a", position=(9.0, 2.0))),
]


@pytest.mark.parametrize("fraction", [None, 0.37])
def test_ledger_stays_closed_through_actions(fraction: float | None) -> None:
    balls = ball("a", 0, 0.5), ball("b", 3, 1.0, velocity=[-1, 0]), ball("c", 6, 3, collides="none")
    account = closed_account(scene_of(*balls, mu=0.3), 80, ACTIONS, fraction)
    assert account[Cause.RETIRED] < 0.0
    assert account[Cause.ACTIONS] != 0.0
    assert account[Cause.FRICTION] < 0.0


def test_ball_spawned_with_a_velocity_starts_at_its_position() -> None:
    simulation = start(scene_of(ball("a", 9, 0.5)), "exact")
    advance(simulation, 50)
    new = {"name": "n", "position": (0.0, 3.0), "radius": 0.1, "velocity": (1.0, 2.0), "angular_velocity": 4.0}
    simulation.apply(Spawn(time=0, ball=new))
    simulation.step()
    frame = simulation.frame()
    # Regression: it once started displaced by the motion since time 0.
    assert frame.position[-1] == pytest.approx([0.01, 3.0 + 2.0 * 0.01 - 0.5 * G * 0.01**2], rel=1e-14)  # rounding
    assert frame.angle[-1] == pytest.approx(0.04, rel=1e-14)  # rounding
