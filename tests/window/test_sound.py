"""Collision sounds: pitch and envelope, selection of contacts, and silence without an audio device."""

import os
import subprocess
import sys
from collections.abc import Iterator
from itertools import pairwise

import numpy as np
import pygame
import pytest

from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.files.load import loads
from sandbox.trajectory import Contacts
from sandbox.window import sound
from sandbox.window.sound import (
    MAX_PITCH,
    MAX_SOUNDS_PER_CALL,
    MIN_PITCH,
    MIN_STRENGTH,
    PITCH_COUNT,
    SAMPLE_RATE,
    SOUND_DURATION,
    Sounds,
    impact_pitch,
    impact_sound,
    loudness,
    volume,
)

PITCHES = [float(MIN_PITCH * (MAX_PITCH / MIN_PITCH) ** (k / (PITCH_COUNT - 1))) for k in range(PITCH_COUNT)]


def bodies(radii: list[float], fixed: bool = False) -> Bodies:
    """Return balls of 1 kg in a row; the last one may be fixed."""
    text = "".join(
        f"[[ball]]\nposition = [{10 * k}, 0]\nradius = {radius}\nfixed = {str(fixed and k == len(radii) - 1).lower()}\n"
        for k, radius in enumerate(radii)
    )
    return loads(text).bodies


def touching(*rows: tuple[float, tuple[int, int], float]) -> Contacts:
    """Return contacts given by time, pair and magnitude of the impulse, N·s."""
    count = len(rows)
    impulse = np.zeros((count, 2))
    impulse[:, 1] = [row[2] for row in rows]
    return Contacts(
        np.array([row[0] for row in rows], np.float64),
        np.array([row[1] for row in rows], np.int64).reshape(-1, 2),
        np.zeros((count, 2)),
        np.tile([0.0, 1.0], (count, 1)),
        impulse,
    )


@pytest.fixture
def sounds() -> Iterator[Sounds]:
    sounds = Sounds()
    assert sounds.enable()
    yield sounds
    sounds.disable()
    assert pygame.mixer.get_init() is None


@pytest.mark.parametrize("pitch", PITCHES)
def test_spectrum_peaks_at_the_pitch(pitch: float) -> None:
    samples = impact_sound(pitch)
    spectrum = np.abs(np.fft.rfft(samples))
    peak = float(spectrum.argmax()) * SAMPLE_RATE / len(samples)
    assert abs(peak - pitch) <= 1.0 / SOUND_DURATION  # Hz, one line of this spectrum


@pytest.mark.parametrize("pitch", PITCHES[::9])
def test_samples_peak_at_six_tenths_of_full_scale(pitch: float) -> None:
    samples = impact_sound(pitch)
    assert samples.dtype == np.int16
    assert len(samples) == int(SOUND_DURATION * SAMPLE_RATE)
    assert int(np.abs(samples.astype(int)).max()) == round(0.6 * 32767)
    assert samples[0] == samples[-1] == 0  # no discontinuity, which would click


@pytest.mark.parametrize("pitch", PITCHES)
def test_envelope_decays(pitch: float) -> None:
    parts = np.abs(impact_sound(pitch).astype(float)).reshape(10, -1).max(axis=1)
    audible = parts[parts > 30]  # of 32,767: below, rounding to integers dominates
    assert (np.diff(audible) < 0).all()
    assert parts[-1] < 0.01 * parts[0]  # 40 dB


def test_pitch_falls_with_the_radius_and_stays_in_the_audible_range() -> None:
    pitches = [impact_pitch(radius) for radius in (1e-9, 0.01, 0.028575, 0.1, 0.5, 2.0, 1e9)]
    assert pitches == sorted(pitches, reverse=True)
    assert all(higher > lower for higher, lower in pairwise(pitches[1:6]))
    assert (pitches[0], pitches[-1]) == (pytest.approx(MAX_PITCH), pytest.approx(MIN_PITCH))
    assert impact_pitch(0.5) == pytest.approx(220.0, rel=0.06)  # half of a whole tone, to which pitches are rounded
    assert len({impact_pitch(radius) for radius in np.geomspace(1e-9, 1e9, 4000)}) == PITCH_COUNT


def test_impact_sound_is_deterministic() -> None:
    assert np.array_equal(impact_sound(440.0), impact_sound(440.0))


def test_loudness_uses_the_lighter_moving_body() -> None:
    balls = bodies([0.5, 0.2, 0.1], fixed=True)
    balls.mass[1] = 0.25
    contacts = touching((0.0, (0, 1), 1.0), (0.0, (1, 2), 1.0), (0.0, (0, -1), 1.0), (0.0, (0, -3), 2.0))
    strength, radius = loudness(contacts, balls)
    assert radius.tolist() == [0.2, 0.2, 0.5, 0.5]
    falls = [0.25 * (2 * 9.81 * 0.2) ** 0.5] * 2 + [(2 * 9.81 * 0.5) ** 0.5] * 2
    assert strength == pytest.approx(np.array([1.0, 1.0, 1.0, 2.0]) / falls, rel=1e-14)  # a few roundings


