"""Claims: the keys that a scene takes for itself, and what they do."""

from collections.abc import Iterator
from functools import partial
from typing import NamedTuple

import pygame

from sandbox.action import Action, Drive, Throttle
from sandbox.play import cue_keys
from sandbox.play.billiards.gestures import Gestures
from sandbox.play.cue_keys import Deed
from sandbox.play.hands import Hands
from sandbox.play.hosting import control_keys
from sandbox.play.hosting.host import Host
from sandbox.play.running.live import Live
from sandbox.scene.compile.drives import names_of
from sandbox.scene.description.scene import default_name
from sandbox.scene.scene import Scene

ARROWS = {
    pygame.K_LEFT: (-1.0, 0.0),
    pygame.K_RIGHT: (1.0, 0.0),
    pygame.K_UP: (0.0, 1.0),
    pygame.K_DOWN: (0.0, -1.0),
}

KEYS = {
    "left": pygame.K_LEFT,
    "right": pygame.K_RIGHT,
    "up": pygame.K_UP,
    "down": pygame.K_DOWN,
    "space": pygame.K_SPACE,
    "left shift": pygame.K_LSHIFT,
    "right shift": pygame.K_RSHIFT,
    "z": pygame.K_z,
    "slash": pygame.K_SLASH,
    "return": pygame.K_RETURN,
}
"""The keys that thrusts and drives may have, as scenes call them."""


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
        told.append(("Space", f"relaunch {generator}"))
    releases: dict[int, Deed] = {}
    played, played_out = ({}, {}) if host is None else control_keys.deeds(host)
    for called, verb, pressed, released in held(scene):
        key = KEYS[called]
        if key in played:  # it is the rules' to press
            continue
        deeds[key] = partial(_act, action=pressed, also=deeds.get(key))
        releases[key] = partial(_act, action=released, also=releases.get(key))
        told.append((called.capitalize(), verb))
    if host is not None:
        deeds |= played
        releases |= played_out
        told += control_keys.told(host.controls)
    if gestures is not None:
        cue, let_go = cue_keys.deeds(gestures)
        deeds |= cue
        releases |= let_go
        told += cue_keys.TOLD
    return Claims(deeds, tuple(told), releases)


def held(scene: Scene) -> Iterator[tuple[str, str, Action, Action]]:
    """Yield the keys that a scene's thrusts and drives have, what each does, and the actions of both its ends."""
    for k, thrust in enumerate(scene.thrusts):
        if thrust.key is not None:
            name = thrust.name or default_name("thrust", k)
            opened, closed = (Throttle(time=0.0, thrust=name, level=level) for level in (1.0, 0.0))
            yield thrust.key, f"fire {name}", opened, closed
    for drive, name in zip(scene.drives, names_of(scene), strict=True):
        if drive.key is not None:
            on, off = (Drive(time=0.0, drive=name, level=level) for level in (1.0, 0.0))
            yield drive.key, f"drive {name}", on, off


def _act(live: Live, action: Action, also: Deed | None) -> None:
    """Do what a key asks for, after another thing that has the same key."""
    if also is not None:
        also(live)
    live.act(action)


def _shift(live: Live, hands: Hands, body: str, by: tuple[float, float]) -> None:
    hands.shift(live, body, by)


def _relaunch(live: Live, generator: str) -> None:
    live.relaunch(generator)
