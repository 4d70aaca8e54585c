"""Entries: who may fly through a zone without being noted, as its centre is inside at the end of no substep."""

from collections.abc import Iterator

import numpy as np

from sandbox.measure.forecast.speeds import top_speeds
from sandbox.measure.forecast.warning import ROUNDING, Warning, at_most
from sandbox.scene.compile.contacts import ContactMatrix, reach
from sandbox.scene.description.fixed import mask_of
from sandbox.scene.description.world import Settings
from sandbox.scene.geometry.shapes import width_of
from sandbox.scene.scene import Scene


def entry_warnings(scene: Scene, settings: Settings, meet: ContactMatrix) -> Iterator[Warning]:
    """Yield a warning for each zone that the fastest body can fly through, where it is narrowest, in a substep."""
    noted = np.flatnonzero(meet.can_enter_zone)
    if not len(noted):
        return
    speeds, layers = top_speeds(scene, meet)[noted], reach(scene, scene.bodies)[noted]
    names = scene.fixed_names[len(scene.fixed) + len(scene.pockets) :]
    for zone, name in zip(scene.zones, names, strict=True):
        able = np.flatnonzero(layers & mask_of(zone.layers, scene.layers))
        if not len(able):
            continue
        k = int(able[np.argmax(speeds[able])])
        who, speed, width = scene.bodies.names[noted[k]], float(speeds[k]), width_of(zone)
        odds = 1.0 - width / (speed * settings.h) if speed > 0.0 else 0.0
        if odds <= ROUNDING:
            continue
        safe = width / speed * settings.substeps
        message = (
            f"{who!r} can reach {speed:.4g} m/s, {speed * settings.h:.3g} m per substep, and pass through the zone "
            f"{name!r}, {width:.3g} m wide at its narrowest, undetected: odds up to {100 * odds:.3g} %; "
            f"dt <= {at_most(safe)} s is safe"
        )
        yield Warning("entry", message, {"ball": who, "thing": name, "speed": speed, "odds": odds, "safe_dt": safe})
