"""Sound: collisions to be heard. It is off until asked for, and quietly absent where nothing can play it."""

import math

import numpy as np
import pygame

from sandbox.arrays import FloatArray, IntArray
from sandbox.play.chime import RATE, chime, pitch_of
from sandbox.play.hosting.jingle import jingle
from sandbox.scene.compile.bodies import Bodies
from sandbox.trajectory import Contacts

VOICES = 16
"""Sounds at a time."""
A_CALL = 5
"""Sounds that one call starts, the loudest; more together are a noise."""
CANDIDATES = 64
"""Contacts, the loudest, that are looked up among those of the last call."""
GRAVITY = 9.81
"""m/s²: what a hit is measured by; a scene without gravity is heard like any other"""
SILENT, LOUDEST = 0.1, 4.0
"""Impulse over m·√(2·g·r), that of a body which falls its own radius: below the first nothing is heard, from the
second on it is not louder. A body at rest passes on m·g·dt a step, 0.05 of it for half a metre at 1/60 s."""
CUE = 0.7
"""volume of a game's cues, beside which hits are still heard"""
BUFFER = 512
"""Samples between picture and sound: 12 ms."""


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
        """Fall silent, and let the audio device go."""
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
            bodies: who they are between.
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
            pitch = pitch_of(float(radius[row]))
            if pitch in played:
                continue  # two of one sound at once are only louder
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
            samples = jingle(what) if isinstance(what, str) else chime(what)
            if rate != RATE:  # somebody else has opened the mixer
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
    with np.errstate(over="ignore", invalid="ignore"):  # of a state that diverges
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
