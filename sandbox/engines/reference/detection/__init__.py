"""Detections: how a substep looks for contacts. DETECTIONS is the table of them.

Each advances a stage by h, spelled of the same verbs: move, look, resolve.
"""

from sandbox.engines.reference.detection.bisect import bisect
from sandbox.engines.reference.detection.discrete import discrete
from sandbox.engines.reference.detection.shrink import shrink
from sandbox.engines.reference.detection.swept import swept
from sandbox.engines.reference.stage import Detection

DETECTIONS: dict[str, Detection] = {
    "discrete": discrete,
    "bisect": bisect,
    "swept": swept,
    "shrink": shrink,
}
