"""Parts: which thing of a scene plays which part in a game, so that rules need not know how a table is built."""

from typing import Annotated, Literal

from pydantic import Field

from sandbox.scene.part import Colour, Name, Part, Point, Velocity

Role = Literal[
    "ball", "bumper", "drain", "drop", "flipper", "gate", "kicker", "plunger", "ramp", "rollover", "slingshot",
    "spinner", "standup",
]  # fmt: skip


class PlayPart(Part):
    """What a body, a wall, a post, a zone or a drive is to the rules of a game.

    Several parts of one `group` belong together: a bank of targets, the lanes at the top, the holes that lock balls,
    entry and exit of a ramp. Of a drive or of what only moves the ball, such as a gate, rules may leave `score` alone.
    """

    name: Name
    """of the body, fixed thing, zone or drive"""
    role: Role
    """what it is to the rules, such as a bumper or a drain"""
    group: Name | None = None
    """whom it belongs to: a bank, a set of lanes, a ramp; of a flipper the side, `left` or `right`"""
    step: Annotated[int, Field(ge=0, le=1000)] = 0
    """its place in what has an order: 0 the entry of a ramp, 1 its exit; of targets and lanes counted from the left"""
    score: Annotated[int, Field(ge=0, le=10**12)] = 0
    """points, each time it is hit, entered or turned"""
    at: Point | None = None
    """where a ball is put by it: a plunger's lane, a ball's start, m"""
    out: Velocity | None = None
    """the velocity with which it lets a ball go, such as a kicker's, m/s"""
    light: Point | None = None
    """where a lamp tells whether it is lit, m"""
    colour: Colour | None = None
    """of the lamp"""
