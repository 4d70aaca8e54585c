"""CurlingMatch: how long a match of curling is, and who plays, `[play.curling]`."""

from typing import Annotated

from pydantic import Field

from sandbox.scene.part import Part


class CurlingMatch(Part):
    """A match of two teams, red and yellow, on a scene with their stones."""

    ends: Annotated[int, Field(ge=1, le=20)] = 2
    """how many ends the match has"""
    people: Annotated[int, Field(ge=0, le=2)] = 1
    """how many of the teams somebody plays, red first; others play by themselves"""
    error: Annotated[float, Field(ge=0, le=100)] = 1.0
    """how far those miss: 1 is some 0.3 m in length, and 0.1 m aside"""
