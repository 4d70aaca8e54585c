"""Table `[play.curling]` of a scene file: length and players of a match of curling."""

from typing import Annotated

from pydantic import Field

from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.base import Part
from sandbox.scene.description.game_tables import GameTable, table_of


class CurlingMatch(Part):
    """A match of two teams, red and yellow, on a scene with their stones."""

    ends: Annotated[int, Field(ge=1, le=20)] = 2
    """number of ends of the match"""
    people: Annotated[int, Field(ge=0, le=2)] = 1
    """number of teams played by a person, red first; the computer plays the others"""
    error: Annotated[float, Field(ge=0, le=100)] = 1.0
    """error of the computer's stones: 1 means about 0.3 m in length and 0.1 m sideways"""


MATCH = GameTable(CurlingMatch, "settings of a curling match")


def needs_player(scene: Scene) -> str | None:
    """Return why a match does not proceed without input: a person has to deliver stones."""
    match = table_of(scene.play, CurlingMatch) or CurlingMatch()
    if not match.people:
        return None
    return (
        "player 'none' delivers no stone, so nothing would move; use random or a script, or let both teams play by "
        "themselves with --set play.curling.people=0"
    )


def presents(scene: Scene) -> bool:
    """Return whether the bodies of a scene are drawn as stones: they are pucks on a surface."""
    return scene.surface is not None and scene.surface.bodies == "pucks"
