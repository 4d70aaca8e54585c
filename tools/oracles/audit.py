"""Audit of the oracle: its runs are compared with independent formulas.

Between two events every ball is advanced by the closed forms of sliding, rolling and spinning; each impact is computed
from the states before it; and between events no bodies may overlap. Everything is derived from the scene alone.
"""

import itertools
import math
from typing import Any, NamedTuple

import numpy as np

Document = dict[str, Any]
Array = np.ndarray

RESTING = 1e-9
"""m/s; smaller speeds count as no slip and no motion."""


class Event(NamedTuple):
    """An event: time, kind, names of the bodies, and the states (N, 3, 3) of all balls before and after it."""

    time: float
    kind: str
    names: tuple[str, ...]
    before: Array
    after: Array


class Rules:
    """An independent implementation of the physics of a scene."""

    def __init__(self, document: Document) -> None:
        self.floor, self.models = document["surface"], document["contact_models"]
        self.balls = [ball["name"] for ball in document["ball"]]
        self.radius = document["ball"][0]["radius"]
        self.restitution = document["pair"][0]["restitution"]
        self.rail = document["material"][1]
        self.walls = {wall["name"]: wall for wall in document.get("wall", [])}
        self.posts = {post["name"]: post for post in document.get("post", [])}
        self.pockets = {pocket["name"]: pocket for pocket in document.get("pocket", [])}

    def slip(self, state: Array) -> Array:
        """Return the velocity (2,) of the lowest point of a ball, m/s."""
        _, v, w = state
        return np.array([v[0] - self.radius * w[1], v[1] + self.radius * w[0]])

    def advanced(self, state: Array, t: float) -> Array:
        """Return the state (position, velocity, spin) of a ball after a time t, s, of sliding, rolling and rest."""
        x, v, w = state[0, :2].copy(), state[1, :2].copy(), state[2].copy()
        g, r = self.floor["gravity"], self.radius
        spin_loss = 5.0 * self.floor["spinning_friction"] * g / (2.0 * r) * t
        about_z = math.copysign(max(abs(w[2]) - spin_loss, 0.0), w[2])
        u = self.slip(state)
        size = math.hypot(*u)
        if size > RESTING:
            deceleration = self.floor["sliding_friction"] * g
            duration = min(t, 2.0 * size / (7.0 * deceleration))
            a = -deceleration * u / size
            x, v = x + v * duration + a * duration**2 / 2.0, v + a * duration
            # ω̇ = (5/2R²)·(r × a) with r = −R·ẑ from the centre to the cloth
            w[:2] += 2.5 / r * np.array([a[1], -a[0]]) * duration
            t -= duration
        speed = math.hypot(*v)
        if t > 0.0 and speed > RESTING:
            drag = self.floor["rolling_friction"] * g
            duration = min(t, speed / drag)
            a = -drag * v / speed
            x, v = x + v * duration + a * duration**2 / 2.0, v + a * duration
            w[:2] = -v[1] / r, v[0] / r
        result = np.zeros((3, 3))
        result[0, :2], result[1, :2], result[2] = x, v, [w[0], w[1], about_z]
        return result

    def after_impact(self, event: Event) -> dict[str, Array]:
        """Return the states after an impact, by name.

        Positions are those after the event: pooltool first separates the bodies slightly, which turns normals.
        """
        states = event.before.copy()
        states[:, 0] = event.after[:, 0]
        if event.kind == "ball_ball":
            a, b = (states[self.balls.index(name)] for name in event.names)
            return dict(zip(event.names, self._after_ball_collision(a, b), strict=True))
        if event.kind == "cushion":
            name, cushion = event.names
            return {name: self._after_cushion(states[self.balls.index(name)], cushion)}
        return {}

    def _after_ball_collision(self, a: Array, b: Array) -> tuple[Array, Array]:
        a, b = a.copy(), b.copy()
        n = (b[0] - a[0]) / np.linalg.norm(b[0] - a[0])
        approach = float((a[1] - b[1]) @ n)
        assert approach > 0.0, f"two balls separate at {approach:g} m/s and yet collide"
        normal_impulse = (1.0 + self.restitution) / 2.0 * approach
        friction_impulse = np.zeros(3)
        if self.models["ball_ball"] == "frictional":
            tangential = a[1] - b[1] - approach * n
            u = tangential + self.radius * np.cross(a[2] + b[2], n)
            size = float(np.linalg.norm(u))
            mu = 0.009951 + 0.108 * math.exp(-1.088 * size)
            if size > 0.0:
                friction_impulse = -u / size * min(mu * normal_impulse, size / 7.0)
        for state, sign in ((a, 1.0), (b, -1.0)):
            state[1] += sign * (friction_impulse - normal_impulse * n)
            state[1, 2] = 0.0
            state[2] += 2.5 / self.radius * np.cross(n, friction_impulse)
        return a, b

    def _after_cushion(self, state: Array, cushion: str) -> Array:
        """Return the state of a ball after a cushion, computed in the frame of the normal into it and the tangent."""
        state = state.copy()
        fixed = self.walls.get(cushion) or self.posts[cushion]
        n = self.nearest(fixed, state[0, :2]) - state[0, :2]
        n /= math.hypot(*n)
        left = np.array([-n[1], n[0]])
        vx, vy = float(state[1, :2] @ n), float(state[1, :2] @ left)
        wx, wy, wz = float(state[2, :2] @ n), float(state[2, :2] @ left), float(state[2, 2])
        assert vx > 0.0, f"a ball leaves a cushion at {vx:g} m/s and yet collides"
        e, r = self.rail["restitution"], self.radius
        if self.models["cushion"] == "simple":
            vx = -e * vx
        else:
            sin = fixed["height"] / r - 1.0
            cos = math.sqrt(1.0 - sin * sin)
            slip = np.array([vx * sin + r * wy, -vy - r * wz * cos + r * wx * sin])
            size, normal = float(np.hypot(*slip)), (1.0 + e) * vx * cos
            px, py = slip / size * min(2.0 / 7.0 * size, self.rail["friction"] * normal) if size else (0.0, 0.0)
            into, up = -px * sin - normal * cos, px * cos - normal * sin
            vx, vy = vx + into, vy + py
            wx -= 2.5 / r * py * sin
            wy += 2.5 / r * (into * sin - up * cos)
            wz += 2.5 / r * py * cos
        state[1, :2], state[2, :2], state[2, 2] = vx * n + vy * left, wx * n + wy * left, wz
        return state

    def nearest(self, fixed: Document, point: Array) -> Array:
        """Return the nearest point of a wall, or the centre of a post."""
        if "position" in fixed:
            return np.array(fixed["position"])
        a, b = np.array(fixed["points"])
        fraction = np.clip(((point - a) @ (b - a)) / ((b - a) @ (b - a)), 0.0, 1.0)
        nearest: Array = a + fraction * (b - a)
        return nearest


