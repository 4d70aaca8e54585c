"""Kicks: whether what only lies down on a surface that kicks would be taken for a hit."""

import math
from collections.abc import Iterator

import numpy as np

from sandbox.measure.forecast.warning import Warning, at_most
from sandbox.scene.meetings import Meetings
from sandbox.scene.model import Scene
from sandbox.scene.settings import Settings


def kick_warnings(scene: Scene, settings: Settings, meet: Meetings) -> Iterator[Warning]:
    """Yield a warning where a step of gravity alone makes what comes to lie as fast as a hit.

    Contacts are found at the end of a substep: until then what touches has fallen on, by g·h more.
    """
    fall = math.hypot(*scene.world.gravity) * settings.h
    touched = meet.touching.any(axis=1)
    for name, number in zip(scene.fixed_names, meet.surfaces.of_fixed.tolist(), strict=False):  # pockets come last
        kick = meet.surfaces.surfaces[number].kick
        if kick is not None and bool(np.asarray(touched)[number]) and fall >= kick.threshold:
            safe = settings.dt * kick.threshold / fall
            message = (
                f"{name!r} kicks what closes at {kick.threshold:g} m/s, which a substep of gravity gives to what only "
                f"comes to lie there; dt < {at_most(safe)} s, or a higher threshold, would be safe"
            )
            yield Warning("kick_threshold", message, {"thing": name, "threshold": kick.threshold, "fall": fall})
