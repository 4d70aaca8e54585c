"""Flames of thrusters: which are active, and their position, direction and length."""

import math

import numpy as np
import pytest

from sandbox.action import Throttle
from sandbox.scene.files.load import loads
from sandbox.window.camera import Camera
from sandbox.window.playback.live import LiveView
from sandbox.window.playback.session import Session
from sandbox.window.playback.snapshot import FLAME_LENGTH, active_thrusters
from sandbox.window.render.palette import ORANGE
from tests.toml_text import toml
from tests.window.render.drawn import render, snapshot

SHIP = (
    toml(title="Ship")
    # the centre of mass is at (1, 1)
    + toml("polygon", name="ship", points=[[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]], angle=0.5)
    + toml("thrust", name="main", body="ship", force=[4.0, 0.0], point=[0.0, 1.0], key="up")
    + toml("thrust", name="always", body="ship", force=[0.0, 1.0], point=[1.0, 0.0], begin=1.0, end=2.0)
)
SCENE = loads(SHIP)
REACH = math.sqrt(2.0)  # m, from the centre of a square of 2 m to its corner


def throttle(level: float) -> dict[str, Throttle]:
    return {"main": Throttle(time=0.0, thrust="main", level=level)}


def test_flame_of_a_throttled_thrust_scales_with_its_level() -> None:
    assert active_thrusters(SCENE, SCENE.bodies, {}, 0.0) == ()
    assert active_thrusters(SCENE, SCENE.bodies, throttle(0.0), 0.0) == ()
    (flame,) = active_thrusters(SCENE, SCENE.bodies, throttle(0.25), 0.0)
    assert flame.body == 0
    assert flame.origin == pytest.approx((-1.0, 0.0))  # relative to the centre of mass
    # Against the force; the length is proportional to the square root of 0.25.
    assert flame.direction == pytest.approx((-0.5 * FLAME_LENGTH * REACH, 0.0))


def test_timed_thrust_has_a_flame_only_in_its_interval() -> None:
    assert [len(active_thrusters(SCENE, SCENE.bodies, {}, time)) for time in (0.99, 1.0, 1.99, 2.0)] == [0, 1, 1, 0]
    (flame,) = active_thrusters(SCENE, SCENE.bodies, {}, 1.0)
    assert flame.direction == pytest.approx((0.0, -0.5 * FLAME_LENGTH * REACH))  # a quarter of the strongest force


def test_snapshot_of_a_live_view_contains_active_flames() -> None:
    live = LiveView(Session(SCENE))
    assert live.snapshot(frozenset({"shapes"})).flames == ()
    live.apply(Throttle(time=0.0, thrust="main", level=1.0))
    (flame,) = live.snapshot(frozenset({"shapes"})).flames
    assert flame.direction == pytest.approx((-FLAME_LENGTH * REACH, 0.0))
    live.close()


def test_flame_is_drawn_behind_the_nozzle_and_rotates_with_the_body() -> None:
    camera = Camera((1.0, 1.0), 40.0, (400, 400))
    flames = active_thrusters(SCENE, SCENE.bodies, throttle(1.0), 0.0)
    orange = np.abs(render(snapshot(SCENE, flames=flames), camera).astype(int) - ORANGE).sum(axis=2) < 10
    centre = SCENE.bodies.position[0]
    along = np.array((math.cos(0.5), math.sin(0.5)))
    for fraction, is_flame in ((0.9, True), (1.2, False)):  # of its length behind the edge of the body
        point = centre - along * (1.0 + fraction * FLAME_LENGTH * REACH)
        x, y = camera.to_screen(point[None])[0].round().astype(int)
        assert orange[x - 3 : x + 4, y - 3 : y + 4].any() == is_flame
