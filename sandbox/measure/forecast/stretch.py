"""Stretch: how far chains give way whose joints are held by positions.

Relaxation, XPBD and RATTLE put each joint right in turn, and pass on in each pass only a part of what all below it
fell in the substep, g·h². Measured on the reference, chains of 10 to 100 rods of 0.1 m that hang at rest, 60 and 240
Hz, 2 to 50 iterations: the uppermost gives way by c·n·g·h²/iterations, c = 0.8 to 1.8, which grows with n/iterations.
"""

import math
from collections.abc import Iterator

import numpy as np

from sandbox.measure.forecast.warning import Figures, Warning, at_most
from sandbox.scene.compile.joint_arrays import LinkKind
from sandbox.scene.description.world import Settings
from sandbox.scene.scene import Scene

GIVING = 1.6
"""c, as above."""
TOO_FAR = 0.01
"""The share of its length by which a joint may be off."""


def stretch_warnings(scene: Scene, settings: Settings) -> Iterator[Warning]:
    """Yield a warning where the rods of a hanging chain, held by positions, give way by more than `TOO_FAR`."""
    pull = math.hypot(*scene.world.gravity)
    if settings.joints not in ("relaxation", "xpbd", "rattle") or pull == 0.0:
        return
    links, deep = scene.links.of(LinkKind.ROD), 0
    if not len(links):
        return
    still = np.append(scene.bodies.fixed, True)  # the world is −1, the last
    reached = still.copy()
    while True:  # one joint farther from what stands still each time
        fresh = reached[links.a] ^ reached[links.b]
        if not fresh.any():
            break
        deep += 1
        reached[links.a[fresh]] = reached[links.b[fresh]] = True
    length = float(links.figures[:, 0].min())
    share = GIVING * deep * pull * settings.h**2 / settings.iterations / length if length > 0.0 else 0.0
    if share > TOO_FAR:
        more = share / TOO_FAR
        iterations, dt = math.ceil(settings.iterations * more), settings.dt / math.sqrt(more)
        message = (
            f"a chain with {links.names[0]!r} hangs {deep:,} joints deep; {settings.joints} with {settings.iterations} "
            f"iterations every {settings.h:.3g} s stretches it by {share:.2g} of a joint's length; "
            f"solver.iterations >= {iterations:,} or dt <= {at_most(dt)} s keeps that to {TOO_FAR:g}"
        )
        figures: Figures = {"joints": deep, "joint": links.names[0], "share": share, "safe_dt": dt}
        yield Warning("chain", message, figures)
