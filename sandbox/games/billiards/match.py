"""Match: a game on a table, as a frozen value: rules, turn, score, and where every ball lies.

Needs: what a table must have for a game.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Self

import numpy as np

from sandbox.action import Move, Strike
from sandbox.arrays import FloatArray
from sandbox.games.billiards.placement import nearest, placement_refusal, spread
from sandbox.games.billiards.referee import (
    collision_free_moves,
    rerack_moves,
    respot_moves,
    shot_events,
    situation_of,
    touching_pairs,
)
from sandbox.games.billiards.rules.base import (
    Decision,
    GameError,
    Ruleset,
    RulesState,
    ShotCall,
    ShotChoices,
    ShotEvent,
    ShotResult,
    Situation,
)
from sandbox.games.billiards.rules.registry import ruleset_named
from sandbox.games.billiards.table_geometry import TOUCH, PlacedDisc, TableGeometry
from sandbox.scene.description.base import Point
from sandbox.scene.description.surface import Stroke
from sandbox.scene.scene import Scene
from sandbox.trajectory import Contacts

SPOTS = {"8-ball": ("head", "foot"), "9-ball": ("head", "foot"), "carom": ("head", "centre", "foot")}
"""What a table needs for a rack; for snooker, the colours' own."""

COLOURS = ("yellow", "green", "brown", "blue", "pink", "black")


def require_suitable_table(layout: TableGeometry, rules: Ruleset[Any], state: RulesState) -> None:
    """Refuse a table on which a game cannot be played.

    Raises:
        GameError: with all that is wrong.
    """
    wanted = {*state.table, *(rules.cue_balls if rules.name != "free" else (rules.cue_ball(state),))}
    missing, idle = sorted(wanted - set(layout.names)), sorted(set(layout.names) - wanted)
    spots = [name for name in SPOTS.get(rules.rack, COLOURS) if name not in layout.spots and rules.name != "free"]
    wrong = [
        *([f"no ball {', '.join(missing)}"] if missing else []),
        *([f"the game does not use {', '.join(idle)}"] if idle else []),
        *([f"no spot {', '.join(spots)}; state a [[play.spot]]"] if spots else []),
        *(["it is no billiard table, as it has no [surface]"] if layout.scene.surface is None else []),
        *(["no pockets"] if not layout.pockets and rules.name in ("8-ball", "9-ball", "snooker") else []),
        *(["carom has no pockets"] if layout.pockets and rules.rack == "carom" else []),
    ]
    if wrong:
        raise GameError(f"{rules.name} cannot be played on this table: {'; '.join(wrong)}")


