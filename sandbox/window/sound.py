"""Sounds of impacts and of game events. Off by default; unavailable without an audio device.

An impact is synthesised from a few decaying partials and a click; a game event is a short sequence of such notes.
"""

import math
import zlib
from functools import lru_cache

import numpy as np
import numpy.typing as npt
import pygame

from sandbox.arrays import FloatArray, IntArray
from sandbox.scene.compile.bodies import Bodies
from sandbox.trajectory import Contacts

Samples = npt.NDArray[np.int16]

SAMPLE_RATE = 44_100
"""samples/s"""
MIN_PITCH, MAX_PITCH = 80.0, 2000.0
"""Hz, range of the fundamental: small loudspeakers are weak below it, and higher tones are shrill"""
PITCH_COUNT = 28
"""Number of pitches in the range, a whole tone apart, so that a few dozen sounds serve all bodies."""
PARTIALS = ((1.0, 1.0), (2.756, 0.35), (5.404, 0.12))
"""Frequency ratio to the fundamental, and amplitude: those of a free bar, which sound like wood or stone.

Source: L. D. Landau, E. M. Lifshitz, Theory of Elasticity, § 25: the roots of cos κl · cosh κl = 1.
"""
DECAY_CYCLES = 22.0
"""Decay time to 1/e in cycles of the fundamental; higher pitches decay faster."""
MAX_DECAY_TIME = 0.09
"""s, largest decay time to 1/e"""
CLICK_AMPLITUDE, CLICK_DECAY_TIME = 0.25, 0.0015
"""amplitude of the noise at the start, and its decay time to 1/e, s"""
SOUND_DURATION = 0.5
"""s, duration of a sound, at the end of which it has fallen by 50 dB"""
PEAK_FRACTION = 0.6
"""fraction of full scale, with headroom for mixing"""


def impact_pitch(radius: float) -> float:
    """Return the pitch of a body, Hz: proportional to radius^(−1/2), radius in m, rounded to whole tones.

    The pitch of a real body is inversely proportional to its radius, which would exceed the audible range.
    """
    octaves = math.log2(MAX_PITCH / MIN_PITCH)
    wanted = math.log2(220.0 / MIN_PITCH) - 0.5 * math.log2(radius / 0.5)  # a radius of 0.5 m sounds at 220 Hz (A3)
    step = round(min(max(wanted / octaves, 0.0), 1.0) * (PITCH_COUNT - 1))
    return float(MIN_PITCH * 2.0 ** (octaves * step / (PITCH_COUNT - 1)))


def impact_sound(pitch: float) -> Samples:
    """Return the sound of an impact at a pitch in Hz, mono at `SAMPLE_RATE`."""
    time = np.arange(int(SOUND_DURATION * SAMPLE_RATE)) / SAMPLE_RATE
    decay = min(DECAY_CYCLES / pitch, MAX_DECAY_TIME)
    sound = np.zeros(len(time))
    for ratio, amplitude in PARTIALS:
        if ratio * pitch < SAMPLE_RATE / 2:
            # Higher partials decay faster, as in any damped material.
            sound += amplitude * np.exp(-time * ratio / decay) * np.sin(2.0 * math.pi * ratio * pitch * time)
    noise = np.random.default_rng(round(pitch)).uniform(-1.0, 1.0, len(time))
    sound += CLICK_AMPLITUDE * noise * np.exp(-time / CLICK_DECAY_TIME)
    sound *= _faded(len(time))
    return np.asarray(np.round(sound * (PEAK_FRACTION * 32767.0 / np.abs(sound).max())), np.int16)


def _faded(count: int) -> FloatArray:
    """Return an envelope that starts and ends at 0, which avoids audible edges."""
    attack, release = 16, 512
    envelope = np.ones(count)
    envelope[:attack] = np.arange(attack) / attack
    envelope[-release:] = np.linspace(1.0, 0.0, release)
    return envelope


