"""Jingles: the sound of a cue of a game, a short figure of notes, synthesised like the chimes of collisions."""

import zlib
from functools import lru_cache

import numpy as np

from sandbox.play.chime import RATE, Samples, chime

NOTE = 0.09
"""s from note to note"""
HOME = 440.0
"""Hz, of the scale's first note"""
SCALE = (0, 2, 4, 7, 9)
"""semitones over it: a scale of five tones, of which any two go together"""
FIGURES: dict[str, tuple[int, ...]] = {
    "win": (0, 4, 7, 12),
    "lose": (0, -3, -7, -12),
    "empty": (-5, -5),
    "touch": (-12,),
}
"""Semitones over `HOME`, of cues that many games have; any other name has a figure of its own."""


def figure_of(cue: str) -> tuple[int, ...]:
    """Return the notes of a cue, in semitones: always the same for a name, and two names hardly alike."""
    if cue in FIGURES:
        return FIGURES[cue]
    number = zlib.crc32(cue.encode())
    notes = []
    for _ in range(1 + number % 2):
        number, step = divmod(number // 2, 2 * len(SCALE))
        notes.append(12 * (step // len(SCALE)) + SCALE[step % len(SCALE)])
    return tuple(notes)


@lru_cache(maxsize=64)
def jingle(cue: str) -> Samples:
    """Return the sound of a cue, mono at `RATE`."""
    notes = figure_of(cue)
    step = int(NOTE * RATE)
    sounds = [chime(round(HOME * 2.0 ** (note / 12.0), 3)) for note in notes]
    mixed = np.zeros(step * (len(notes) - 1) + len(sounds[0]))
    for k, sound in enumerate(sounds):
        mixed[k * step : k * step + len(sound)] += sound
    peak = np.abs(mixed).max()
    return np.asarray(np.round(mixed * (min(0.8 * 32767.0 / peak, 1.0))), np.int16)
