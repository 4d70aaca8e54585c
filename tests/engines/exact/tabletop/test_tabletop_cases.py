"""The stored reference shots agree with closed formulas."""

import json
import math
import tomllib
from pathlib import Path
from typing import Any

import pytest

CASES = Path(__file__).parent / "cases"
NAMES = sorted(path.stem for path in CASES.glob("*.json"))
G, SLIDING, ROLLING, R = 9.81, 0.2, 0.01, 0.028575
SEPARATION_ERROR = 1e-9  # m: colliding balls are separated by 1e-12 m, which rotates normals; then they roll metres


def case(name: str) -> dict[str, Any]:
    return json.loads((CASES / f"{name}.json").read_text())


def scene(name: str) -> dict[str, Any]:
    return tomllib.loads((CASES / f"{name}.toml").read_text())


def rest_after(v: tuple[float, float], spin: list[float]) -> list[float]:
    """Return where a ball from the origin comes to rest: it slides for 2u/(7μg) s, then rolls v²/(2μg) m."""
    u = v[0] - R * spin[1], v[1] + R * spin[0]
    slide_time = 2.0 * math.hypot(*u) / (7.0 * SLIDING * G)
    rolling_velocity = [a - 2.0 / 7.0 * b for a, b in zip(v, u, strict=True)]
    distance = math.hypot(*rolling_velocity) / (2.0 * ROLLING * G)
    return [(a + b) / 2.0 * slide_time + b * distance for a, b in zip(v, rolling_velocity, strict=True)]


@pytest.mark.parametrize("name", NAMES)
def test_case_belongs_to_its_scene(name: str) -> None:
    stored, document = case(name), scene(name)
    balls = [ball["name"] for ball in document["ball"]]
    fixed = [thing["name"] for key in ("wall", "post", "pocket") for thing in document.get(key, [])]
    assert stored["balls"] == balls
    assert all(set(event["names"]) <= {*balls, *fixed} for event in stored["events"])
    assert stored["times"] == [k * document["solver"]["dt"] for k in stored["frames"]]
    assert stored["times"][-1] <= stored["trusted_until"] <= document["world"]["duration"]
    assert stored["position_error"] <= 1e-8  # m: the bound that the generator of the files guarantees
    assert len(stored["position"]) == len(stored["velocity"]) == len(stored["spin"]) == len(stored["times"])


@pytest.mark.parametrize("name", ["stun", "draw", "follow", "swerve"])
def test_single_ball_rests_at_the_closed_form(name: str) -> None:
    ball = scene(name)["ball"][0]
    expected = rest_after(tuple(ball["velocity"]), ball.get("spin", [0.0, 0.0, 0.0]))
    assert case(name)["rest"]["position"][0] == pytest.approx(expected, abs=1e-13)  # m: rounding over metres


def test_stun_shot_rolls_the_distance_of_the_closed_form() -> None:
    v = math.hypot(*scene("stun")["ball"][0]["velocity"])
    distance = 12.0 * v**2 / (49.0 * SLIDING * G) + (5.0 * v / 7.0) ** 2 / (2.0 * ROLLING * G)
    assert math.hypot(*case("stun")["rest"]["position"][0]) == pytest.approx(distance, rel=1e-14)  # rounding


@pytest.mark.parametrize(("name", "e", "friction"), [("full_elastic", 1.0, False), ("full_frictional", 0.95, True)])
def test_full_hit_transfers_speed_and_spin(name: str, e: float, friction: bool) -> None:
    v = math.sqrt(4.0 - 2.0 * SLIDING * G * 0.2)  # m/s: after sliding 0.2 m from 2 m/s
    t = (2.0 - v) / (SLIDING * G)
    spin = -5.0 * SLIDING * G * t / (2.0 * R)
    normal_speed = (1.0 + e) / 2.0 * v
    mu = 0.009951 + 0.108 * math.exp(-1.088 * R * abs(spin))
    spin_change = (
        2.5 / R * min(mu * normal_speed, R * abs(spin) / 7.0) if friction else 0.0
    )  # the cue ball's spin is < 0
    cue = rest_after((0.0, v - normal_speed), [spin + spin_change, 0.0, 0.0])
    object_ = rest_after((0.0, normal_speed), [spin_change, 0.0, 0.0])
    stored = case(name)
    assert stored["events"][0] == {"time": pytest.approx(t, abs=1e-14), "kind": "ball_ball", "names": stored["balls"]}
    assert stored["rest"]["position"][0] == pytest.approx(cue, abs=SEPARATION_ERROR)
    assert stored["rest"]["position"][1] == pytest.approx([object_[0], object_[1] + 2.0 * R], abs=SEPARATION_ERROR)


def test_balls_of_equal_acceleration_collide_at_the_root_of_a_quadratic() -> None:
    fast, slow = scene("alike")["ball"]
    d = [b - a for a, b in zip(fast["position"], slow["position"], strict=True)]
    w = [b - a for a, b in zip(fast["velocity"], slow["velocity"], strict=True)]
    a, b, c = w[0] ** 2 + w[1] ** 2, d[0] * w[0] + d[1] * w[1], d[0] ** 2 + d[1] ** 2 - 4.0 * R**2
    (first, *_) = case("alike")["events"]
    assert first["time"] == pytest.approx((-b - math.sqrt(b * b - a * c)) / a, abs=1e-12)  # s: rounding
    assert first["names"] == ["fast", "slow"]
