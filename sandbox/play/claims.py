"""Claims: the keys that a scene takes for itself, and what they do."""

from functools import partial
from typing import NamedTuple

import pygame

from sandbox.action import Throttle
from sandbox.play import cue_keys
from sandbox.play.billiards.gestures import Gestures
from sandbox.play.cue_keys import Deed
from sandbox.play.hands import Hands
from sandbox.play.hosting import control_keys
from sandbox.play.hosting.host import Host
from sandbox.play.running.live import Live
from sandbox.scene.model import Scene, default_name

ARROWS = {
    pygame.K_LEFT: (-1.0, 0.0),
    pygame.K_RIGHT: (1.0, 0.0),
    pygame.K_UP: (0.0, 1.0),
    pygame.K_DOWN: (0.0, -1.0),
}

KEYS = {"left": pygame.K_LEFT, "right": pygame.K_RIGHT, "up": pygame.K_UP, "down": pygame.K_DOWN}


class Claims(NamedTuple):
    """What a scene's `[play]` asks for."""

    deeds: dict[int, Deed]
    """by key"""
    told: tuple[tuple[str, str], ...]
    """keys and what they do, as help names them"""
    releases: dict[int, Deed]
    """by key, what is done when it is let go"""

    def deed(self, key: int, again: bool) -> Deed | None:
        """Return what a key does; held, and so pressed again and again, only arrows that move something go on."""
        return None if again and (key not in ARROWS or key in self.releases) else self.deeds.get(key)


def claims(scene: Scene, hands: Hands, gestures: Gestures | None = None, host: Host | None = None) -> Claims:
    """Return the keys that a scene claims, those of a table or of a game's controls among them."""
    deeds: dict[int, Deed] = {}
    told: list[tuple[str, str]] = []
    body, step, generator = scene.play.arrows, scene.play.arrow_step, scene.play.relaunch
    if body is not None:
        for key, (x, y) in ARROWS.items():
            deeds[key] = partial(_shift, hands=hands, body=body, by=(x * step, y * step))
        told.append(("Arrows", f"move {body} by {step:g} m"))
    if generator is not None:
        deeds[pygame.K_SPACE] = partial(_relaunch, generator=generator)
        told.append(("Space", f"launch {generator} again"))
    releases: dict[int, Deed] = {}
    played, played_out = ({}, {}) if host is None else control_keys.deeds(host)
    for k, thrust in enumerate(scene.thrusts):
        if thrust.key is not None and KEYS[thrust.key] not in played:  # else it is the rules' to fire
            name = thrust.name or default_name("thrust", k)
            key = KEYS[thrust.key]
            deeds[key] = partial(_throttle, thrust=name, level=1.0, also=deeds.get(key))
            releases[key] = partial(_throttle, thrust=name, level=0.0, also=releases.get(key))
            told.append((thrust.key.capitalize(), f"fire {name}"))
    if host is not None:
        deeds |= played
        releases |= played_out
        told += control_keys.told(host.controls)
    if gestures is not None:
        pressed, released = cue_keys.deeds(gestures)
        deeds |= pressed
        releases |= released
        told += cue_keys.TOLD
    return Claims(deeds, tuple(told), releases)


def _throttle(live: Live, thrust: str, level: float, also: Deed | None) -> None:
    """Open or close a thrust, after another that has the same key."""
    if also is not None:
        also(live)
    live.act(Throttle(time=0.0, thrust=thrust, level=level))


def _shift(live: Live, hands: Hands, body: str, by: tuple[float, float]) -> None:
    hands.shift(live, body, by)


def _relaunch(live: Live, generator: str) -> None:
    live.relaunch(generator)