@dataclass(frozen=True)
class Match:
    """A frame of a game on a table, between shots.

    What a method leads to is another match; `moves` tells what that asks for at the table.
    """

    layout: TableGeometry = field(repr=False, compare=False)
    rules: Ruleset[Any] = field(repr=False)
    state: RulesState
    position: tuple[Point, ...] = field(repr=False)
    """of every body, by number, m; a ball that is down lies in its pocket"""
    before: tuple[Point, ...] | None = field(default=None, repr=False)
    """the positions before the last shot, to which a miss can be taken back"""
    shots: int = 0
    """how many were played"""
    verdict: ShotResult[Any] | None = field(default=None, repr=False, compare=False)
    """of what led here: fouls, points, messages"""

    @classmethod
    def begin(cls, scene: Scene, game: str | None = None, players: int = 2, **terms: Any) -> Self:
        """Return the match with which a frame begins, all balls where the scene has them.

        Args:
            scene: a table with its balls; its own shots are left out.
            game: by name; without one, the scene's own.
            players: 1 or 2.
            terms: what else the game's `start` takes: `distance` of carom, `misses` of snooker.

        Raises:
            GameError: there is no such game, or it cannot be played on this table.
        """
        rules, layout = ruleset_named(game or scene.play.game or "free"), TableGeometry.of(scene)
        if rules.name == "free" and "balls" not in terms and layout.names:
            cue = "cue" if "cue" in layout.number else layout.names[0]
            terms = {"cue": cue, "balls": tuple(name for name in layout.names if name != cue), **terms}
        try:
            state = rules.start(players, **terms)
        except TypeError:
            raise GameError(f"{rules.name} takes no {', '.join(terms)}") from None
        require_suitable_table(layout, rules, state)
        return cls(layout, rules, state, layout.start)._in_hand()

    @property
    def scene(self) -> Scene:
        """The table, without shots of its own: what a session starts from."""
        return self.layout.scene

    @property
    def cue(self) -> str:
        """The ball that is struck next."""
        return self.rules.cue_ball(self.state)

    @property
    def turn(self) -> int:
        """The player to shoot, from 0."""
        return self.state.turn

    @property
    def over(self) -> bool:
        """Whether the frame has ended."""
        return self.state.over

    @property
    def targets(self) -> frozenset[str]:
        """The balls that the cue ball may touch first."""
        return self.rules.legal_targets(self.state)

    @property
    def choices(self) -> ShotChoices:
        """What may be decided and called before the next shot."""
        return self.rules.choices(self.state)

    @property
    def messages(self) -> tuple[str, ...]:
        """Lines for the players on what led here."""
        return () if self.verdict is None else self.verdict.messages

    @property
    def on_table(self) -> dict[str, PlacedDisc]:
        """The balls that are not down, the cue ball too."""
        here = {*self.state.table, self.cue}
        return {
            name: (*self.position[k], self.layout.radius[k]) for name, k in self.layout.number.items() if name in here
        }

    def refusal(self, at: Point) -> str | None:
        """Return why the cue ball may not be put somewhere, m; None where it may."""
        if self.state.in_hand is None:
            return "the cue ball is not in hand"
        return placement_refusal(self.layout, self.state.in_hand, at, self._cue_radius, self._others)

    def nearest(self, at: Point) -> Point:
        """Return the place nearest to a point, m, where the cue ball may be put.

        Raises:
            GameError: it is not in hand, or there is no room.
        """
        if self.state.in_hand is None:
            raise GameError("the cue ball is not in hand")
        place = nearest(self.layout, self.state.in_hand, at, self._cue_radius, self._others)
        if place is None:
            raise GameError(f"there is no room for the {self.cue} {self.state.in_hand}")
        return place

    def place(self, at: Point) -> Self:
        """Return the match with the cue ball, which is in hand, put somewhere.

        Raises:
            GameError: it may not be put there; the text says why.
        """
        why = self.refusal(at)
        if why is not None:
            raise GameError(why)
        return replace(self, position=self._with({self.cue: at}), verdict=None)

    def decide(self, decision: Decision) -> Self:
        """Return what a decision leads to.

        Raises:
            GameError: it is not to be had now.
        """
        return self._done(self.rules.decide(self.state, decision))

    def strike(self, stroke: Stroke, time: float = 0.0) -> Strike:
        """Return the action that plays a stroke at a time, s.

        Raises:
            GameError: the frame is over.
        """
        if self.over:
            raise GameError("the frame is over")
        return Strike(time=time, ball=self.cue, **stroke.model_dump(exclude_defaults=True))

    def happenings(self, contacts: Contacts, began: float = 0.0) -> tuple[ShotEvent, ...]:
        """Return what the rules see of a shot from here, of its contacts, from any engine, and when it began, s."""
        return shot_events(self.layout, contacts, began, self.against, self.cue)

    def played(
        self, contacts: Contacts, position: FloatArray, call: ShotCall | None = None, began: float = 0.0
    ) -> Self:
        """Return what a shot has led to, once every ball is at rest.

        Args:
            contacts: of the shot, from any engine.
            position: (N, 2) m, where the bodies have come to rest.
            call: what was said before it.
            began: the time of the stroke, s.

        Raises:
            GameError: the frame is over, or the call could not be made.
        """
        happenings, stayed = self.happenings(contacts, began), self._stayed_behind(contacts, began)
        verdict = self.rules.judge(self.state, call or ShotCall(), happenings, stayed)
        rest = tuple((x, y) for x, y in position.tolist())
        after = replace(self, position=rest, before=self.position, shots=self.shots + 1)
        return after._done(verdict)

    def moves(self, position: FloatArray, time: float = 0.0) -> tuple[Move, ...]:
        """Return the actions that put the balls where this match has them.

        So a shot is taken back too: by those of the match before it. In their order no ball is put onto another.

        Args:
            position: (N, 2) m, where the bodies are now.
            time: of the actions, s.
        """
        now = [(x, y) for x, y in position.tolist()]
        return tuple(
            Move(time=time, body=self.layout.names[k], position=at, velocity=(0.0, 0.0))
            for k, at in collision_free_moves(self.layout, now, self.position)
        )

    def document(self) -> dict[str, Any]:
        """Return the match as a JSON object, without its scene."""
        return {
            "game": self.rules.name,
            "state": self.rules.document(self.state),
            "position": [list(each) for each in self.position],
            "before": None if self.before is None else [list(each) for each in self.before],
            "shots": self.shots,
        }

    @classmethod
    def restored(cls, scene: Scene, plain: dict[str, Any]) -> Self:
        """Return the match of a JSON object on its scene, the inverse of `document`.

        Raises:
            GameError: it is none.
        """
        try:
            rules, layout = ruleset_named(plain["game"]), TableGeometry.of(scene)
            state = rules.restored(plain["state"])
            position, before, shots = plain["position"], plain["before"], int(plain["shots"])
            placed = _points(position, layout)
            return cls(layout, rules, state, placed, None if before is None else _points(before, layout), shots)
        except (KeyError, TypeError, ValueError) as error:
            raise GameError(f"not a match of this scene: {error}") from None

    @cached_property
    def against(self) -> frozenset[tuple[int, int]]:
        """What touches before the shot, as pairs of numbers: looked for once for all the shots that are tried."""
        return touching_pairs(self.layout, self.position)

    @property
    def _cue_radius(self) -> float:
        return self.layout.radius[self.layout.number[self.cue]]

    @property
    def _others(self) -> list[PlacedDisc]:
        cue = self.cue
        return [disc for name, disc in self.on_table.items() if name != cue]

    def _stayed_behind(self, contacts: Contacts, began: float) -> bool:
        """Return whether a cue ball in hand behind the head string first touched a ball there without leaving.

        A ball on the head string is not behind it. A cue ball rolls straight, or nearly so: it can leave and come back
        only from a cushion beyond the head string.
        """
        if self.state.in_hand != "behind the head string":
            return False
        cue, layout, first = self.layout.number[self.cue], self.layout, None
        for k in np.argsort(contacts.time, kind="stable").tolist():
            time, (a, b) = float(contacts.time[k]), contacts.pair[k].tolist()
            if time < began or cue not in (a, b):
                continue
            if first is not None and time > first:
                break
            if b >= 0:
                first = time
                if layout.before_head(self.position[b if a == cue else a]) >= -TOUCH:
                    return False
            elif first is None and layout.before_head(contacts.point[k].tolist()) > 0.0:
                return False
        return first is not None

    def _with(self, places: dict[str, Point]) -> tuple[Point, ...]:
        """Return the positions with some balls elsewhere."""
        position = list(self.position)
        for name, at in places.items():
            position[self.layout.number[name]] = at
        return tuple(position)

    def _done(self, verdict: ShotResult[Any]) -> Self:
        """Return the match once all is done at the table that a verdict asks for, and the lie is looked at."""
        position = self.position
        if verdict.rerack:
            position = rerack_moves(self.layout, self.rules, verdict.state)
        elif verdict.restore and self.before is not None:
            position = self.before
        after = replace(self, state=verdict.state, position=position)
        if verdict.respot:
            here = [after.layout.number[name] for name in after.on_table]
            after = replace(after, position=respot_moves(after.layout, verdict.respot, position, here))
        after = after._in_hand()
        if after.over:
            return replace(after, verdict=verdict)
        settled = after.rules.settle(after.state, after._lie())
        return replace(after, state=settled.state, verdict=verdict.followed_by(settled))

    def _in_hand(self) -> Self:
        """Return the match with a cue ball in hand at the legal place nearest to where it is, or to the head spot."""
        if self.state.in_hand is None or self.over:
            return self
        at = self.position[self.layout.number[self.cue]]
        if self.refusal(at) is None:
            return self
        if self.layout.pocket_at(at) is not None:
            at = self.layout.start[self.layout.number[self.cue]]
        return replace(self, position=self._with({self.cue: self.nearest(at)}))

    def _lie(self) -> Situation:
        """Return how the balls lie for the one to shoot."""
        cue = self.cue
        others = {name: disc for name, disc in self.on_table.items() if name != cue}
        return situation_of(self._cues(), others, self.targets, self.state.in_hand is not None)

    def _cues(self) -> Iterator[PlacedDisc]:
        """Yield where the cue ball lies; where it is in hand, then also all over where it may be put."""
        radius, place = self._cue_radius, self.state.in_hand
        yield (*self.position[self.layout.number[self.cue]], radius)
        if place is not None:
            yield from ((x, y, radius) for x, y in spread(self.layout, place, radius, self._others))


def _points(plain: Any, layout: TableGeometry) -> tuple[Point, ...]:
    points = tuple((float(x), float(y)) for x, y in plain)
    if len(points) != len(layout.names):
        raise ValueError(f"expected {len(layout.names)} positions, one a body, but got {len(points)}")
    return points
