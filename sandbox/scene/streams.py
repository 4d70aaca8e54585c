"""Streams: the numbers that keep apart the random draws of one seed.

A stream is keyed by its number, by the seed and, where there are several of a kind, by an index. numpy's seed sequence
reads a key as 32-bit words and ignores trailing zeros: [seed, 3] and [seed, 3, 0] are one stream. So each purpose
has a number of its own here, and no other place draws by the seed of a scene, a player or a study. Pictures and sounds,
and the order in which crowds are given to an engine, follow no seed.
"""

from __future__ import annotations  # `np.random` in an annotation would import it wherever scenes are read

from enum import Enum

import numpy as np


class Stream(Enum):
    """What is drawn: the stream's number."""

    GRID = 0
    """jitter of a `[[grid]]`, by its place among its kind"""
    SCATTER = 1
    """places of a `[[scatter]]`, likewise"""
    EMITTER = 2
    """velocities and lifetimes of an `[[emitter]]`, likewise"""
    RACK = 3
    """gaps and numbers of a rack of balls"""
    STACK = 4
    """jitter of a `[[stack]]`, by its place among its kind"""
    LANDSCAPE = 11
    """the ground of artillery"""
    SHELL = 12
    """errors of a bot's shot in artillery, by the turn"""
    SHOTS = 0x73686F74
    """errors of the strokes of a study"""
    STROKE = 0x7374726B
    """errors of a bot's stroke in billiards, by its number in the frame"""
    TRIAL = 0x7472696C
    """errors by which that bot tries a stroke, by the shots of the match before it"""
    BALL_SEARCH = 0x5EA2C4
    """coils that a pinball table fires where no ball is seen"""
    COIL = 0xC011
    """speeds of a pinball coil, by the coil"""
    AIM = 0x61696D73
    """aiming of a skilled artillery player, by the turn"""
    CURLER = 0x6375726C
    """errors of a curling team, by the team"""
    FLIPPERS = 0x68616E64
    """errors of a skilled pinball player"""
    LANDING = 0x6C616E64
    """where a ship begins"""
    KEYS = 0x706C6179
    """keys of a random player"""


NUMBER_FIRST = {Stream.COIL, Stream.CURLER, Stream.FLIPPERS, Stream.LANDING, Stream.KEYS}
"""Keyed by number, index and seed, in this order, as the scores that were published with them are, and `AIM` by number,
seed and index; the others by seed, number and index."""


def key_of(stream: Stream, seed: int, *index: int) -> list[int]:
    """Return the words of a stream's key.

    Args:
        stream: what is drawn.
        seed: of the scene, the player or the study, not negative.
        index: of the one of several that draws, as `Stream` says; always as many for one stream.
    """
    if stream is Stream.AIM:
        return [stream.value, seed, *index]
    return [stream.value, *index, seed] if stream in NUMBER_FIRST else [seed, stream.value, *index]


def bits(stream: Stream, seed: int, *index: int) -> np.random.PCG64:
    """Return the bit generator of a stream, which can be advanced."""
    return np.random.PCG64(key_of(stream, seed, *index))


def draws(stream: Stream, seed: int, *index: int) -> np.random.Generator:
    """Return what a purpose draws from: the same for the same key, and no other's."""
    return np.random.Generator(bits(stream, seed, *index))
