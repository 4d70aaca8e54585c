"""Landing: a ship comes down on a pad, upright and slowly, with as much left in its tank as can be.

The scene has a body `ship`, a fixed thing `pad`, and thrusts on the ship with keys: those are the controls. Where the
ship begins, and how fast, is drawn from the scene's seed. A thrust takes from the tank what it gives, its impulse;
with nothing left, all engines stop. The game ends as the ship stands on the pad, hits it too hard or anything else at
all, leaves the scene's bounds, or falls over on the pad.
"""

import math
from collections.abc import Sequence

import numpy as np

from sandbox.action import Action, Move, Throttle
from sandbox.games.contract import Control, StepInfo, UnsuitableSceneError
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.description.base import Point
from sandbox.scene.description.fixed import Plane, Post, Wall
from sandbox.scene.description.forces import Thrust
from sandbox.scene.description.scene import default_name
from sandbox.scene.geometry.shapes import form_of
from sandbox.scene.random_streams import Stream, draws
from sandbox.scene.scene import Scene
from sandbox.trajectory import Frame

SHIP, PAD = "ship", "pad"
LANDED = "landed"
TANK = 45.0
"""N·s per kg of ship: the speed, m/s, that a full tank would give it in empty space"""
DOWN, ASIDE, TILT = 2.0, 1.0, math.radians(15.0)
"""m/s, m/s and rad: the most at the first touch that is no crash"""
STILL, STANDING = 0.05, 1.0
"""m/s, below which it stands, and s, for how long it has to"""
FALLEN = math.radians(45.0)
"""rad, of tilt on the pad from which nothing stands up again"""
FOR_LANDING, FOR_FUEL = 100, 900
"""points: for landing at all, and for a full tank"""
FOR_A_CRASH, FAR, FAST = 50, 50.0, 15.0
"""points for a crash on the pad at no speed; there are none so far from its middle, m, nor so fast, m/s"""
ELSEWHERE, FASTER = 18.0, 3.0
"""m and m/s, to either side: by how much more or less than in the scene a game begins aside, by its seed"""
PADS = {"up": "a rt up", "left": "left -leftx", "right": "right +leftx"}
"""what of a gamepad goes with a thrust's key"""


