"""Kicks: whether what only lies down on a surface that kicks would be taken for a hit."""

import math
from collections.abc import Iterator

import numpy as np

from sandbox.measure.forecast.warning import Warning, at_most
from sandbox.scene.compile.contacts import ContactMatrix
from sandbox.scene.description.world import Settings
from sandbox.scene.scene import Scene


def kick_warnings(scene: Scene, settings: Settings, meet: ContactMatrix) -> Iterator[Warning]:
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
                f"{name!r} kicks bodies that approach at {kick.threshold:g} m/s, which one substep of gravity gives to "
                f"a body that rests there; use dt < {at_most(safe)} s or a higher threshold"
            )
            yield Warning("kick_threshold", message, {"thing": name, "threshold": kick.threshold, "fall": fall})
