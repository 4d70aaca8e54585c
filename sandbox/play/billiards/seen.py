"""Seen: what a game adds to the sight of a moment."""

from dataclasses import replace

from sandbox.play.billiards.aim import Aim
from sandbox.play.billiards.forecast import Forecaster
from sandbox.play.billiards.person import Person
from sandbox.play.sight import Sight


class Seen:
    """Works out what is drawn of the next stroke."""

    def __init__(self, person: Person) -> None:
        self._person = person
        self._forecaster = Forecaster(person.game.match.scene)

    def over(self, sight: Sight) -> Sight:
        """Return a sight with the aim of a game, and with the ball that a hand carries where the hand is."""
        aim = self.aim()
        if aim is None or not aim.carried:
            return replace(sight, aim=aim)
        position = sight.frame.position.copy()
        position[aim.ball] = aim.place
        return replace(sight, aim=aim, frame=replace(sight.frame, position=position))

    def aim(self) -> Aim | None:
        """Return what is drawn of the next stroke; nothing while balls roll or the bot looks for its shot."""
        person, game = self._person, self._person.game
        if not game.aiming or game.bot_is_thinking:
            return None
        match, cue, call, ball = game.match, game.cue, game.call, game.ball
        carried = person.carried is not None
        pocket = match.layout.pockets.get(call.pocket or "")
        return Aim(
            ball=ball,
            place=person.place,
            angle=cue.aim,
            side=cue.side,
            back=cue.back,
            forecast=None if carried else self._forecaster.of(cue.stroke, ball, game.position),
            carried=carried,
            refused=person.refused,
            called=None if pocket is None else ((pocket[0], pocket[1]), pocket[2]),
            nominated=match.layout.number.get(call.ball or ""),
        )
