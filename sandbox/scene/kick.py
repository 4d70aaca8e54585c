"""Kick: speed that a surface adds to bodies that hit it hard enough, as bumpers and slingshots do."""

from typing import Annotated, Literal

from pydantic import Field

from sandbox.scene.part import Part

LEAST_THRESHOLD = 1e-3
"""m/s: what closes more slowly lies, hops or is pressed on; engines do not tell these apart."""


class Kick(Part):
    """Adds `speed` along the normal to a hit that closes faster than `threshold`."""

    speed: Annotated[float, Field(ge=0, le=1e6)]
    """m/s; with the profile `middle`, in the middle"""
    threshold: Annotated[float, Field(ge=LEAST_THRESHOLD, le=1e12)] = 0.05
    """m/s, of the approach along the normal"""
    profile: Literal["even", "middle"] = "even"
    """`even`: alike everywhere; `middle`: by 4 s (1 − s) along the length of a wall, s from 0 to 1"""
    adds_to: Literal["rebound", "approach"] = "rebound"
    """`rebound`: the body bounces, then gains the speed, as at a bumper; `approach`: the speed is added to the
    approach, and the body bounces with the sum, as at a slingshot"""
