"""Curling: the rules of a match, between the steps of a scene with sixteen stones on ice.

The scene has a [surface] of pucks, stones `red-1` to `red-8` and `yellow-1` to `yellow-8`, and a body `broom` that
meets nothing: it stands on the tee line where the skip holds it, and stones are let go towards it. A stone curls away
from that line, so the broom is held beside the place that is meant.

Not modelled: stones that are touched by people, time clocks, and the measuring of ends that are nearly even.

Score: how a match stands, end by end. The hammer, the last stone of an end, goes to the team that did not score.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

from sandbox.action import Action, Impulse, Move, SetParameter
from sandbox.games.contract import Control, StepInfo, UnsuitableSceneError
from sandbox.games.curling.bot import CurlingBot
from sandbox.games.curling.delivery import Delivery, Ice
from sandbox.games.curling.scene import CurlingMatch
from sandbox.games.curling.sheet import (
    PROTECTED,
    RELEASE,
    STONES,
    TEAMS,
    WIDTH,
    end_score,
    in_free_guard_zone,
    is_hogged,
    is_out_of_play,
    parked_position,
    removed_position,
    stone_name,
)
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.description.base import Point
from sandbox.scene.description.game_tables import table_of
from sandbox.scene.scene import Scene
from sandbox.trajectory import Frame


class CurlingScore(NamedTuple):
    """How a match stands."""

    ends: int
    """that are to be played; more where it is even then"""
    points: tuple[int, int] = (0, 0)
    played: int = 0
    """ends"""
    hammer: int = 1
    """the team that throws last in the present end"""
    thrown: int = 0
    """stones of the present end"""

    @property
    def team(self) -> int:
        """Whose turn it is: the team without the hammer begins."""
        return (1 - self.hammer + self.thrown) % 2

    @property
    def number(self) -> int:
        """Which of its stones that team throws, from 0."""
        return self.thrown // 2

    @property
    def full(self) -> bool:
        """Whether all stones of the end have been thrown."""
        return self.thrown == 2 * STONES

    @property
    def game_over(self) -> str | None:
        """Why the match is over; None while it goes on."""
        red, yellow = self.points
        if self.played < self.ends or red == yellow:
            return None
        return f"{TEAMS[yellow > red]} wins {max(red, yellow)} : {min(red, yellow)}"

    def after_stone(self) -> "CurlingScore":
        """Return the score after one more stone."""
        return self._replace(thrown=self.thrown + 1)

    def after_end(self, team: int | None, points: int) -> "CurlingScore":
        """Return the score after an end that a team has won, or nobody."""
        red, yellow = self.points
        total = (red + points * (team == 0), yellow + points * (team == 1))
        hammer = self.hammer if team is None else 1 - team
        return self._replace(points=total, played=self.played + 1, hammer=hammer, thrown=0)


BROOM = "broom"
SIDEWAYS, HARDER = 0.5, 2.5
"""m/s at which the broom moves, and at which the weight grows, while a key is held"""
WEIGHTS = -8.0, 14.0
"""m, the least and the most that a delivery is meant for, beyond the tee; the least stays short of the hog line"""
WIDEST = 0.5 * WIDTH - 0.2
"""m, how far the broom goes to either side"""
SWEPT, STRAIGHTER = 0.88, 0.6
"""Of the friction and of the curl, what sweeping leaves: figures of this game, for some 3 m more."""
PAUSE, THINKS = 1.5, 1.0
"""s between two stones, and that a team that plays by itself holds its broom before it delivers"""

CONTROLS = (
    Control("left", "move the broom left", ("left",), "left -leftx"),
    Control("right", "move the broom right", ("right",), "right +leftx"),
    Control("harder", "more weight", ("up",), "up -lefty"),
    Control("softer", "less weight", ("down",), "down +lefty"),
    Control("turn", "reverse the turn", ("t",), "y"),
    Control("throw", "release the stone", ("space",), "a"),
    Control("sweep", "sweep: the stone runs farther and straighter", ("s", "left shift"), "b rt"),
)


class Curling:
    """The rules of one match."""

    controls = CONTROLS

    def __init__(self, scene: Scene, bodies: Bodies) -> None:
        """Begin.

        Raises:
            UnfitError: the scene has no ice, or lacks stones or the broom.
        """
        floor, match = scene.surface, table_of(scene.play, CurlingMatch) or CurlingMatch()
        self._names = [stone_name(team, k) for team in (0, 1) for k in range(STONES)]
        lacking = [name for name in (*self._names, BROOM) if name not in bodies.names]
        if floor is None or floor.bodies != "pucks" or not floor.sliding_friction or lacking:
            raise UnsuitableSceneError(
                'curling needs a [surface] with bodies = "pucks" and a sliding_friction, the bodies red-1 … red-8 and '
                f"yellow-1 … yellow-8, and a {BROOM!r}" + (f"; missing: {', '.join(lacking)}" if lacking else "")
            )
        self._numbers = [bodies.names.index(name) for name in self._names]
        self._moment = [float(bodies.moment[number]) for number in self._numbers]
        self._floor, self._ice = floor, Ice.of(floor)
        self._teams = [CurlingBot(team, self._ice, match.error, scene.world.seed) for team in (0, 1)]
        self._people = match.people
        self._score = CurlingScore(match.ends)
        self._places: dict[int, Point] = {}  # of the stones that are in play, by their places in `_names`
        self._before: dict[int, Point] = {}  # as they lay before the last delivery
        self._hits: set[tuple[int, int]] = set()  # pairs of stones that met since the delivery
        self._deemed: set[int] = set()  # short of the hog line, but in the free guard zone by the rules
        self._running, self._ready = False, False
        self._broom, self._weight, self._turn = 0.0, 0.0, 1
        self._meant: Delivery | None = None
        self._held: set[str] = set()
        self._time, self._since = 0.0, -PAUSE
        self._frame: Frame | None = None
        self._told = ""
        self._cues: list[str] = []

    @property
    def score(self) -> int:
        """Of the red team where one person plays, else of the best."""
        red, yellow = self._score.points
        return red if self._people == 1 else max(red, yellow)

    @property
    def game_over(self) -> str | None:
        """Why the match is over; None while it goes on."""
        return self._score.game_over

    @property
    def _current(self) -> int:
        """The stone whose turn it is."""
        return self._score.team * STONES + self._score.number

    @property
    def _by_itself(self) -> bool:
        return self._score.team >= self._people

    def on_input(self, control: str, value: float) -> Sequence[Action]:
        """Press or let go a control; a team that plays by itself cannot be helped."""
        (self._held.add if value > 0.0 else self._held.discard)(control)
        if control == "sweep":
            return self._sweep(value > 0.0) if self._running and not self._by_itself else ()
        if value <= 0.0 or not self._ready or self._by_itself:
            return ()
        if control == "turn":
            self._turn = -self._turn
        if control == "throw":
            heading = math.atan2(self._broom, -RELEASE)
            speed = self._ice.speed_for(self._weight - RELEASE)
            return self._let_go(Delivery(speed, heading, self._turn))
        return ()

    def on_step(self, info: StepInfo) -> Sequence[Action]:
        """Follow the stones, take out what is out of play, count ends, and bring the next stone."""
        elapsed, self._time, self._frame = info.time - self._time, info.time, info.frame
        if self._running:
            return self._follow(info, elapsed)
        if not self._ready:
            return self._next(info) if info.time - self._since >= PAUSE else ()
        if not self._by_itself:
            return self._aim(elapsed)
        if self._meant is None:
            return self._choose()
        return self._let_go(self._meant) if info.time - self._since >= THINKS else ()

    def _next(self, info: StepInfo) -> Sequence[Action]:
        """Bring the next stone to where it is let go; at the beginning of an end, all others to where they wait."""
        moves: list[Action] = []
        if self._score.thrown == 0:
            self._places, self._deemed = {}, set()
            moves = [self._put(k, parked_position(*divmod(k, STONES))) for k in range(2 * STONES)]
        moves.append(self._put(self._current, (RELEASE, 0.0)))
        self._ready, self._meant, self._since, self._weight = True, None, info.time, 0.0
        self._cues.append("next")
        return (*moves, self._hold(0.0))

    def _aim(self, elapsed: float) -> Sequence[Action]:
        """Move broom and weight as long as their keys are held."""
        held = self._held
        self._weight += HARDER * elapsed * (("harder" in held) - ("softer" in held))
        self._weight = min(max(self._weight, WEIGHTS[0]), WEIGHTS[1])
        aside = ("left" in held) - ("right" in held)
        return (self._hold(self._broom + SIDEWAYS * elapsed * aside),) if aside else ()

    def _choose(self) -> Sequence[Action]:
        """Let a team that plays by itself choose, and show its broom."""
        stones = [(k // STONES, place) for k, place in self._places.items()]
        last = self._score.hammer == self._score.team
        self._meant = self._teams[self._score.team].delivery(stones, self._score.thrown, last)
        self._turn = self._meant.turn
        self._weight = self._meant.speed**2 / self._ice.speed_for(1.0) ** 2 + RELEASE
        return (self._hold(-RELEASE * math.tan(self._meant.heading)),)

    def _let_go(self, delivery: Delivery) -> Sequence[Action]:
        assert self._frame is not None
        name, moment = self._names[self._current], self._moment[self._current]
        spin = delivery.spin - float(self._frame.angular_velocity[self._numbers[self._current]])
        self._before = dict(self._places)
        self._places[self._current] = (RELEASE, 0.0)
        self._running, self._ready, self._told = True, False, ""
        self._hits.clear()
        self._cues.append("throw")
        sweeps = self._sweep(True) if "sweep" in self._held and not self._by_itself else ()
        return (
            Move(time=0.0, body=name, position=(RELEASE, 0.0), velocity=delivery.velocity),
            Impulse(time=0.0, body=name, impulse=(0.0, 0.0), angular=moment * spin),
            *sweeps,
        )

    def _follow(self, info: StepInfo, elapsed: float) -> Sequence[Action]:
        """See where the stones are, take out who leaves, and judge the shot once all rest."""
        frame, moves = info.frame, list[Action]()
        self._hear(info, elapsed)
        for k in tuple(self._places):
            x, y = frame.position[self._numbers[k]].tolist()
            self._places[k] = (x, y)
            if is_out_of_play((x, y)):
                del self._places[k]
                moves.append(self._put(k, removed_position(*divmod(k, STONES))))
                self._cues.append("gone")
        moving = [k for k in self._places if frame.velocity[self._numbers[k]].any()]
        return moves if moving else [*moves, *self._judge(info)]

    def _hear(self, info: StepInfo, elapsed: float) -> None:
        """Note which stones have struck each other."""
        stones = {number: k for k, number in enumerate(self._numbers)}
        pairs = info.contacts.pair[info.contacts.time > self._time - elapsed].tolist()  # others only touch on
        new = {(stones[a], stones[b]) for a, b in pairs if a in stones and b in stones}
        if new:
            self._hits |= new
            self._cues.append("hit")

    def _judge(self, info: StepInfo) -> Sequence[Action]:
        """Judge a shot that has come to rest: hog line, free guard zone; and the end, where that was its last."""
        moves: list[Action] = []
        current, places = self._current, self._places
        if current in places and is_hogged(places[current]) and not self._hits:
            del places[current]
            moves.append(self._put(current, removed_position(*divmod(current, STONES))))
            self._told = "stone removed: short of the hog line"
        zone = {k for k, place in self._before.items() if in_free_guard_zone(place)} | self._deemed
        theirs = [k for k in zone if k // STONES != self._score.team]
        if self._score.thrown < PROTECTED and any(k not in places for k in theirs):
            moves += [self._put(k, place) for k, place in self._before.items()]
            moves.append(self._put(current, removed_position(*divmod(current, STONES))))
            self._places = dict(self._before)
            self._told = "free guard zone: stones replaced"
        else:
            met = {k for pair in self._hits if not zone.isdisjoint(pair) for k in pair}
            self._deemed = {k for k in met | self._deemed if k in places and is_hogged(places[k])}
        if "sweep" in self._held:
            moves += self._sweep(False)
        self._running, self._since = False, info.time
        self._score = self._score.after_stone()
        if self._score.full:
            self._count()
        return moves

    def _count(self) -> None:
        team, points = end_score([(k // STONES, place) for k, place in self._places.items()])
        self._score = self._score.after_end(team, points)
        self._told = "blank end" if team is None else f"{TEAMS[team]} scores {points}"
        self._cues.append("score" if points else "blank")
        if self._score.game_over is not None:
            self._cues.append("win" if self._people != 1 or self._score.points[0] > self._score.points[1] else "lose")

    def _sweep(self, on: bool) -> Sequence[Action]:
        """Return what sweeping does to the ice, or that it is as it was."""
        friction, curl = self._floor.sliding_friction, self._floor.curl
        values = {"sliding_friction": friction * (SWEPT if on else 1.0), "curl": curl * (STRAIGHTER if on else 1.0)}
        if not curl:
            del values["curl"]
        return [SetParameter(time=0.0, path=f"surface.{key}", value=value) for key, value in values.items()]

    def _put(self, k: int, place: Point) -> Move:
        return Move(time=0.0, body=self._names[k], position=place, velocity=(0.0, 0.0))

    def _hold(self, aside: float) -> Move:
        """Hold the broom at a place on the tee line, m to the left."""
        self._broom = min(max(aside, -WIDEST), WIDEST)
        return Move(time=0.0, body=BROOM, position=(0.0, self._broom))

    def display_lines(self) -> Sequence[tuple[str, str]]:
        """Return the score, the end, whose turn it is and how it aims."""
        score = self._score
        red, yellow = score.points
        end = f"{min(score.played + 1, max(score.ends, score.played))} of {score.ends}"
        if score.played >= score.ends and score.game_over is None:
            end = "extra"
        shown = [("red : yellow", f"{red} : {yellow}"), ("end", end)]
        if score.game_over is None:
            shown += [
                (f"{TEAMS[score.team]} throws", f"stone {score.number + 1} of {STONES}"),
                ("weight", _weight(self._weight)),
                ("curls", "left" if self._turn > 0 else "right"),
            ]
        return [*shown, ("", self._told)] if self._told else shown

    def observation(self) -> Sequence[tuple[str, float]]:
        """Return how the stone is aimed, m, whether a person is to let it go, and how the match stands."""
        score = self._score
        return (
            ("broom", self._broom),
            ("weight", self._weight),
            ("turn", self._turn),
            ("may throw", self._ready and not self._by_itself),
            ("stones run", self._running),
            ("team", score.team),
            ("hammer", score.hammer),
            ("thrown", score.thrown),
            ("ends played", score.played),
            *zip((f"{team} points" for team in TEAMS), score.points, strict=True),
        )

    def sounds(self) -> Sequence[str]:
        """Return the names of the sounds since the last call."""
        cues, self._cues = self._cues, []
        return cues


def _weight(beyond_tee: float) -> str:
    if beyond_tee < -1.9:
        return f"guard, {-beyond_tee:.1f} m short of the tee"
    if beyond_tee <= 1.9:
        return f"draw, tee {beyond_tee:+.1f} m"
    return f"take-out, {beyond_tee:.1f} m past the tee"
