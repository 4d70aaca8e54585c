"""Candidates: the pairs that the broad phases handed on."""

from typing import NamedTuple

from sandbox.trajectory import IntArray


class Candidates(NamedTuple):
    """The pairs that the broad phases handed on, by ascending key. Every body is a candidate for every plane."""

    balls: IntArray
    """(B,) keys of two balls, or two pieces"""
    segments: IntArray
    """(S,) keys of a ball, or a piece, and a segment"""
