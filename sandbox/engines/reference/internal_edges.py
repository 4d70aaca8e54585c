"""Internal edges: corrects contacts of polygons at the joints of a wall, which are not edges of the wall.

Each segment stores the directions in which its wall continues at its ends. A normal that leans over an end, towards the
continuation, cannot occur on the whole wall, because the neighbour is nearer. Such a contact is computed again on the
segment's own face, as if the segment were longer. If the normal is nearer to the neighbour's and the contact is deeper
in the segment's own face, it is dropped: the neighbouring segment has it. For discs see `manifold.is_covered`.

Compare Bullet's `btInternalEdgeUtility` and the ghost vertices of Box2D's chain shapes.
"""

import math

from sandbox.arrays import FloatArray
from sandbox.engines.common.colliders import LEAN
from sandbox.engines.common.geometry import is_left_of_bend
from sandbox.engines.common.kernel import bare_kernel as kernel
from sandbox.engines.reference.polygon import DEGENERATE, clip, face_at, write_point

DEPTH_TOLERANCE = 5e-4
"""Depth difference, as a fraction of the segment's length, that is ignored; equal to `polygon.REFERENCE_FACE_BIAS`"""


@kernel
def correct_internal_edge(
    corner: FloatArray,
    start: int,
    end: int,
    radius: float,
    a: int,
    wall_radius: float,
    joints: FloatArray,
    count: int,
    max_separation: float,
    out: FloatArray,
) -> int:
    """Correct the contact of a piece of two corners or more with a segment of a wall; return its number of points.

    Args:
        corner: (V, 2) of all pieces, m.
        start: row of the piece's first corner.
        end: row after its last corner.
        radius: of the piece, m.
        a: row of the segment's first end; its second end follows.
        wall_radius: half the wall's thickness, m.
        joints: (4,) m, as in `StaticColliders.joints`.
        count: number of points found.
        max_separation: contacts have a smaller separation, m.
        out: (2, 6) the points; written to.
    """
    ux, uy = -out[0, 0], -out[0, 1]  # from the wall to the piece
    tx, ty = corner[a + 1, 0] - corner[a, 0], corner[a + 1, 1] - corner[a, 1]
    length = math.sqrt(tx * tx + ty * ty)
    tx, ty = tx / length, ty / length
    lean = ux * tx + uy * ty
    if lean > LEAN:
        jx, jy, sign = joints[2], joints[3], 1.0
    elif lean < -LEAN:
        jx, jy, sign = joints[0], joints[1], -1.0
    else:
        return count
    beyond = math.sqrt(jx * jx + jy * jy)
    if ux * jx + uy * jy <= LEAN * beyond:  # also at the end of a wall, where it is 0
        return count
    # The normal does not show on which side of the wall the piece is: it may be that of one of the piece's faces.
    x, y = 0.0, 0.0
    for k in range(start, end):
        x, y = x + corner[k, 0], y + corner[k, 1]
    joint = a + 1 if lean > 0.0 else a
    x, y = x / (end - start) - corner[joint, 0], y / (end - start) - corner[joint, 1]
    is_left = is_left_of_bend(x, y, tx, ty, jx, jy) if lean > 0.0 else is_left_of_bend(x, y, -jx, -jy, tx, ty)
    side = 1.0 if is_left else -1.0
    own = side * (uy * tx - ux * ty)
    its = side * sign * (uy * jx - ux * jy) / beyond
    deepest = out[0, 2] if count == 1 else min(out[0, 2], out[1, 2])
    one, two = (a + 1, a) if side > 0.0 else (a, a + 1)
    count = _collide_face(corner, start, end, radius, one, two, wall_radius, max_separation, out)
    if its > own + LEAN:
        for row in range(count):
            if out[row, 2] < deepest - DEPTH_TOLERANCE * length:
                return 0
    return count


@kernel
def _collide_face(
    corner: FloatArray,
    start: int,
    end: int,
    radius: float,
    one: int,
    two: int,
    wall_radius: float,
    max_separation: float,
    out: FloatArray,
) -> int:
    """Write the contact of a piece with a face from `one` to `two`, solid to its left; return the number of points."""
    nx, ny = corner[two, 1] - corner[one, 1], corner[one, 0] - corner[two, 0]
    length = math.sqrt(nx * nx + ny * ny)
    nx, ny = nx / length, ny / length
    low, lowest = math.inf, start
    for k in range(start, end):
        height = nx * corner[k, 0] + ny * corner[k, 1]
        if height < low:
            low, lowest = height, k
    incident, other = face_at(corner, start, end, lowest, -nx, -ny)
    slack = DEGENERATE * (abs(corner[one, 0]) + abs(corner[one, 1]))
    over, begin_x, begin_y, begin, end_x, end_y, finish = clip(corner, one, two, incident, other, slack)
    if not over:
        return 0
    radii, count = radius + wall_radius, 0
    for row in range(1 if incident == other else 2):
        x, y, height = (end_x, end_y, finish) if row == 0 else (begin_x, begin_y, begin)
        if height - radii < max_separation:
            middle = 0.5 * (height + radius - wall_radius)
            write_point(out, count, -nx, -ny, height - radii, x - nx * middle, y - ny * middle, float(row))
            count += 1
    return count