NOTE_INTERVAL = 0.09
"""s between notes"""
BASE_PITCH = 440.0
"""Hz, first note of the scale"""
SCALE = (0, 2, 4, 7, 9)
"""semitones above `BASE_PITCH`: a pentatonic scale, in which any two notes are consonant"""
CUE_NOTES: dict[str, tuple[int, ...]] = {
    "win": (0, 4, 7, 12),
    "lose": (0, -3, -7, -12),
    "empty": (-5, -5),
    "touch": (-12,),
}
"""Semitones relative to `BASE_PITCH` for cues shared by many games; other cues get notes derived from their name."""


def cue_notes(cue: str) -> tuple[int, ...]:
    """Return the notes of a cue in semitones: fixed for a name, and usually different for different names."""
    if cue in CUE_NOTES:
        return CUE_NOTES[cue]
    number = zlib.crc32(cue.encode())
    notes = []
    for _ in range(1 + number % 2):
        number, step = divmod(number // 2, 2 * len(SCALE))
        notes.append(12 * (step // len(SCALE)) + SCALE[step % len(SCALE)])
    return tuple(notes)


@lru_cache(maxsize=64)
def cue_sound(cue: str) -> Samples:
    """Return the sound of a cue, mono at `SAMPLE_RATE`."""
    notes = cue_notes(cue)
    step = int(NOTE_INTERVAL * SAMPLE_RATE)
    sounds = [impact_sound(round(BASE_PITCH * 2.0 ** (note / 12.0), 3)) for note in notes]
    mixed = np.zeros(step * (len(notes) - 1) + len(sounds[0]))
    for k, sound in enumerate(sounds):
        mixed[k * step : k * step + len(sound)] += sound
    peak = np.abs(mixed).max()
    return np.asarray(np.round(mixed * (min(0.8 * 32767.0 / peak, 1.0))), np.int16)


MAX_VOICES = 16
"""number of simultaneous sounds"""
MAX_SOUNDS_PER_CALL = 5
"""largest number of sounds started by one call; more would be noise"""
MAX_CANDIDATES = 64
"""Number of the loudest contacts that are compared with those of the previous call."""
GRAVITY = 9.81
"""m/s², reference acceleration of impact strength, also in scenes without gravity"""
MIN_STRENGTH, MAX_STRENGTH = 0.1, 4.0
"""Impact strength below which no sound is played, and from which on the volume is constant.

Impact strength is impulse / (m·√(2·g·r)): 1 for a body that falls by its own radius. A body at rest transmits m·g·dt
per step, a strength of 0.05 for r = 0.5 m at dt = 1/60 s.
"""
CUE_VOLUME = 0.7
"""volume of cues, at which impacts stay audible"""
BUFFER_SIZE = 512
"""samples of latency, 12 ms"""


class Sounds:
    """Plays a sound for each new contact: lower for larger bodies, louder for harder impacts; and cues of games."""

    def __init__(self) -> None:
        self.available = True
        """False after enabling has failed"""
        self.why = ""
        """reason why enabling has failed"""
        self.enabled = False
        self._heard = Contacts.none()
        self._sounds: dict[float | str, pygame.mixer.Sound] = {}
        self._opened = False

    def enable(self) -> bool:
        """Open the audio device; return whether that succeeded. If not, `why` holds the reason."""
        if self.enabled:
            return True
        try:
            if pygame.mixer.get_init() is None:
                pygame.mixer.init(SAMPLE_RATE, -16, 2, BUFFER_SIZE, allowedchanges=0)
                self._opened = True
            pygame.mixer.set_num_channels(max(MAX_VOICES, pygame.mixer.get_num_channels()))
        # pygame without its mixer module provides a stub that raises NotImplementedError.
        except (pygame.error, NotImplementedError, OSError) as error:
            self.available, self.why = False, f"no sound: {error}"
            return False
        self.available, self.why, self.enabled = True, "", True
        return True

    def disable(self) -> None:
        """Stop all sounds and close the audio device."""
        if not self.enabled:
            return
        self.enabled = False
        self._sounds.clear()
        self._heard = Contacts.none()
        if self._opened and pygame.mixer.get_init() is not None:
            pygame.mixer.quit()
        self._opened = False

    def hits(self, contacts: Contacts, bodies: Bodies) -> int:
        """Play the loudest contacts that are new since the last call; return the number of sounds started.

        Args:
            contacts: present contacts, with the impulses since the last call.
            bodies: the bodies of the contacts.
        """
        if not self.enabled or pygame.mixer.get_init() is None:
            return 0
        before, self._heard = self._heard, contacts
        if not len(contacts):
            return 0
        strength, radius = loudness(contacts, bodies)
        loud = np.flatnonzero(strength > MIN_STRENGTH)
        if len(loud) > MAX_CANDIDATES:
            loud = loud[np.argpartition(-strength[loud], MAX_CANDIDATES)[:MAX_CANDIDATES]]
        loud = loud[np.argsort(-strength[loud], kind="stable")]
        played: set[float] = set()
        for row in loud.tolist():
            if len(played) == MAX_SOUNDS_PER_CALL:
                break
            if _is_among(contacts, row, before):
                continue
            pitch = impact_pitch(float(radius[row]))
            if pitch in played:
                continue  # the same sound twice at once is only louder
            channel = pygame.mixer.find_channel()
            if channel is None:
                break
            channel.play(self._sound(pitch))
            channel.set_volume(volume(float(strength[row])))
            played.add(pitch)
        return len(played)

    def cue(self, name: str) -> bool:
        """Play the sound of a game's cue; return whether it was started."""
        if not self.enabled or pygame.mixer.get_init() is None:
            return False
        channel = pygame.mixer.find_channel()
        if channel is None:
            return False
        channel.play(self._sound(name))
        channel.set_volume(CUE_VOLUME)
        return True

    def _sound(self, what: float | str) -> pygame.mixer.Sound:
        """Return the sound of a pitch, Hz, or of a cue by name, cached."""
        if what not in self._sounds:
            rate, _, channels = pygame.mixer.get_init() or (SAMPLE_RATE, -16, 2)
            samples = cue_sound(what) if isinstance(what, str) else impact_sound(what)
            if rate != SAMPLE_RATE:  # the mixer was opened at another rate
                places = np.arange(0, len(samples), SAMPLE_RATE / rate)
                samples = np.interp(places, np.arange(len(samples)), samples).astype(np.int16)
            self._sounds[what] = pygame.mixer.Sound(buffer=np.repeat(samples, channels).tobytes())
        return self._sounds[what]


def loudness(contacts: Contacts, bodies: Bodies) -> tuple[FloatArray, FloatArray]:
    """Return the strength of each contact, (C,), and the radius of the body that sounds, (C,) m.

    The lighter of the movable bodies sounds. Strength is in units of m·√(2·g·r) of that body.
    """
    first, second = _numbers(contacts.pair[:, 0]), _numbers(contacts.pair[:, 1])
    mass = np.append(np.where(bodies.fixed, np.inf, bodies.mass), np.inf)  # the last entry stands for static geometry
    heard = np.where(mass[first] <= mass[second], first, second)
    radius = np.append(bodies.radius, 1.0)[heard]
    unit = mass[heard] * np.sqrt(2.0 * GRAVITY * radius)
    with np.errstate(over="ignore", invalid="ignore"):  # a diverging simulation
        impulse = np.hypot(contacts.impulse[:, 0], contacts.impulse[:, 1])
        return np.nan_to_num(impulse / unit, nan=0.0, posinf=0.0), radius


def volume(strength: float) -> float:
    """Return the volume, 0 to 1, of an impact strength: a square root, as loudness is perceived on a ratio scale."""
    return math.sqrt(min(strength / MAX_STRENGTH, 1.0))


def _numbers(side: IntArray) -> IntArray:
    """Return body indices with all static geometry mapped to −1, the last entry."""
    return np.maximum(side, -1)


def _is_among(contacts: Contacts, row: int, others: Contacts) -> bool:
    """Return whether a contact existed before, identified by its pair and its start time."""
    first, second = contacts.pair[row]
    same = np.flatnonzero(others.pair[:, 0] == first)
    same = same[others.pair[same, 1] == second]
    return bool((others.time[same] == contacts.time[row]).any())
