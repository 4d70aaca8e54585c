"""Sound of impacts and of game events. It is off by default, and unavailable without an audio device.

The sound of an impact is synthesised from a few decaying partials and a click; the sound of a game event is a short
sequence of such notes.
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

RATE = 44_100
"""samples/s"""
LOWEST, HIGHEST = 80.0, 2000.0
"""Hz, of the fundamental: small loudspeakers are weak below, and higher tones are shrill"""
STEPS = 28
"""Pitches between the two, a whole tone apart: a few dozen sounds serve every body."""
PARTIALS = ((1.0, 1.0), (2.756, 0.35), (5.404, 0.12))
"""Frequency over the fundamental's, and amplitude: those of a free bar, which sound like wood or stone.
Source: L. D. Landau, E. M. Lifshitz, Theory of Elasticity, § 25: the roots of cos κl · cosh κl = 1."""
CYCLES = 22.0
"""cycles of the fundamental in which it decays to 1/e; a high sound decays faster"""
SLOWEST = 0.09
"""s, largest decay time to 1/e"""
CLICK, CLICK_SECONDS = 0.25, 0.0015
"""Amplitude of the noise at the start, and the time in which it falls to 1/e, s"""
SECONDS = 0.5
"""of a sound: by then it is 50 dB down"""
PEAK = 0.6
"""fraction of full scale, so that a few sounds can be mixed"""


def impact_pitch(radius: float) -> float:
    """Return the pitch of a body, Hz: proportional to the inverse square root of the radius, m, in whole tones.

    That of a real body is inversely proportional to the radius, which would exceed the range of hearing.
    """
    octaves = math.log2(HIGHEST / LOWEST)
    wanted = math.log2(220.0 / LOWEST) - 0.5 * math.log2(radius / 0.5)  # half a metre sounds an A
    step = round(min(max(wanted / octaves, 0.0), 1.0) * (STEPS - 1))
    return float(LOWEST * 2.0 ** (octaves * step / (STEPS - 1)))


def impact_sound(pitch: float) -> Samples:
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


NOTE = 0.09
"""s between notes"""
HOME = 440.0
"""Hz, of the scale's first note"""
SCALE = (0, 2, 4, 7, 9)
"""semitones over it: a scale of five tones, of which any two go together"""
CUE_NOTES: dict[str, tuple[int, ...]] = {
    "win": (0, 4, 7, 12),
    "lose": (0, -3, -7, -12),
    "empty": (-5, -5),
    "touch": (-12,),
}
"""Semitones over `HOME`, of cues that many games have; any other name has a figure of its own."""


def cue_notes(cue: str) -> tuple[int, ...]:
    """Return the notes of a game event, in semitones: fixed for a name, and usually different for different names."""
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
    """Return the sound of a cue, mono at `RATE`."""
    notes = cue_notes(cue)
    step = int(NOTE * RATE)
    sounds = [impact_sound(round(HOME * 2.0 ** (note / 12.0), 3)) for note in notes]
    mixed = np.zeros(step * (len(notes) - 1) + len(sounds[0]))
    for k, sound in enumerate(sounds):
        mixed[k * step : k * step + len(sound)] += sound
    peak = np.abs(mixed).max()
    return np.asarray(np.round(mixed * (min(0.8 * 32767.0 / peak, 1.0))), np.int16)


VOICES = 16
"""sounds at a time"""
A_CALL = 5
"""loudest sounds that one call starts; more at once are noise"""
CANDIDATES = 64
"""Contacts, the loudest, that are looked up among those of the last call."""
GRAVITY = 9.81
"""m/s², reference of impact strength, also for scenes without gravity"""
SILENT, LOUDEST = 0.1, 4.0
"""Impulse over m·√(2·g·r), that of a body which falls its own radius: below the first nothing is heard, from the
second on it is not louder. A body at rest passes on m·g·dt a step, 0.05 of it for half a metre at 1/60 s."""
CUE = 0.7
"""volume of game sounds, at which impacts stay audible"""
BUFFER = 512
"""samples of latency: 12 ms"""


