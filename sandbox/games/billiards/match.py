"""Frame of billiards between two shots, as an immutable value: rules, turn, scores, positions.

`require_suitable_table` checks that a table has the balls, spots and pockets that a game needs.
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
    BallEvent,
    Decision,
    GameError,
    Ruleset,
    RulesState,
    Ruling,
    ShotCall,
    ShotChoices,
    Situation,
)
from sandbox.games.billiards.rules.registry import ruleset_named
from sandbox.games.billiards.table_geometry import MAX_TOUCH_GAP, PlacedDisc, TableGeometry
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.base import Point
from sandbox.scene.description.scene import first_sensor
from sandbox.scene.description.surface import Stroke
from sandbox.trajectory import Contacts

SPOTS = {"8-ball": ("head", "foot"), "9-ball": ("head", "foot"), "carom": ("head", "centre", "foot")}
"""Spots that a rack needs; snooker needs the spots of `COLOURS`."""

COLOURS = ("yellow", "green", "brown", "blue", "pink", "black")


def require_suitable_table(layout: TableGeometry, rules: Ruleset[Any], state: RulesState) -> None:
    """Check that a game can be played on a table.

    Raises:
        GameError: the table is not suitable; the message names every reason.
    """
    wanted = {*state.table, *(rules.cue_balls if rules.name != "free" else (rules.cue_ball(state),))}
    missing, idle = sorted(wanted - set(layout.names)), sorted(set(layout.names) - wanted)
    spots = [name for name in SPOTS.get(rules.rack, COLOURS) if name not in layout.spots and rules.name != "free"]
    faults = [
        *([f"no ball {', '.join(missing)}"] if missing else []),
        *([f"the game does not use {', '.join(idle)}"] if idle else []),
        *([f"no spot {', '.join(spots)}; state a [[play.spot]]"] if spots else []),
        *(["it is no billiard table, as it has no [surface]"] if layout.scene.surface is None else []),
        *(["no pockets"] if not layout.pockets and rules.name in ("8-ball", "9-ball", "snooker") else []),
        *(["carom has no pockets"] if layout.pockets and rules.rack == "carom" else []),
    ]
    if faults:
        raise GameError(f"{rules.name} cannot be played on this table: {'; '.join(faults)}")


@dataclass(frozen=True)
class Match:
    """A frame of a game on a table, between two shots.

    Methods return a new match; `moves` returns the actions that take the table to its state.
    """

    layout: TableGeometry = field(repr=False, compare=False)
    rules: Ruleset[Any] = field(repr=False)
    state: RulesState
    position: tuple[Point, ...] = field(repr=False)
    """position of every body, m; a pocketed ball is in its pocket"""
    before: tuple[Point, ...] | None = field(default=None, repr=False)
    """positions before the last shot, m, which can be restored after a miss in snooker"""
    shots: int = 0
    """number of shots played"""
    verdict: Ruling[Any] | None = field(default=None, repr=False, compare=False)
    """result of the last shot or decision: fouls, points, messages"""

    @classmethod
    def begin(cls, scene: Scene, game: str | None = None, players: int = 2, **terms: Any) -> Self:
        """Return the match at the start of a frame, with all balls where the scene has them.

        Args:
            scene: table with its balls; its shots are ignored.
            game: name of the game; default: the game of the scene.
            players: 1 or 2.
            terms: further arguments of the game's `start`: `distance` of carom, `misses` of snooker.

        Raises:
            GameError: the game does not exist, or it cannot be played on this table.
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
        """The scene without its shots, from which a session starts."""
        return self.layout.scene

    @property
    def cue(self) -> str:
        """The ball that is struck next."""
        return self.rules.cue_ball(self.state)

    @property
    def turn(self) -> int:
        """Index of the player to shoot."""
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
        """Decisions and calls that are possible before the next shot."""
        return self.rules.choices(self.state)

    @property
    def messages(self) -> tuple[str, ...]:
        """Messages about the last shot or decision."""
        return () if self.verdict is None else self.verdict.messages

    @property
    def on_table(self) -> dict[str, PlacedDisc]:
        """The balls that are not pocketed, with the cue ball."""
        on_table_names = {*self.state.table, self.cue}
        return {
            name: (*self.position[k], self.layout.radius[k])
            for name, k in self.layout.number.items()
            if name in on_table_names
        }

    def refusal(self, at: Point) -> str | None:
        """Return why the cue ball may not be placed at a point, m; None if it may."""
        if self.state.in_hand is None:
            return "the cue ball is not in hand"
        return placement_refusal(self.layout, self.state.in_hand, at, self._cue_radius, self._others)

    def nearest(self, at: Point) -> Point:
        """Return the allowed place of the cue ball that is nearest to a point, m.

        Raises:
            GameError: the cue ball is not in hand, or there is no room.
        """
        if self.state.in_hand is None:
            raise GameError("the cue ball is not in hand")
        place = nearest(self.layout, self.state.in_hand, at, self._cue_radius, self._others)
        if place is None:
            raise GameError(f"there is no room for the {self.cue} {self.state.in_hand}")
        return place

    def place(self, at: Point) -> Self:
        """Return the match with the cue ball, which is in hand, placed at a point, m.

        Raises:
            GameError: the place is not allowed; the message has the reason.
        """
        reason = self.refusal(at)
        if reason is not None:
            raise GameError(reason)
        return replace(self, position=self._with({self.cue: at}), verdict=None)

    def decide(self, decision: Decision) -> Self:
        """Return the match after a decision.

        Raises:
            GameError: the decision is not offered now.
        """
        return self._after_result(self.rules.decide(self.state, decision))

    def strike(self, stroke: Stroke, time: float = 0.0) -> Strike:
        """Return the action that plays a stroke at a time, s.

        Raises:
            GameError: the frame is over.
        """
        if self.over:
            raise GameError("the frame is over")
        return Strike(time=time, ball=self.cue, **stroke.model_dump(exclude_defaults=True))

    def events(self, contacts: Contacts, began: float = 0.0) -> tuple[BallEvent, ...]:
        """Return the events of a shot from this match, by its contacts on any engine and its start time, s."""
        return shot_events(self.layout, contacts, began, self.against, self.cue)

    def played(
        self, contacts: Contacts, position: FloatArray, call: ShotCall | None = None, began: float = 0.0
    ) -> Self:
        """Return the match after a shot, once every ball is at rest.

        Args:
            contacts: contacts of the shot on any engine.
            position: (N, 2) m, positions of the bodies at rest.
            call: call before the shot.
            began: time of the stroke, s.

        Raises:
            GameError: the frame is over, or the call could not be made.
        """
        events, remained_behind = self.events(contacts, began), self._remained_behind(contacts, began)
        verdict = self.rules.judge(self.state, call or ShotCall(), events, remained_behind)
        rest = tuple((x, y) for x, y in position.tolist())
        after = replace(self, position=rest, before=self.position, shots=self.shots + 1)
        return after._after_result(verdict)

    def moves(self, position: FloatArray, time: float = 0.0) -> tuple[Move, ...]:
        """Return the actions that move the balls to the positions of this match.

        The moves of the match before a shot undo that shot. In their order no ball is moved onto another.

        Args:
            position: (N, 2) m, present positions of the bodies.
            time: time of the actions, s.
        """
        now = [(x, y) for x, y in position.tolist()]
        return tuple(
            Move(time=time, body=self.layout.names[k], position=at, velocity=(0.0, 0.0))
            for k, at in collision_free_moves(self.layout, now, self.position)
        )

    @cached_property
    def against(self) -> frozenset[tuple[int, int]]:
        """Pairs of body indices that touch before the shot; computed once for all candidate shots."""
        return touching_pairs(self.layout, self.position)

    @property
    def _cue_radius(self) -> float:
        return self.layout.radius[self.layout.number[self.cue]]

    @property
    def _others(self) -> list[PlacedDisc]:
        cue = self.cue
        return [disc for name, disc in self.on_table.items() if name != cue]

    def _remained_behind(self, contacts: Contacts, began: float) -> bool:
        """Return whether a cue ball in hand behind the head string hit a ball there before it crossed the string.

        A ball on the head string is not behind it. A cue ball rolls nearly straight, so it can leave and return only by
        way of a cushion beyond the head string.
        """
        if self.state.in_hand != "behind the head string":
            return False
        cue, layout, first = self.layout.number[self.cue], self.layout, None
        for k in np.argsort(contacts.time, kind="stable").tolist():
            time, (a, b) = float(contacts.time[k]), contacts.pair[k].tolist()
            if time < began or cue not in (a, b) or b <= first_sensor(layout.scene):
                continue
            if first is not None and time > first:
                break
            if b >= 0:
                first = time
                if layout.before_head(self.position[b if a == cue else a]) >= -MAX_TOUCH_GAP:
                    return False
            elif first is None and layout.before_head(contacts.point[k].tolist()) > 0.0:
                return False
        return first is not None

    def _with(self, positions: dict[str, Point]) -> tuple[Point, ...]:
        """Return the positions with some balls at other places."""
        position = list(self.position)
        for name, at in positions.items():
            position[self.layout.number[name]] = at
        return tuple(position)

    def _after_result(self, verdict: Ruling[Any]) -> Self:
        """Return the match after a result: balls reracked, restored or respotted, and the situation settled."""
        position = self.position
        if verdict.rerack:
            position = rerack_moves(self.layout, self.rules, verdict.state)
        elif verdict.restore and self.before is not None:
            position = self.before
        after = replace(self, state=verdict.state, position=position)
        if verdict.respot:
            on_table_names = [after.layout.number[name] for name in after.on_table]
            after = replace(after, position=respot_moves(after.layout, verdict.respot, position, on_table_names))
        after = after._in_hand()
        if after.over:
            return replace(after, verdict=verdict)
        settled = after.rules.settle(after.state, after._situation())
        return replace(after, state=settled.state, verdict=verdict.followed_by(settled))

    def _in_hand(self) -> Self:
        """Return the match with a cue ball in hand moved to the nearest allowed place.

        For a pocketed cue ball it is the place nearest to its initial position.
        """
        if self.state.in_hand is None or self.over:
            return self
        at = self.position[self.layout.number[self.cue]]
        if self.refusal(at) is None:
            return self
        if self.layout.pocket_at(at) is not None:
            at = self.layout.start[self.layout.number[self.cue]]
        return replace(self, position=self._with({self.cue: self.nearest(at)}))

    def _situation(self) -> Situation:
        """Return the situation of the player to shoot."""
        cue = self.cue
        others = {name: disc for name, disc in self.on_table.items() if name != cue}
        return situation_of(self._cue_placements(), others, self.targets, self.state.in_hand is not None)

    def _cue_placements(self) -> Iterator[PlacedDisc]:
        """Yield the cue ball; if it is in hand, also at points spread over the allowed area."""
        radius, place = self._cue_radius, self.state.in_hand
        yield (*self.position[self.layout.number[self.cue]], radius)
        if place is not None:
            yield from ((x, y, radius) for x, y in spread(self.layout, place, radius, self._others))