class Landing:
    """The rules of one landing."""

    def __init__(self, scene: Scene, bodies: Bodies) -> None:
        """Begin.

        Raises:
            UnsuitableSceneError: the scene has no ship, no pad or no engine.
        """
        self._thrusts = {
            thrust.name or default_name("thrust", k): thrust
            for k, thrust in enumerate(scene.thrusts)
            if thrust.body == SHIP and thrust.key is not None
        }
        if SHIP not in bodies.names or PAD not in scene.fixed_names or not self._thrusts:
            raise UnsuitableSceneError(
                f"landing needs a body {SHIP!r}, a fixed element {PAD!r}, and a thrust on the ship that has a key"
            )
        self.controls = tuple(_control(name, thrust) for name, thrust in self._thrusts.items())
        self.score = 0
        self.game_over: str | None = None
        self._ship, self._pad = bodies.names.index(SHIP), -1 - scene.fixed_names.index(PAD)
        self._place, self._solid = _place(scene), len(scene.fixed)
        form = form_of(bodies.elements[int(bodies.element[self._ship])])
        self._corners = [(x, y, piece.radius) for piece in form.pieces for x, y in piece.corners]
        self._tank = self._full = TANK * float(bodies.mass[self._ship])
        self._levels = dict.fromkeys(self._thrusts, 0.0)
        self._start = _start(scene, bodies, self._ship)
        self._time, self._still = 0.0, 0.0
        self._before: Frame | None = None
        self._now: Frame | None = None
        self._cues: list[str] = []
        self._touched = False

    def on_input(self, control: str, value: float) -> Sequence[Action]:
        """Open a thrust by so much, as long as there is anything in the tank."""
        return (Throttle(time=0.0, thrust=control, level=min(value, 1.0)),) if self._tank > 0.0 else ()

    def on_step(self, info: StepInfo) -> Sequence[Action]:
        """Count what was burnt, and see whether the ship has come down, and how."""
        if self._now is None:
            self._now = info.frame
            return (self._start,)
        self._before, self._now = self._now, info.frame
        elapsed, self._time = info.time - self._time, info.time
        stopped = self._burn(info, elapsed)
        self.game_over = self._ended(info, elapsed)
        if self.game_over is not None:
            self.score = self.score or self._consolation()
            self._cues.append("win" if self.game_over == LANDED else "lose")
            return tuple(Throttle(time=0.0, thrust=name, level=0.0) for name, level in self._levels.items() if level)
        return stopped

    def _burn(self, info: StepInfo, elapsed: float) -> Sequence[Action]:
        """Take from the tank what the engines gave; close them as it runs dry."""
        for action in info.actions:
            if isinstance(action, Throttle) and action.thrust in self._levels:
                self._levels[action.thrust] = action.level
        burnt = math.fsum(level * math.hypot(*self._thrusts[name].force) for name, level in self._levels.items())
        had, self._tank = self._tank, max(self._tank - burnt * elapsed, 0.0)
        if self._tank > 0.0 or had == 0.0:
            return ()
        self._cues.append("empty")
        opened = [name for name, level in self._levels.items() if level > 0.0]
        self._levels = dict.fromkeys(self._levels, 0.0)
        return tuple(Throttle(time=0.0, thrust=name, level=0.0) for name in opened)

    def _ended(self, info: StepInfo, elapsed: float) -> str | None:
        """Return why the game is over now, and set the score; None where it goes on."""
        frame, ship = info.frame, self._ship
        if not frame.present[ship]:
            return "lost in space"
        touched = {int(pair[1]) if pair[0] == ship else int(pair[0]) for pair in info.contacts.pair if ship in pair}
        if any(number >= -self._solid for number in touched - {self._pad}):  # the others are no more than zones
            return "crashed outside the pad"
        if self._pad not in touched:
            self._still = 0.0
            return None
        first, self._touched = not self._touched, True
        if first:
            fault = self._hard()
            if fault is not None:
                return fault
            self._cues.append("touch")
        if abs(self._tilt(frame)) > FALLEN:
            return "tipped over"
        speed = float(np.hypot(*frame.velocity[ship]))
        self._still = self._still + elapsed if speed < STILL else 0.0
        if self._still < STANDING:
            return None
        self.score = FOR_LANDING + round(FOR_FUEL * self._tank / self._full)
        return LANDED

    def _hard(self) -> str | None:
        """Return why a first touch is a crash, by the state before it; None where it is none."""
        assert self._before is not None
        aside, up = self._before.velocity[self._ship].tolist()
        if -up > DOWN:
            return f"crashed: {-up:.1f} m/s down (limit {DOWN:g})"
        if abs(aside) > ASIDE:
            return f"crashed: {abs(aside):.1f} m/s sideways (limit {ASIDE:g})"
        tilt = abs(self._tilt(self._before))
        return (
            f"crashed: tilted by {math.degrees(tilt):.0f}° (limit {math.degrees(TILT):.0f}°)" if tilt > TILT else None
        )

    def _consolation(self) -> int:
        """Return the points of a crash: more where it was near and slow."""
        assert self._before is not None
        place, speed = self._before.position[self._ship], float(np.hypot(*self._before.velocity[self._ship]))
        near = max(1.0 - math.dist(place.tolist(), self._place) / FAR, 0.0)
        return round(FOR_A_CRASH * near * max(1.0 - speed / FAST, 0.0))

    def _tilt(self, frame: Frame) -> float:
        return math.remainder(float(frame.angle[self._ship]), math.tau)

    def display_lines(self) -> Sequence[tuple[str, str]]:
        """Return fuel, height and speeds; what would be a crash is marked."""
        fuel = ("fuel", f"{100.0 * self._tank / self._full:.0f} %")
        if self._now is None or not self._now.present[self._ship]:
            return (fuel,)
        aside, up = self._now.velocity[self._ship].tolist()
        tilt = self._tilt(self._now)
        return (
            fuel,
            ("height", f"{max(self._height(self._now), 0.0):.1f} m"),
            ("down", _marked(f"{0.0 - up:.1f} m/s", -up > DOWN)),
            ("sideways", _marked(f"{aside:+.1f} m/s", abs(aside) > ASIDE)),
            ("tilt", _marked(f"{-round(math.degrees(tilt)):+d}°", abs(tilt) > TILT)),
        )

    def observation(self) -> Sequence[tuple[str, float]]:
        """Return how full the tank is, 0 to 1."""
        return (("fuel", self._tank / self._full),)

    def _height(self, frame: Frame) -> float:
        """Return how far the lowest point of the ship is above the pad, m."""
        sine, cosine = math.sin(frame.angle[self._ship]), math.cos(frame.angle[self._ship])
        lowest = min(x * sine + y * cosine - radius for x, y, radius in self._corners)
        return float(frame.position[self._ship, 1]) + lowest - self._place[1]

    def sounds(self) -> Sequence[str]:
        """Return the names of the sounds since the last call."""
        cues, self._cues = self._cues, []
        return cues


def _control(name: str, thrust: Thrust) -> Control:
    assert thrust.key is not None
    return Control(name, name, (thrust.key,), PADS.get(thrust.key), analogue=True)


def _place(scene: Scene) -> Point:
    """Return the middle of the pad's top, m."""
    pad = dict(zip(scene.fixed_names, scene.fixed, strict=False)).get(PAD)  # pockets and zones come after
    match pad:
        case Wall():
            across, up = zip(*pad.points, strict=True)
            return 0.5 * (min(across) + max(across)), max(up) + 0.5 * pad.thickness
        case Post():
            return pad.position[0], pad.position[1] + pad.radius
        case Plane():
            return pad.point
    raise UnsuitableSceneError(f"landing needs a pad that is a plane, a wall or a post, called {PAD!r}")


def _start(scene: Scene, bodies: Bodies, ship: int) -> Move:
    """Return where the ship begins, as the scene's seed has it."""
    chance = draws(Stream.LANDING, scene.world.seed)
    (x, y), (vx, vy) = bodies.position[ship].tolist(), bodies.velocity[ship].tolist()
    x, vx = x + chance.uniform(-ELSEWHERE, ELSEWHERE), vx + chance.uniform(-FASTER, FASTER)
    return Move(time=0.0, body=SHIP, position=(x, y), velocity=(vx, vy))


def _marked(text: str, beyond: bool) -> str:
    return f"{text} !" if beyond else text