class Sounds:
    """Plays a chime for each new contact, lower for a larger body, louder for a harder hit."""

    def __init__(self) -> None:
        self.available = True
        """False once enabling has failed"""
        self.why = ""
        """it failed"""
        self.enabled = False
        self._heard = Contacts.none()
        self._sounds: dict[float | str, pygame.mixer.Sound] = {}
        self._opened = False

    def enable(self) -> bool:
        """Open the audio device. Return whether sounds can be heard; where not, `why` says the reason."""
        if self.enabled:
            return True
        try:
            if pygame.mixer.get_init() is None:
                pygame.mixer.init(RATE, -16, 2, BUFFER, allowedchanges=0)
                self._opened = True
            pygame.mixer.set_num_channels(max(VOICES, pygame.mixer.get_num_channels()))
        # A pygame built without its mixer has a stand-in, which raises NotImplementedError.
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
        """Play the contacts that are new since the last call, the loudest few, and return how many sounds began.

        Args:
            contacts: those open now, with the impulses since the last call.
            bodies: the bodies of the contacts.
        """
        if not self.enabled or pygame.mixer.get_init() is None:
            return 0
        before, self._heard = self._heard, contacts
        if not len(contacts):
            return 0
        strength, radius = loudness(contacts, bodies)
        loud = np.flatnonzero(strength > SILENT)
        if len(loud) > CANDIDATES:
            loud = loud[np.argpartition(-strength[loud], CANDIDATES)[:CANDIDATES]]
        loud = loud[np.argsort(-strength[loud], kind="stable")]
        played: set[float] = set()
        for row in loud.tolist():
            if len(played) == A_CALL:
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
        """Play the figure of a cue of a game; tell whether it began."""
        if not self.enabled or pygame.mixer.get_init() is None:
            return False
        channel = pygame.mixer.find_channel()
        if channel is None:
            return False
        channel.play(self._sound(name))
        channel.set_volume(CUE)
        return True

    def _sound(self, what: float | str) -> pygame.mixer.Sound:
        """Return the chime of a pitch, Hz, or the figure of a cue by its name."""
        if what not in self._sounds:
            rate, _, channels = pygame.mixer.get_init() or (RATE, -16, 2)
            samples = cue_sound(what) if isinstance(what, str) else impact_sound(what)
            if rate != RATE:  # the mixer was opened with another rate
                places = np.arange(0, len(samples), RATE / rate)
                samples = np.interp(places, np.arange(len(samples)), samples).astype(np.int16)
            self._sounds[what] = pygame.mixer.Sound(buffer=np.repeat(samples, channels).tobytes())
        return self._sounds[what]


def loudness(contacts: Contacts, bodies: Bodies) -> tuple[FloatArray, FloatArray]:
    """Return how hard each contact is, (C,), and the radius of the body that is heard, (C,) m.

    Heard is the lighter body of the two that can move; how hard, in units of m·√(2·g·r) of that body.
    """
    first, second = _numbers(contacts.pair[:, 0]), _numbers(contacts.pair[:, 1])
    mass = np.append(np.where(bodies.fixed, np.inf, bodies.mass), np.inf)  # the last one is any fixed thing
    heard = np.where(mass[first] <= mass[second], first, second)
    radius = np.append(bodies.radius, 1.0)[heard]
    unit = mass[heard] * np.sqrt(2.0 * GRAVITY * radius)
    with np.errstate(over="ignore", invalid="ignore"):  # in a diverging state
        impulse = np.hypot(contacts.impulse[:, 0], contacts.impulse[:, 1])
        return np.nan_to_num(impulse / unit, nan=0.0, posinf=0.0), radius


def volume(strength: float) -> float:
    """Return the volume, 0 to 1, of a contact so hard; ears hear ratios, so it rises as the root."""
    return math.sqrt(min(strength / LOUDEST, 1.0))


def _numbers(side: IntArray) -> IntArray:
    """Return body numbers, those of fixed things being −1: the last."""
    return np.maximum(side, -1)


def _is_among(contacts: Contacts, row: int, others: Contacts) -> bool:
    """Tell whether a contact was there before; it keeps its first time, so the same is known by that."""
    first, second = contacts.pair[row]
    same = np.flatnonzero(others.pair[:, 0] == first)
    same = same[others.pair[same, 1] == second]
    return bool((others.time[same] == contacts.time[row]).any())
