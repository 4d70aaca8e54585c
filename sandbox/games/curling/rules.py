"""Rules of curling: a match on a scene with sixteen stones on ice.

The scene has a [surface] of pucks, the stones `red-1` to `red-8` and `yellow-1` to `yellow-8`, and a body `broom`
without collisions. A delivery is aimed at the broom, which is on the tee line. A stone curls away from the line of aim,
so the broom is placed beside the target.

The hammer, the last stone of an end, belongs to the team that did not score in the previous end; a blank end leaves it
unchanged. Weight is the distance past the tee, m, at which a stone would come to rest.

Not modelled: touched stones, time clocks, and the measurement of nearly equal distances.

Source: World Curling, The Rules of Curling, as in `sandbox.games.curling.sheet`.
"""

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from sandbox.action import Action, Impulse, Move, SetParameter
from sandbox.formatting import format_signed
from sandbox.games.contract import FLAG, Control, ObservationRange, StepInfo, UnsuitableSceneError, position_ranges
from sandbox.games.curling.bot import CurlingBot, Stones
from sandbox.games.curling.delivery import Delivery, Ice
from sandbox.games.curling.scene import CurlingMatch
from sandbox.games.curling.sheet import (
    LENGTH,
    PROTECTED,
    RELEASE,
    STONES,
    TEAMS,
    TEES,
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
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.base import Point
from sandbox.scene.description.game_tables import table_of
from sandbox.trajectory import Frame


class CurlingScore(NamedTuple):
    """Score of a match, by ends."""

    ends: int
    """number of ends of the match; a tie adds ends"""
    points: tuple[int, int] = (0, 0)
    played: int = 0
    """number of ends played"""
    hammer: int = 1
    """team that has the last stone of the present end"""
    thrown: int = 0
    """stones delivered in the present end"""

    @property
    def team(self) -> int:
        """Team that delivers next: the team without the hammer begins."""
        return (1 - self.hammer + self.thrown) % 2

    @property
    def number(self) -> int:
        """Index of the stone that the team delivers next."""
        return self.thrown // 2

    @property
    def full(self) -> bool:
        """Whether all stones of the end have been delivered."""
        return self.thrown == 2 * STONES

    @property
    def game_over(self) -> str | None:
        """Reason why the match is over; None while it runs."""
        red, yellow = self.points
        if self.played < self.ends or red == yellow:
            return None
        return f"{TEAMS[yellow > red]} wins {max(red, yellow)} : {min(red, yellow)}"

    def after_stone(self) -> "CurlingScore":
        """Return the score after one more stone."""
        return self._replace(thrown=self.thrown + 1)

    def after_end(self, team: int | None, points: int) -> "CurlingScore":
        """Return the score after an end; `team` is None for a blank end."""
        red, yellow = self.points
        total = (red + points * (team == 0), yellow + points * (team == 1))
        hammer = self.hammer if team is None else 1 - team
        return self._replace(points=total, played=self.played + 1, hammer=hammer, thrown=0)


BROOM = "broom"
SIDEWAYS, HARDER = 0.5, 2.5
"""m/s: speed of the broom, and rate of change of the weight, while a key is held"""
WEIGHT_LIMITS = -8.0, 14.0
"""m, bounds of the weight; the lower one is short of the hog line"""
MAX_BROOM_OFFSET = 0.5 * WIDTH - 0.2
"""m, bound of the distance of the broom from the centre line"""
SWEEP_FRICTION, SWEEP_CURL = 0.88, 0.6
"""factors of friction and curl on swept ice, chosen for this game: a swept stone travels about 3 m farther"""
PAUSE, BOT_PAUSE = 1.5, 1.0
"""s between two stones, and before a bot delivers"""

CONTROLS = (
    Control("left", "move the broom left", ("left",), "left -leftx"),
    Control("right", "move the broom right", ("right",), "right +leftx"),
    Control("harder", "more weight", ("up",), "up -lefty"),
    Control("softer", "less weight", ("down",), "down +lefty"),
    Control("turn", "reverse the turn", ("t",), "y"),
    Control("throw", "release the stone", ("space",), "a"),
    Control("sweep", "sweep: the stone runs farther and straighter", ("s", "left shift"), "b rt"),
)


class CurlingAim(NamedTuple):
    """Aim of a delivery, as the controls set it."""

    broom: float
    """m, position of the broom to the left of the centre line"""
    weight: float
    """m past the tee at which the stone would come to rest"""
    turn: int
    """as in `Delivery`"""

    def limited(self) -> "CurlingAim":
        """Return the nearest aim within the bounds of broom and weight."""
        broom = min(max(self.broom, -MAX_BROOM_OFFSET), MAX_BROOM_OFFSET)
        return self._replace(broom=broom, weight=min(max(self.weight, WEIGHT_LIMITS[0]), WEIGHT_LIMITS[1]))


def broom_offset(heading: float) -> float:
    """Return the position of a broom on the tee line, m to the left of the centre line, for a heading, rad."""
    return -RELEASE * math.tan(heading)


class Curling:
    """Rules of a match."""

    controls = CONTROLS

    def __init__(self, scene: Scene, bodies: Bodies) -> None:
        """Start a match.

        Raises:
            UnsuitableSceneError: the scene has no ice, or lacks stones or the broom.
        """
        floor, match = scene.surface, table_of(scene.play, CurlingMatch) or CurlingMatch()
        self._names = [stone_name(team, k) for team in (0, 1) for k in range(STONES)]
        lacking = [name for name in (*self._names, BROOM) if name not in bodies.names]
        if floor is None or floor.bodies != "pucks" or not floor.sliding_friction or lacking:
            raise UnsuitableSceneError(
                'curling needs a [surface] with bodies = "pucks" and a sliding_friction, the bodies red-1 … red-8 and '
                f"yellow-1 … yellow-8, and a {BROOM!r}" + (f"; missing: {', '.join(lacking)}" if lacking else "")
            )
        self._body_indices = [bodies.names.index(name) for name in self._names]
        self._moment = [float(bodies.moment[number]) for number in self._body_indices]
        self._floor, self._ice = floor, Ice.of(floor)
        self._teams = [CurlingBot(team, self._ice, match.error, scene.world.seed) for team in (0, 1)]
        self._human_teams = match.people
        self._score = CurlingScore(match.ends)
        self._places: dict[int, Point] = {}  # positions of stones in play, by index in `_names`
        self._before: dict[int, Point] = {}  # positions before the last delivery
        self._hits: set[tuple[int, int]] = set()  # pairs of stones that collided since the delivery
        self._counted_as_guards: set[int] = set()  # stones short of the hog line that count as in the free guard zone
        self._running, self._ready = False, False
        self._broom, self._weight, self._turn = 0.0, 0.0, 1
        self._bot_delivery: Delivery | None = None
        self._held_controls: set[str] = set()
        self._time, self._since = 0.0, -PAUSE
        self._frame: Frame | None = None
        self._message = ""
        self._cues: list[str] = []

    @property
    def score(self) -> int:
        """Points of the red team if only that team is played by a person, otherwise of the leading team."""
        red, yellow = self._score.points
        return red if self._human_teams == 1 else max(red, yellow)

    @property
    def player(self) -> str:
        """Team that delivers next."""
        return TEAMS[self._score.team]

    @property
    def scores(self) -> dict[str, int]:
        """Points of each team."""
        return dict(zip(TEAMS, self._score.points, strict=True))

    @property
    def bots(self) -> tuple[str, ...]:
        """Teams that the computer plays."""
        return TEAMS[self._human_teams :]

    @property
    def winner(self) -> str | None:
        """Team that has won; None while the match runs."""
        red, yellow = self._score.points
        return None if self._score.game_over is None else TEAMS[yellow > red]

    @property
    def game_over(self) -> str | None:
        """Reason why the match is over; None while it runs."""
        return self._score.game_over

    @property
    def _current(self) -> int:
        """Index of the stone to deliver."""
        return self._score.team * STONES + self._score.number

    @property
    def _is_bot_turn(self) -> bool:
        return self._score.team >= self._human_teams

    @property
    def present_score(self) -> CurlingScore:
        """The score of the match."""
        return self._score

    @property
    def ice(self) -> Ice:
        """Properties of the ice."""
        return self._ice

    @property
    def stones(self) -> Stones:
        """Team, and position, m, of each stone in play."""
        return [(k // STONES, position) for k, position in self._places.items()]

    @property
    def has_last_stone(self) -> bool:
        """Whether the team that delivers next has the hammer."""
        return self._score.hammer == self._score.team

    @property
    def aim(self) -> CurlingAim | None:
        """Present aim in the turn of a person; None while stones move, and in a turn of a bot."""
        if not self._ready or self._is_bot_turn:
            return None
        return CurlingAim(self._broom, self._weight, self._turn)

    def on_input(self, control: str, value: float) -> Sequence[Action]:
        """Return the actions of an input; it has no effect in a turn of a bot."""
        (self._held_controls.add if value > 0.0 else self._held_controls.discard)(control)
        if control == "sweep":
            return self._sweep(value > 0.0) if self._running and not self._is_bot_turn else ()
        if value <= 0.0 or not self._ready or self._is_bot_turn:
            return ()
        if control == "turn":
            self._turn = -self._turn
        if control == "throw":
            heading = math.atan2(self._broom, -RELEASE)
            speed = self._ice.speed_for(self._weight - RELEASE)
            return self._deliver(Delivery(speed, heading, self._turn))
        return ()

    def on_step(self, info: StepInfo) -> Sequence[Action]:
        """Track the stones, remove those out of play, score ends, and place the next stone."""
        elapsed, self._time, self._frame = info.time - self._time, info.time, info.frame
        if self._running:
            return self._track_stones(info, elapsed)
        if not self._ready:
            return self._place_next_stone(info) if info.time - self._since >= PAUSE else ()
        if not self._is_bot_turn:
            return self._update_aim(elapsed)
        if self._bot_delivery is None:
            return self._choose()
        return self._deliver(self._bot_delivery) if info.time - self._since >= BOT_PAUSE else ()

    def _place_next_stone(self, info: StepInfo) -> Sequence[Action]:
        """Place the next stone at its release point; at the start of an end, park all others."""
        moves: list[Action] = []
        if self._score.thrown == 0:
            self._places, self._counted_as_guards = {}, set()
            moves = [self._place_stone(k, parked_position(*divmod(k, STONES))) for k in range(2 * STONES)]
        moves.append(self._place_stone(self._current, (RELEASE, 0.0)))
        self._ready, self._bot_delivery, self._since, self._weight = True, None, info.time, 0.0
        self._cues.append("next")
        return (*moves, self._move_broom(0.0))

    def _update_aim(self, elapsed: float) -> Sequence[Action]:
        """Move broom and weight while their keys are held."""
        held = self._held_controls
        self._weight += HARDER * elapsed * (("harder" in held) - ("softer" in held))
        self._weight = min(max(self._weight, WEIGHT_LIMITS[0]), WEIGHT_LIMITS[1])
        aside = ("left" in held) - ("right" in held)
        return (self._move_broom(self._broom + SIDEWAYS * elapsed * aside),) if aside else ()

    def _choose(self) -> Sequence[Action]:
        """Choose the delivery of a bot, and place its broom."""
        self._bot_delivery = self._teams[self._score.team].delivery(
            self.stones, self._score.thrown, self.has_last_stone
        )
        self._turn = self._bot_delivery.turn
        self._weight = self._ice.distance_for(self._bot_delivery.speed) + RELEASE
        return (self._move_broom(broom_offset(self._bot_delivery.heading)),)

    def _deliver(self, delivery: Delivery) -> Sequence[Action]:
        assert self._frame is not None
        name, moment = self._names[self._current], self._moment[self._current]
        spin = delivery.spin - float(self._frame.angular_velocity[self._body_indices[self._current]])
        self._before = dict(self._places)
        self._places[self._current] = (RELEASE, 0.0)
        self._running, self._ready, self._message = True, False, ""
        self._hits.clear()
        self._cues.append("throw")
        sweeps = self._sweep(True) if "sweep" in self._held_controls and not self._is_bot_turn else ()
        return (
            Move(time=0.0, body=name, position=(RELEASE, 0.0), velocity=delivery.velocity),
            Impulse(time=0.0, body=name, impulse=(0.0, 0.0), angular=moment * spin),
            *sweeps,
        )

    def _track_stones(self, info: StepInfo, elapsed: float) -> Sequence[Action]:
        """Update the positions, remove stones that leave play, and judge the shot once all stones are at rest."""
        frame, moves = info.frame, list[Action]()
        self._record_hits(info, elapsed)
        for k in tuple(self._places):
            x, y = frame.position[self._body_indices[k]].tolist()
            self._places[k] = (x, y)
            if is_out_of_play((x, y)):
                del self._places[k]
                moves.append(self._place_stone(k, removed_position(*divmod(k, STONES))))
                self._cues.append("gone")
        moving = [k for k in self._places if frame.velocity[self._body_indices[k]].any()]
        return moves if moving else [*moves, *self._judge(info)]

    def _record_hits(self, info: StepInfo, elapsed: float) -> None:
        """Record collisions between stones."""
        stones = {number: k for k, number in enumerate(self._body_indices)}
        pairs = info.contacts.pair[info.contacts.time > self._time - elapsed].tolist()  # older contacts persist
        new = {(stones[a], stones[b]) for a, b in pairs if a in stones and b in stones}
        if new:
            self._hits |= new
            self._cues.append("hit")

    def _judge(self, info: StepInfo) -> Sequence[Action]:
        """Apply hog line and free guard zone to a shot at rest; score the end after its last stone."""
        moves: list[Action] = []
        current, positions = self._current, self._places
        if current in positions and is_hogged(positions[current]) and not self._hits:
            del positions[current]
            moves.append(self._place_stone(current, removed_position(*divmod(current, STONES))))
            self._message = "stone removed: short of the hog line"
        zone = {k for k, position in self._before.items() if in_free_guard_zone(position)} | self._counted_as_guards
        opponents = [k for k in zone if k // STONES != self._score.team]
        if self._score.thrown < PROTECTED and any(k not in positions for k in opponents):
            moves += [self._place_stone(k, position) for k, position in self._before.items()]
            moves.append(self._place_stone(current, removed_position(*divmod(current, STONES))))
            self._places = dict(self._before)
            self._message = "free guard zone: stones replaced"
        else:
            hit_guards = {k for pair in self._hits if not zone.isdisjoint(pair) for k in pair}
            self._counted_as_guards = {
                k for k in hit_guards | self._counted_as_guards if k in positions and is_hogged(positions[k])
            }
        if "sweep" in self._held_controls:
            moves += self._sweep(False)
        self._running, self._since = False, info.time
        self._score = self._score.after_stone()
        if self._score.full:
            self._score_end()
        return moves

    def _score_end(self) -> None:
        team, points = end_score([(k // STONES, position) for k, position in self._places.items()])
        self._score = self._score.after_end(team, points)
        self._message = "blank end" if team is None else f"{TEAMS[team]} scores {points}"
        self._cues.append("score" if points else "blank")
        if self._score.game_over is not None:
            self._cues.append(
                "win" if self._human_teams != 1 or self._score.points[0] > self._score.points[1] else "lose"
            )

    def _sweep(self, on: bool) -> Sequence[Action]:
        """Return the actions that set friction and curl of swept ice, or reset them."""
        friction, curl = self._floor.sliding_friction, self._floor.curl
        values = {
            "sliding_friction": friction * (SWEEP_FRICTION if on else 1.0),
            "curl": curl * (SWEEP_CURL if on else 1.0),
        }
        if not curl:
            del values["curl"]
        return [SetParameter(time=0.0, path=f"surface.{key}", value=value) for key, value in values.items()]

    def _place_stone(self, k: int, position: Point) -> Move:
        return Move(time=0.0, body=self._names[k], position=position, velocity=(0.0, 0.0))

    def _move_broom(self, aside: float) -> Move:
        """Place the broom on the tee line, m to the left of the centre line."""
        self._broom = min(max(aside, -MAX_BROOM_OFFSET), MAX_BROOM_OFFSET)
        return Move(time=0.0, body=BROOM, position=(0.0, self._broom))

    def display_lines(self) -> Sequence[tuple[str, str]]:
        """Return score, end, turn and aim."""
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
        return [*shown, ("", self._message)] if self._message else shown

    def observation(self) -> Sequence[tuple[str, float]]:
        """Return aim, m, whether a person may deliver, and the score."""
        score = self._score
        return (
            ("broom", self._broom),
            ("weight", self._weight),
            ("turn", self._turn),
            ("may throw", self.aim is not None),
            ("stones run", self._running),
            ("team", score.team),
            ("hammer", score.hammer),
            ("thrown", score.thrown),
            ("ends played", score.played),
            *zip((f"{team} points" for team in TEAMS), score.points, strict=True),
        )

    def observation_ranges(self) -> Mapping[str, ObservationRange]:
        """Return the ranges of aim, turn and score, and of the positions of the stones."""
        beyond, aside = 0.5 * (LENGTH - TEES), parked_position(0, 0)[1]
        return {
            **position_ranges(self._names, (-TEES - beyond, -aside), (beyond, aside)),
            "broom": ObservationRange(-MAX_BROOM_OFFSET, MAX_BROOM_OFFSET, "m"),
            "weight": ObservationRange(*WEIGHT_LIMITS, "m"),
            "turn": ObservationRange(-1.0, 1.0),
            **dict.fromkeys(("may throw", "stones run", "team", "hammer"), FLAG),
            "thrown": ObservationRange(0.0, 2.0 * STONES),
            **dict.fromkeys(("ends played", *(f"{team} points" for team in TEAMS)), ObservationRange(0.0)),
        }

    def sounds(self) -> Sequence[str]:
        """Return the names of the sounds since the last call."""
        cues, self._cues = self._cues, []
        return cues


def _weight(beyond_tee: float) -> str:
    if beyond_tee < -1.9:
        return f"guard, {-beyond_tee:.1f} m short of the tee"
    if beyond_tee <= 1.9:
        return f"draw, tee {format_signed(beyond_tee, 1)} m"
    return f"take-out, {beyond_tee:.1f} m past the tee"
