"""Random streams: keys that separate the random numbers drawn for different purposes from one seed.

A stream is keyed by its number, by the seed and, if there are several of a kind, by an index. numpy's seed sequence
reads a key as 32-bit words and ignores trailing zeros: [seed, 3] and [seed, 3, 0] are the same stream. So each purpose
has its own number here, and all random numbers that depend on the seed of a scene, a player or a study come from these
streams. Pictures, sounds and
the order in which large numbers of bodies are given to an engine do not depend on a seed.
"""

from __future__ import annotations  # `np.random` in an annotation would import it wherever scenes are read

from enum import Enum

import numpy as np


class Stream(Enum):
    """Purpose of random numbers; the value is the number of the stream."""

    GRID = 0
    """jitter of a `[[grid]]`, by its index among its kind"""
    SCATTER = 1
    """positions of a `[[scatter]]`, likewise"""
    EMITTER = 2
    """velocities and lifetimes of an `[[emitter]]`, likewise"""
    RACK = 3
    """gaps and numbers of a rack of balls"""
    STACK = 4
    """jitter of a `[[stack]]`, by its index among its kind"""
    LANDSCAPE = 11
    """terrain of artillery"""
    SHELL = 12
    """errors of a bot's shot in artillery, by the turn"""
    SHOTS = 0x73686F74
    """errors of the strokes of a study"""
    STROKE = 0x7374726B
    """errors of a bot's stroke in billiards, by its number in the frame"""
    TRIAL = 0x7472696C
    """errors of the simulated strokes of a bot in billiards, by the number of previous shots of the match"""
    BALL_SEARCH = 0x5EA2C4
    """coils that a pinball table fires when no ball is detected"""
    COIL = 0xC011
    """speeds of a pinball coil, by the coil"""
    AIM = 0x61696D73
    """aiming of a skilled artillery player, by the turn"""
    CURLER = 0x6375726C
    """errors of a curling team, by the team"""
    FLIPPERS = 0x68616E64
    """errors of a skilled pinball player"""
    PILOT = 0x70696C74
    """errors of a skilled pilot in landing"""
    LANDING = 0x6C616E64
    """start position of a ship"""
    ENSEMBLE = 0x656E7365
    """variations of the starts of an ensemble, by the varied quantity"""
    STARTS = 0x73746172
    """perturbed starts of a scene, by their numbers"""
    REACTIONS = 0x72656163
    """times of a player's actions in perturbed starts, by their numbers"""
    KEYS = 0x706C6179
    """keys of a random player"""


NUMBER_FIRST = {Stream.COIL, Stream.CURLER, Stream.FLIPPERS, Stream.LANDING, Stream.KEYS}
"""Streams keyed by number, index and seed, in this order, because published scores depend on it; `AIM` is keyed by
number, seed and index; all others by seed, number and index."""

_RESERVED = {stream.value for stream in (*NUMBER_FIRST, Stream.AIM)}
"""First words of the keys that begin with the number of a stream."""

_SUFFIX = (1, 1, 1)
"""Ends the key of a stream that begins with a seed if that seed is in `_RESERVED`: the key then has five words or more,
and no key that begins with a number has more than four."""


def key_of(stream: Stream, seed: int, *index: int) -> list[int]:
    """Return the key of a stream.

    Args:
        stream: the purpose.
        seed: of the scene, the player or the study, not negative.
        index: of the generator, body or turn, as described in `Stream`; always the same number of indices for one
            stream.
    """
    if stream is Stream.AIM:
        return [stream.value, seed, *index]
    if stream in NUMBER_FIRST:
        return [stream.value, *index, seed]
    return [seed, stream.value, *index, *(_SUFFIX if seed & 0xFFFFFFFF in _RESERVED else ())]


def bits(stream: Stream, seed: int, *index: int) -> np.random.PCG64:
    """Return the bit generator of a stream."""
    return np.random.PCG64(key_of(stream, seed, *index))


def draws(stream: Stream, seed: int, *index: int) -> np.random.Generator:
    """Return the random generator of a stream; equal keys give equal numbers."""
    return np.random.Generator(bits(stream, seed, *index))
