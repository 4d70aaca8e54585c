"""Settings of solvers: common defaults, and why an engine does not support a setting that is stated."""

from collections.abc import Mapping

import numpy as np

from sandbox.scene.compile.setup import Setup
from sandbox.scene.description.world import MAX_SLOP, Settings

SLOP_PER_RADIUS = 0.01
"""Default slop as a fraction of the smallest radius or half width. pymunk's default of 0.1 m would let a ball of 5 cm
rest 10 cm deep."""

BIAS = (1.0 - 0.1) ** 60
"""pymunk's default: a tenth of an overlap is corrected in 1/60 s."""

OWN_SETTINGS = {
    "half_kick": ("pymunk",),
    "continuous": ("box2d",),
    "workers": ("box2d",),
    "sleeping": ("pymunk", "box2d"),
    "sleep_time": ("pymunk",),
    "idle_speed": ("pymunk",),
}
"""Settings that only some engines have, and these"""


def setting_faults(
    settings: Settings, engine: str, fixed: Mapping[str, object], absent: Mapping[str, str], where: str = ""
) -> list[str]:
    """Return why settings that are stated are not supported by an engine, whatever the scene.

    Args:
        settings: as stated; None where nothing is.
        engine: name of the engine.
        fixed: the only value of a setting that the engine supports.
        absent: why the engine does not have a setting.
        where: scenes for which the only value holds.
    """
    stated = {key: value for key, value in settings.model_dump().items() if value is not None}
    if not settings.half_kick:
        del stated["half_kick"]  # its default
    faults = [
        f"{key} {stated[key]!r} is not supported{where} (only {value!r})"
        for key, value in fixed.items()
        if key in stated and stated[key] != value
    ]
    faults += [f"{key} {stated[key]!r} is not supported ({why})" for key, why in absent.items() if key in stated]
    return faults + [
        f"{key} applies to {' and '.join(engines)} only; remove it"
        for key, engines in OWN_SETTINGS.items()
        if engine not in engines and key in stated and key not in absent
    ]


def slop_of(setup: Setup) -> float:
    """Return the default slop, m: the overlap that is not corrected.

    It follows from the thinnest body that can collide.
    """
    bodies = setup.bodies
    can_collide = np.asarray([e.collides != "none" for e in bodies.elements], dtype=bool)[bodies.element]
    min_thickness = float(bodies.thin[can_collide].min()) if can_collide.any() else 1.0
    return min(SLOP_PER_RADIUS * min_thickness, MAX_SLOP)
