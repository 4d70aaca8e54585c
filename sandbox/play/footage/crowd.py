"""Crowd: the place where a run happens, for a camera to show it whole."""

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.play.camera import Box
from sandbox.play.framing import ANCHORED
from sandbox.scene.scene import Scene

STRAY = 3.0
"""Sizes of the middle of a crowd that a body may go beyond it and still be shown."""


def crowd(position: FloatArray, radius: FloatArray, anchors: FloatArray) -> Box:
    """Return the box that a crowd moves in, m, leaving out those who stray.

    Args:
        position: (T, N, 2) m; what is not finite counts nothing.
        radius: (N,) m
        anchors: (K, 2) m, places of fixed things, shown where they are not far from the crowd.
    """
    lower, upper = np.fmin.reduce(position, axis=0), np.fmax.reduce(position, axis=0)
    fine = np.isfinite(lower).all(axis=1) & np.isfinite(upper).all(axis=1)
    lower, upper = lower[fine] - radius[fine, None], upper[fine] + radius[fine, None]
    if not len(lower) and not len(anchors):
        return (-1.0, -1.0), (1.0, 1.0)
    corners = np.concatenate((lower, upper)) if len(lower) else anchors
    middle = np.percentile(corners, (10.0, 90.0), axis=0)
    with np.errstate(over="ignore"):  # of a run that diverged
        reach = STRAY * max(float((middle[1] - middle[0]).max()), 1e-9)
    both = np.concatenate((corners, anchors))
    kept = both[((both >= middle[0] - reach) & (both <= middle[1] + reach)).all(axis=1)]
    if not len(kept):
        kept = middle
    (left, bottom), (right, top) = kept.min(axis=0).tolist(), kept.max(axis=0).tolist()
    return (left, bottom), (right, top)


def anchors_of(scene: Scene) -> FloatArray:
    """Return the places of fixed things, (K, 2) m: ends of walls, edges of posts, nails of joints; of planes none."""
    places = [point for wall in scene.walls for point in wall.points]
    for post in scene.posts:
        (x, y), r = post.position, post.radius
        places += [(x - r, y - r), (x + r, y + r)]
    links = scene.links.some((scene.links.a < 0) & np.isin(scene.links.kind, ANCHORED))
    places += [(x, y) for x, y in links.anchor_a.tolist()]
    return np.asarray(places, np.float64).reshape(-1, 2)