class Verdict(NamedTuple):
    """Largest deviations of a run from our formulas; spins are multiplied by the radius."""

    position: float
    """m"""
    velocity: float
    """m/s"""
    overlap: float
    """m"""
    separation: float
    """m, by which colliding bodies were moved apart"""


def audit(document: Document, events: list[Event], samples: int = 40) -> Verdict:
    """Return the deviations of a run; overlaps are checked at `samples` times between two events.

    Raises:
        AssertionError: separating bodies collide, or a captured ball has moved.
    """
    rules = Rules(document)
    position = velocity = overlap = separation = 0.0
    captured: dict[str, str] = {}
    for last, event in itertools.pairwise(events):
        span = event.time - last.time
        for index in range(len(rules.balls)):
            expected = rules.advanced(last.after[index], span)
            deviation = np.abs(expected - event.before[index])
            position = max(position, float(deviation[0, :2].max()))
            velocity = max(velocity, float(deviation[1].max()), float(deviation[2].max()) * rules.radius)
        for fraction in np.linspace(0.0, 1.0, samples + 1)[1:-1] if span > 1e-9 else ():
            overlap = max(overlap, _overlap(rules, last.after, float(fraction) * span, captured))
        for name, expected in rules.after_impact(event).items():
            deviation = np.abs(expected - event.after[rules.balls.index(name)])
            velocity = max(velocity, float(deviation[1].max()), float(deviation[2].max()) * rules.radius)
            separation = max(separation, math.dist(expected[0], event.before[rules.balls.index(name), 0]))
        if event.kind == "pocket":
            name, pocket = event.names
            captured[name] = pocket
            rest_state = event.after[rules.balls.index(name)]
            assert not rest_state[1:].any() and rest_state[0, :2].tolist() == rules.pockets[pocket]["position"]
    return Verdict(position, velocity, overlap, separation)


def _overlap(rules: Rules, states: Array, t: float, captured: dict[str, str]) -> float:
    """Return the deepest overlap, m, of balls on the table with each other, walls, posts or pockets."""
    positions = [
        rules.advanced(state, t)[0, :2] for name, state in zip(rules.balls, states, strict=True) if name not in captured
    ]
    moving = [
        math.hypot(*state[1, :2]) > 0.0 for name, state in zip(rules.balls, states, strict=True) if name not in captured
    ]
    depth = 0.0
    for i, a in enumerate(positions):
        for b in positions[i + 1 :]:
            depth = max(depth, 2.0 * rules.radius - math.dist(a, b))
        if moving[i]:
            for fixed in (*rules.walls.values(), *rules.posts.values()):
                depth = max(depth, rules.radius + fixed.get("radius", 0.0) - math.dist(a, rules.nearest(fixed, a)))
            for pocket in rules.pockets.values():
                depth = max(depth, pocket["radius"] - math.dist(a, pocket["position"]))
    return depth
