"""Kick: what a surface adds to whoever hits it hard enough, as bumpers and slingshots do."""

from typing import Annotated, Literal

from pydantic import Field

from sandbox.scene.part import Part

LEAST_THRESHOLD = 1e-3
"""m/s: what closes more slowly lies, hops or is pressed on; engines do not tell these apart."""


class Kick(Part):
    """A hit that closes faster than `threshold` leaves faster by `speed`, along the normal, than it would rebound."""

    speed: Annotated[float, Field(ge=0, le=1e6)]
    """m/s, in the middle where that is told apart"""
    threshold: Annotated[float, Field(ge=LEAST_THRESHOLD, le=1e12)] = 0.05
    """m/s, of the approach along the normal"""
    profile: Literal["even", "middle"] = "even"
    """`even`: alike everywhere; `middle`: by 4 s (1 − s) along the length of a wall, s from 0 to 1"""
