"""A second opinion on the oracle: its runs against formulas of our own, and against its own sensitivity.

Between two events every ball is moved on by the closed forms of sliding, rolling and spinning; each impact is worked
out again from the states before it; and in between nothing may overlap. All of it from the scene alone.
"""

import itertools
import math
from typing import Any, NamedTuple

import numpy as np

Document = dict[str, Any]
Array = np.ndarray

RESTING = 1e-9
"""m/s: less than that is no slip and no motion."""


class Event(NamedTuple):
    """An event: when, of what kind, of whom, and the states (N, 3, 3) of all balls before and after it."""

    time: float
    kind: str
    names: tuple[str, ...]
    before: Array
    after: Array


class Rules:
    """The physics of a scene, worked out again."""

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
        """Return the velocity (2,) of a ball's lowest point."""
        _, v, w = state
        return np.array([v[0] - self.radius * w[1], v[1] + self.radius * w[0]])

    def moved(self, state: Array, t: float) -> Array:
        """Return a ball's state (position, velocity, spin) a time later, through as many of its motions as it takes."""
        x, v, w = state[0, :2].copy(), state[1, :2].copy(), state[2].copy()
        g, r = self.floor["gravity"], self.radius
        fall = 5.0 * self.floor["spinning_friction"] * g / (2.0 * r) * t
        about_z = math.copysign(max(abs(w[2]) - fall, 0.0), w[2])
        u = self.slip(state)
        size = math.hypot(*u)
        if size > RESTING:
            grip = self.floor["sliding_friction"] * g
            lasts = min(t, 2.0 * size / (7.0 * grip))
            a = -grip * u / size
            x, v = x + v * lasts + a * lasts**2 / 2.0, v + a * lasts
            # ω̇ = (5/2R²)·(r × a) with r = −R·ẑ from the centre to the cloth
            w[:2] += 2.5 / r * np.array([a[1], -a[0]]) * lasts
            t -= lasts
        speed = math.hypot(*v)
        if t > 0.0 and speed > RESTING:
            drag = self.floor["rolling_friction"] * g
            lasts = min(t, speed / drag)
            a = -drag * v / speed
            x, v = x + v * lasts + a * lasts**2 / 2.0, v + a * lasts
            w[:2] = -v[1] / r, v[0] / r
        made = np.zeros((3, 3))
        made[0, :2], made[1, :2], made[2] = x, v, [w[0], w[1], about_z]
        return made

    def struck(self, event: Event) -> dict[str, Array]:
        """Return the states that an impact leaves, by name.

        Where it happens is taken as it is after it: bodies are first parted by a tiny distance, which turns normals.
        """
        states = event.before.copy()
        states[:, 0] = event.after[:, 0]
        if event.kind == "ball_ball":
            a, b = (states[self.balls.index(name)] for name in event.names)
            return dict(zip(event.names, self._met(a, b), strict=True))
        if event.kind == "cushion":
            name, what = event.names
            return {name: self._rebounded(states[self.balls.index(name)], what)}
        return {}

    def _met(self, a: Array, b: Array) -> tuple[Array, Array]:
        a, b = a.copy(), b.copy()
        n = (b[0] - a[0]) / np.linalg.norm(b[0] - a[0])
        approach = float((a[1] - b[1]) @ n)
        assert approach > 0.0, f"two balls part at {approach:g} m/s and yet collide"
        push = (1.0 + self.restitution) / 2.0 * approach
        rub = np.zeros(3)
        if self.models["ball_ball"] == "frictional":
            along = a[1] - b[1] - approach * n
            u = along + self.radius * np.cross(a[2] + b[2], n)
            size = float(np.linalg.norm(u))
            mu = 0.009951 + 0.108 * math.exp(-1.088 * size)
            if size > 0.0:
                rub = -u / size * min(mu * push, size / 7.0)
        for state, sign in ((a, 1.0), (b, -1.0)):
            state[1] += sign * (rub - push * n)
            state[1, 2] = 0.0
            state[2] += 2.5 / self.radius * np.cross(n, rub)
        return a, b

    def _rebounded(self, state: Array, what: str) -> Array:
        """Return a ball after a cushion, in the frame of the normal into it and the left of that."""
        state = state.copy()
        fixed = self.walls.get(what) or self.posts[what]
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

    def nearest(self, fixed: Document, at: Array) -> Array:
        """Return the point of a wall, or the centre of a post, that is nearest to a place."""
        if "position" in fixed:
            return np.array(fixed["position"])
        a, b = np.array(fixed["points"])
        share = np.clip(((at - a) @ (b - a)) / ((b - a) @ (b - a)), 0.0, 1.0)
        return a + share * (b - a)


class Verdict(NamedTuple):
    """By how much a run is off our formulas, at worst; spins count times the radius."""

    position: float
    """m"""
    velocity: float
    """m/s"""
    overlap: float
    """m"""
    parted: float
    """m, by which bodies that met were moved apart"""


def audit(document: Document, events: list[Event], looks: int = 40) -> Verdict:
    """Return by how much a run is off; `looks` is how often overlaps are sought between two events.

    Raises:
        AssertionError: bodies collide that part, or a captured ball has moved.
    """
    rules = Rules(document)
    place = velocity = overlap = parted = 0.0
    caught: dict[str, str] = {}
    for last, event in itertools.pairwise(events):
        span = event.time - last.time
        for number in range(len(rules.balls)):
            expected = rules.moved(last.after[number], span)
            off = np.abs(expected - event.before[number])
            place = max(place, float(off[0, :2].max()))
            velocity = max(velocity, float(off[1].max()), float(off[2].max()) * rules.radius)
        for share in np.linspace(0.0, 1.0, looks + 1)[1:-1] if span > 1e-9 else ():
            overlap = max(overlap, _overlap(rules, last.after, float(share) * span, caught))
        for name, expected in rules.struck(event).items():
            off = np.abs(expected - event.after[rules.balls.index(name)])
            velocity = max(velocity, float(off[1].max()), float(off[2].max()) * rules.radius)
            parted = max(parted, math.dist(expected[0], event.before[rules.balls.index(name), 0]))
        if event.kind == "pocket":
            name, pocket = event.names
            caught[name] = pocket
            rests = event.after[rules.balls.index(name)]
            assert not rests[1:].any() and rests[0, :2].tolist() == rules.pockets[pocket]["position"]
    return Verdict(place, velocity, overlap, parted)


def _overlap(rules: Rules, states: Array, t: float, caught: dict[str, str]) -> float:
    """Return the deepest overlap, m, of balls on the table with each other, walls, posts, or a pocket's circle."""
    at = [rules.moved(state, t)[0, :2] for name, state in zip(rules.balls, states, strict=True) if name not in caught]
    moving = [
        math.hypot(*state[1, :2]) > 0.0 for name, state in zip(rules.balls, states, strict=True) if name not in caught
    ]
    deep = 0.0
    for i, a in enumerate(at):
        for b in at[i + 1 :]:
            deep = max(deep, 2.0 * rules.radius - math.dist(a, b))
        if moving[i]:
            for fixed in (*rules.walls.values(), *rules.posts.values()):
                deep = max(deep, rules.radius + fixed.get("radius", 0.0) - math.dist(a, rules.nearest(fixed, a)))
            for pocket in rules.pockets.values():
                deep = max(deep, pocket["radius"] - math.dist(a, pocket["position"]))
    return deep
