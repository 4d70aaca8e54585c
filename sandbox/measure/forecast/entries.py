"""Entries: who may fly through a zone without being noted, as its centre is inside at the end of no substep."""

from collections.abc import Iterator

import numpy as np

from sandbox.measure.forecast.speeds import top_speeds
from sandbox.measure.forecast.warning import ROUNDING, Warning, at_most
from sandbox.scene.meetings import Meetings, reach
from sandbox.scene.model import Scene
from sandbox.scene.precinct import width_of
from sandbox.scene.settings import Settings
from sandbox.scene.zone import mask_of


def entry_warnings(scene: Scene, settings: Settings, meet: Meetings) -> Iterator[Warning]:
    """Yield a warning for each zone that the fastest body can fly through, where it is narrowest, in a substep."""
    noted = np.flatnonzero(meet.noted)
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
            f"{who!r} can get to {speed:.4g} m/s, {speed * settings.h:.3g} m a substep, and fly through the zone "
            f"{name!r}, {width:.3g} m wide where it is narrowest, without being noted: odds up to {100 * odds:.3g} %; "
            f"dt <= {at_most(safe)} s would be safe"
        )
        yield Warning("entry", message, {"ball": who, "thing": name, "speed": speed, "odds": odds, "safe_dt": safe})
