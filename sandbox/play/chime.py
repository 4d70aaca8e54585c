"""Chime: the sound of one body that is struck, synthesised from a few decaying partials and a click."""

import math

import numpy as np
import numpy.typing as npt

from sandbox.arrays import FloatArray

Samples = npt.NDArray[np.int16]

RATE = 44_100
"""samples/s"""
LOWEST, HIGHEST = 80.0, 2000.0
"""Hz, of the fundamental: small loudspeakers carry little below, and what lies above is shrill"""
STEPS = 28
"""Pitches between the two, a whole tone apart: a few dozen sounds serve every body."""
PARTIALS = ((1.0, 1.0), (2.756, 0.35), (5.404, 0.12))
"""Frequency over the fundamental's, and amplitude: those of a free bar, which sound like wood or stone.
Source: L. D. Landau, E. M. Lifshitz, Theory of Elasticity, § 25: the roots of cos κl · cosh κl = 1."""
CYCLES = 22.0
"""of the fundamental, in which it falls to 1/e; a high sound is over sooner"""
SLOWEST = 0.09
"""s, the longest that any sound takes to fall to 1/e"""
CLICK, CLICK_SECONDS = 0.25, 0.0015
"""Amplitude of the noise at the start, and the time in which it falls to 1/e, s"""
SECONDS = 0.5
"""of a sound: by then it is 50 dB down"""
PEAK = 0.6
"""of full scale: room for a few sounds at once"""


def pitch_of(radius: float) -> float:
    """Return the pitch of a body, Hz: it falls with the root of the radius, m, in whole tones.

    A real body's falls with the radius itself; so much would leave no two scenes in hearing range.
    """
    octaves = math.log2(HIGHEST / LOWEST)
    wanted = math.log2(220.0 / LOWEST) - 0.5 * math.log2(radius / 0.5)  # half a metre sounds an A
    step = round(min(max(wanted / octaves, 0.0), 1.0) * (STEPS - 1))
    return float(LOWEST * 2.0 ** (octaves * step / (STEPS - 1)))


def chime(pitch: float) -> Samples:
    """Return a sound of a pitch, Hz, mono at `RATE`."""
    time = np.arange(int(SECONDS * RATE)) / RATE
    decay = min(CYCLES / pitch, SLOWEST)
    sound = np.zeros(len(time))
    for ratio, amplitude in PARTIALS:
        if ratio * pitch < RATE / 2:
            # Higher partials lose their energy sooner, as in any material that damps.
            sound += amplitude * np.exp(-time * ratio / decay) * np.sin(2.0 * math.pi * ratio * pitch * time)
    noise = np.random.default_rng(round(pitch)).uniform(-1.0, 1.0, len(time))
    sound += CLICK * noise * np.exp(-time / CLICK_SECONDS)
    sound *= _faded(len(time))
    return np.asarray(np.round(sound * (PEAK * 32767.0 / np.abs(sound).max())), np.int16)


def _faded(count: int) -> FloatArray:
    """Return an envelope that begins and ends at 0, so that no edge is heard but the click."""
    attack, release = 16, 512
    envelope = np.ones(count)
    envelope[:attack] = np.arange(attack) / attack
    envelope[-release:] = np.linspace(1.0, 0.0, release)
    return envelope
