"""Play: how a scene is played, `[play]`."""

from typing import Annotated, Literal

from pydantic import Field

from sandbox.scene.curling import CurlingMatch
from sandbox.scene.marking import Marking
from sandbox.scene.part import Name, Part, Point
from sandbox.scene.parts import PlayPart
from sandbox.scene.spots import Game, Spot


class Play(Part):
    """How a scene is played. No engine reads it, and no run depends on it but by the game that is played."""

    arrows: Name | None = None
    """a body that the arrow keys move"""
    arrow_step: Annotated[float, Field(gt=0, le=1e9)] = 0.5
    """m, how far each time"""
    relaunch: Name | None = None
    """a generator whose bodies Space starts anew, with other chances"""
    show: Literal["overlap"] | None = None
    """Colour bodies by whether they overlap anything."""
    game: Game | None = None
    """whose rules are kept: of billiards, at a table in the window; of any other, also headless"""
    area: tuple[Point, Point] | None = None
    """lower left and upper right corner of a table's playing area, m"""
    view: tuple[Point, Point] | None = None
    """lower left and upper right corner of what the window shows at first, m; by default what the bodies may reach"""
    inset: tuple[Point, Point] | None = None
    """lower left and upper right corner of what is besides shown larger in a corner of the picture, m"""
    spots: tuple[Spot, ...] = Field((), alias="spot")
    curling: CurlingMatch | None = None
    """of a match of curling"""
    markings: tuple[Marking, ...] = Field((), alias="marking")
    players: Annotated[int, Field(ge=1, le=4)] = 1
    """of a game that they play in turn, such as pinball"""
    parts: tuple[PlayPart, ...] = Field((), alias="part")
    """which thing is what to the rules of the game"""
    ground: Literal["grid", "playfield"] = "grid"
    """what is drawn below everything: a grid; or a playfield of markings alone, on which what is fixed casts a shadow,
    and zones are seen if they state a colour"""