def test_fall_by_one_radius_is_audible_and_resting_contact_is_silent() -> None:
    fall, rest = 1.0 * (2 * 9.81 * 0.5) ** 0.5, 1.0 * 9.81 / 60
    strength, _ = loudness(touching((0.0, (0, -1), fall), (0.0, (0, -1), rest)), bodies([0.5]))
    assert strength[0] == pytest.approx(1.0, rel=1e-15)
    assert strength[1] < MIN_STRENGTH
    assert volume(4.0) == volume(1e9) == 1.0
    assert 0.0 < volume(0.2) < volume(1.0) < 1.0


def test_impulse_that_is_not_finite_is_silent() -> None:
    strength, _ = loudness(touching((0.0, (0, -1), np.nan), (0.0, (0, -1), np.inf)), bodies([0.5]))
    assert strength.tolist() == [0.0, 0.0]


def test_lasting_contact_is_played_once(sounds: Sounds) -> None:
    balls = bodies([0.5, 0.1])
    first = (0.1, (0, -1), 5.0)
    assert sounds.hits(touching(first), balls) == 1
    assert sounds.hits(touching(first), balls) == 0
    assert sounds.hits(touching(first, (0.2, (1, -1), 5.0)), balls) == 1
    assert sounds.hits(Contacts.none(), balls) == 0
    assert sounds.hits(touching((0.4, (0, -1), 5.0)), balls) == 1
    assert sounds.hits(touching((0.4, (0, -2), 5.0)), balls) == 1  # at the same time, another partner


def test_simultaneous_sounds_are_limited_and_distinct_in_pitch(sounds: Sounds) -> None:
    radii = [float(r) for r in np.geomspace(0.01, 10.0, 12)]
    balls = bodies([*radii, 0.01])
    crowd = [(0.1, (k, -1), 40.0 * float(np.sqrt(radius))) for k, radius in enumerate(radii)]
    assert sounds.hits(touching(*crowd), balls) == MAX_SOUNDS_PER_CALL
    assert sounds.hits(touching((0.2, (0, -1), 5.0), (0.2, (12, -1), 5.0)), balls) == 1  # equal radii share one sound
    assert len(sounds._sounds) <= MAX_SOUNDS_PER_CALL + 1


def test_sounds_are_limited_by_the_channels_of_the_mixer(sounds: Sounds, monkeypatch: pytest.MonkeyPatch) -> None:
    pygame.mixer.set_num_channels(3)
    balls = bodies([float(r) for r in np.geomspace(0.01, 10.0, 8)])
    crowd = touching(*((0.1, (k, -1), 1e3) for k in range(8)))
    assert sounds.hits(crowd, balls) == 3
    assert sounds.hits(touching((0.2, (0, -1), 1e3)), balls) == 0


def test_sounds_are_off_by_default() -> None:
    sounds = Sounds()
    assert not sounds.enabled
    assert sounds.hits(touching((0.1, (0, -1), 5.0)), bodies([0.5])) == 0
    assert pygame.mixer.get_init() is None
    sounds.disable()


def test_disabling_silences_and_enabling_plays_again(sounds: Sounds) -> None:
    hit = touching((0.1, (0, -1), 5.0))
    assert sounds.hits(hit, bodies([0.5])) == 1
    sounds.disable()
    assert sounds.hits(hit, bodies([0.5])) == 0
    assert sounds.enable()
    assert sounds.enable()
    assert sounds.hits(hit, bodies([0.5])) == 1


def test_mixer_opened_elsewhere_stays_open() -> None:
    pygame.mixer.init(22_050, -16, 1, 512, allowedchanges=0)
    try:
        sounds = Sounds()
        assert sounds.enable()
        assert sounds.hits(touching((0.1, (0, -1), 5.0)), bodies([0.5])) == 1
        (played,) = sounds._sounds.values()
        assert played.get_length() == pytest.approx(SOUND_DURATION, abs=1e-3)  # s, a few samples
        sounds.disable()
        assert pygame.mixer.get_init() == (22_050, -16, 1)
    finally:
        pygame.mixer.quit()


def test_missing_mixer_raises_no_exception(monkeypatch: pytest.MonkeyPatch) -> None:
    class Missing:
        def __getattr__(self, name: str) -> None:
            raise NotImplementedError("mixer module not available")

    monkeypatch.setattr(sound.pygame, "mixer", Missing())
    sounds = Sounds()
    assert not sounds.enable()
    assert (sounds.available, sounds.why) == (False, "no sound: mixer module not available")
    assert sounds.hits(touching((0.1, (0, -1), 5.0)), bodies([0.5])) == 0


NO_DEVICE = """
from sandbox.window.sound import Sounds
from sandbox.scene.files.load import loads
from sandbox.trajectory import Contacts
sounds = Sounds()
bodies = loads("[[ball]]\\nposition = [0, 0]\\nradius = 1").bodies
print(sounds.enable(), sounds.available, sounds.hits(Contacts.none(), bodies))
print(sounds.why)
sounds.disable()
"""


@pytest.mark.fail_slow(60)  # takes over half a second
def test_missing_audio_device_raises_no_exception() -> None:
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", NO_DEVICE],
        capture_output=True,
        text=True,
        env=os.environ | {"SDL_AUDIODRIVER": "impossible"},
        timeout=60,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "")
    first, why = done.stdout.splitlines()
    assert first == "False False 0"
    assert why.startswith("no sound: ")
    assert len(why) > len("no sound: ")
