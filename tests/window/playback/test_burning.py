"""Flames: which thrusts fire, where, which way and how long."""

import math

import numpy as np
import pygame
import pytest

from sandbox.action import Throttle
from sandbox.scene.files.load import loads
from sandbox.window.camera import Camera
from sandbox.window.playback.live import LiveView
from sandbox.window.playback.session import Session
from sandbox.window.playback.snapshot import LONG, Snapshot, active_thrusters
from sandbox.window.render.palette import ORANGE
from sandbox.window.render.renderer import Renderer

SHIP = """
title = "Ship"
[[polygon]]
name = "ship"
points = [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]]   # the centre of mass lies at (1, 1)
angle = 0.5
[[thrust]]
name = "main"
body = "ship"
force = [4.0, 0.0]
point = [0.0, 1.0]
key = "up"
[[thrust]]
name = "always"
body = "ship"
force = [0.0, 1.0]
point = [1.0, 0.0]
begin = 1.0
end = 2.0
"""
SCENE = loads(SHIP)
REACH = math.sqrt(2.0)  # m, from the middle of a square of 2 m to its corner


def throttle(level: float) -> dict[str, Throttle]:
    return {"main": Throttle(time=0.0, thrust="main", level=level)}


def test_thrust_with_a_key_burns_as_far_as_it_is_open() -> None:
    assert active_thrusters(SCENE, SCENE.bodies, {}, 0.0) == ()
    assert active_thrusters(SCENE, SCENE.bodies, throttle(0.0), 0.0) == ()
    (flame,) = active_thrusters(SCENE, SCENE.bodies, throttle(0.25), 0.0)
    assert flame.body == 0
    assert flame.place == pytest.approx((-1.0, 0.0))  # seen from the centre of mass
    assert flame.way == pytest.approx((-0.5 * LONG * REACH, 0.0))  # against the force, by the root of 0.25


def test_thrust_of_a_time_burns_then() -> None:
    assert [len(active_thrusters(SCENE, SCENE.bodies, {}, time)) for time in (0.99, 1.0, 1.99, 2.0)] == [0, 1, 1, 0]
    (flame,) = active_thrusters(SCENE, SCENE.bodies, {}, 1.0)
    assert flame.way == pytest.approx((0.0, -0.5 * LONG * REACH))  # a fourth of the strongest force


def test_window_shows_what_fires() -> None:
    live = LiveView(Session(SCENE))
    assert live.snapshot(frozenset({"shapes"})).flames == ()
    live.apply(Throttle(time=0.0, thrust="main", level=1.0))
    (flame,) = live.snapshot(frozenset({"shapes"})).flames
    assert flame.way == pytest.approx((-LONG * REACH, 0.0))
    live.close()


def test_flame_is_drawn_behind_the_nozzle_and_turns_with_the_body() -> None:
    pygame.font.init()
    surface = pygame.Surface((400, 400))
    camera = Camera((1.0, 1.0), 40.0, (400, 400))
    bodies = SCENE.bodies
    flames = active_thrusters(SCENE, bodies, throttle(1.0), 0.0)
    live = LiveView(Session(SCENE))
    Renderer().draw(surface, camera, Snapshot(SCENE, bodies, live.frame, flames=flames))
    orange = np.abs(pygame.surfarray.array3d(surface).astype(int) - ORANGE).sum(axis=2) < 10
    centre = live.frame.position[0]
    along = np.array((math.cos(0.5), math.sin(0.5)))
    for share, there in ((0.9, True), (1.2, False)):  # of its length behind the body's edge
        place = centre - along * (1.0 + share * LONG * REACH)
        x, y = camera.to_screen(place[None])[0].round().astype(int)
        assert orange[x - 3 : x + 4, y - 3 : y + 4].any() == there
    live.close()
