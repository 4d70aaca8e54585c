"""The stored shots, by formulas that any of them can be checked with on paper: what they are compared with is right."""

import json
import math
import tomllib
from pathlib import Path
from typing import Any

import pytest

CASES = Path(__file__).parent / "cases"
NAMES = sorted(path.stem for path in CASES.glob("*.json"))
G, SLIDING, ROLLING, R = 9.81, 0.2, 0.01, 0.028575
PARTED = 1e-9  # m: bodies that meet are parted by 1e-12 m, which turns normals, and the balls then roll for metres


def case(name: str) -> dict[str, Any]:
    return json.loads((CASES / f"{name}.json").read_text())


def scene(name: str) -> dict[str, Any]:
    return tomllib.loads((CASES / f"{name}.toml").read_text())


def rest_after(v: tuple[float, float], spin: list[float]) -> list[float]:
    """Where a ball comes to rest that starts at the origin: it slides for 2u/(7μg), then rolls v²/(2μg)."""
    u = v[0] - R * spin[1], v[1] + R * spin[0]
    lasts = 2.0 * math.hypot(*u) / (7.0 * SLIDING * G)
    rolls = [a - 2.0 / 7.0 * b for a, b in zip(v, u, strict=True)]
    far = math.hypot(*rolls) / (2.0 * ROLLING * G)
    return [(a + b) / 2.0 * lasts + b * far for a, b in zip(v, rolls, strict=True)]


@pytest.mark.parametrize("name", NAMES)
def test_a_case_is_of_its_scene(name: str) -> None:
    stored, played = case(name), scene(name)
    balls = [ball["name"] for ball in played["ball"]]
    fixed = [thing["name"] for key in ("wall", "post", "pocket") for thing in played.get(key, [])]
    assert stored["balls"] == balls
    assert all(set(event["names"]) <= {*balls, *fixed} for event in stored["events"])
    assert stored["times"] == [k * played["solver"]["dt"] for k in stored["frames"]]
    assert stored["times"][-1] <= stored["trusted_until"] <= played["world"]["duration"]
    assert stored["position_error"] <= 1e-8  # m: what the maker of the files holds them to
    assert len(stored["position"]) == len(stored["velocity"]) == len(stored["spin"]) == len(stored["times"])


@pytest.mark.parametrize("name", ["stun", "draw", "follow", "swerve"])
def test_a_lone_ball_rests_where_the_closed_form_says(name: str) -> None:
    ball = scene(name)["ball"][0]
    there = rest_after(tuple(ball["velocity"]), ball.get("spin", [0.0, 0.0, 0.0]))
    assert case(name)["rest"]["position"][0] == pytest.approx(there, abs=1e-13)  # m: rounding over metres


def test_a_stun_shot_rolls_as_far_as_the_known_formula() -> None:
    v = math.hypot(*scene("stun")["ball"][0]["velocity"])
    far = 12.0 * v**2 / (49.0 * SLIDING * G) + (5.0 * v / 7.0) ** 2 / (2.0 * ROLLING * G)
    assert math.hypot(*case("stun")["rest"]["position"][0]) == pytest.approx(far, rel=1e-14)  # rounding


@pytest.mark.parametrize(("name", "e", "rubs"), [("full_elastic", 1.0, False), ("full_frictional", 0.95, True)])
def test_a_full_hit_shares_speed_and_spin(name: str, e: float, rubs: bool) -> None:
    v = math.sqrt(4.0 - 2.0 * SLIDING * G * 0.2)  # m/s: it has slid for 0.2 m from 2 m/s
    t = (2.0 - v) / (SLIDING * G)
    spin = -5.0 * SLIDING * G * t / (2.0 * R)
    push = (1.0 + e) / 2.0 * v
    mu = 0.009951 + 0.108 * math.exp(-1.088 * R * abs(spin))
    turn = 2.5 / R * min(mu * push, R * abs(spin) / 7.0) if rubs else 0.0  # the cue ball's spin is below 0
    cue = rest_after((0.0, v - push), [spin + turn, 0.0, 0.0])
    object_ = rest_after((0.0, push), [turn, 0.0, 0.0])
    stored = case(name)
    assert stored["events"][0] == {"time": pytest.approx(t, abs=1e-14), "kind": "ball_ball", "names": stored["balls"]}
    assert stored["rest"]["position"][0] == pytest.approx(cue, abs=PARTED)
    assert stored["rest"]["position"][1] == pytest.approx([object_[0], object_[1] + 2.0 * R], abs=PARTED)


def test_balls_of_equal_accelerations_meet_at_the_root_of_a_quadratic() -> None:
    fast, slow = scene("alike")["ball"]
    d = [b - a for a, b in zip(fast["position"], slow["position"], strict=True)]
    w = [b - a for a, b in zip(fast["velocity"], slow["velocity"], strict=True)]
    a, b, c = w[0] ** 2 + w[1] ** 2, d[0] * w[0] + d[1] * w[1], d[0] ** 2 + d[1] ** 2 - 4.0 * R**2
    (first, *_) = case("alike")["events"]
    assert first["time"] == pytest.approx((-b - math.sqrt(b * b - a * c)) / a, abs=1e-12)  # s: rounding
    assert first["names"] == ["fast", "slow"]
