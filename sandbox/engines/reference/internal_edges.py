"""Internal edges: contacts of polygons near the joints of a wall, which are no edges of it.

Each segment stores how its wall runs on from its ends. A normal that leans over an end, towards where the wall runs on,
cannot occur on the whole wall: the neighbour is nearer. The contact of a polygon whose normal is nearer to the
neighbour's, and that lies deeper in the segment's own face, is left to the neighbour. Otherwise the contact is found
anew on that face, as if the segment were longer. For discs see `manifold.is_covered`.

Compare Bullet's `btInternalEdgeUtility` and the ghost vertices of Box2D's chain shapes.
"""

import math

from sandbox.arrays import FloatArray
from sandbox.engines.common.colliders import LEAN, SIDEWAYS
from sandbox.engines.common.kernel import bare_kernel as kernel
from sandbox.engines.reference.polygon import ROUGH, clip, face_at, write

FAVOUR = 5e-4
"""Part of a segment's length by which a piece may lie deeper in its face: as much as `polygon.FAVOUR` ignores."""


@kernel
def smooth(
    corner: FloatArray,
    start: int,
    end: int,
    radius: float,
    a: int,
    wall_radius: float,
    joints: FloatArray,
    count: int,
    reach: float,
    out: FloatArray,
) -> int:
    """Mend the contact of a piece of two corners or more with a segment of a wall; return how many points it has then.

    Args:
        corner: (V, 2) of all pieces, m.
        start: row of the piece's first corner.
        end: row after its last.
        radius: of the piece, m.
        a: row of the segment's first end; the other follows.
        wall_radius: half the wall's thickness, m.
        joints: (4,) m, as in `StaticColliders.joints`.
        count: how many points were found.
        reach: separation from which on nothing is a contact, m.
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
    if ux * jx + uy * jy <= LEAN * beyond:  # so it is where the wall ends
        return count
    # Of which side's faces it is
    side = uy * tx - ux * ty
    if abs(side) < SIDEWAYS:
        low, high = math.inf, -math.inf
        for k in range(start, end):
            height = (corner[k, 1] - corner[a, 1]) * tx - (corner[k, 0] - corner[a, 0]) * ty
            low, high = min(low, height), max(high, height)
        side = low + high
    side = 1.0 if side >= 0.0 else -1.0
    own = side * (uy * tx - ux * ty)
    its = side * sign * (uy * jx - ux * jy) / beyond
    deepest = out[0, 2] if count == 1 else min(out[0, 2], out[1, 2])
    one, two = (a + 1, a) if side > 0.0 else (a, a + 1)
    count = _collide_face(corner, start, end, radius, one, two, wall_radius, reach, out)
    if its > own + LEAN:
        for row in range(count):
            if out[row, 2] < deepest - FAVOUR * length:
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
    reach: float,
    out: FloatArray,
) -> int:
    """Write where a piece touches a face that runs from `one` to `two`, solid to the left; return how many points."""
    nx, ny = corner[two, 1] - corner[one, 1], corner[one, 0] - corner[two, 0]
    length = math.sqrt(nx * nx + ny * ny)
    nx, ny = nx / length, ny / length
    low, lowest = math.inf, start
    for k in range(start, end):
        height = nx * corner[k, 0] + ny * corner[k, 1]
        if height < low:
            low, lowest = height, k
    incident, other = face_at(corner, start, end, lowest, -nx, -ny)
    slack = ROUGH * (abs(corner[one, 0]) + abs(corner[one, 1]))
    over, begin_x, begin_y, begin, end_x, end_y, finish = clip(corner, one, two, incident, other, slack)
    if not over:
        return 0
    wide, count = radius + wall_radius, 0
    for row in range(1 if incident == other else 2):
        x, y, height = (end_x, end_y, finish) if row == 0 else (begin_x, begin_y, begin)
        if height - wide < reach:
            middle = 0.5 * (height + radius - wall_radius)
            write(out, count, -nx, -ny, height - wide, x - nx * middle, y - ny * middle, float(row))
            count += 1
    return count
