"""Replay: a scene and the runs of several engines, encoded for the canvas that `replay.js` draws.

At most `MAX_FRAMES` frames are kept, and fewer, down to `MIN_FRAMES`, until all tracks fit into `BUDGET`. Of more than
`MAX_BODIES` bodies a part is drawn. The page states what is omitted.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from markupsafe import Markup

from sandbox.arrays import FloatArray, IntArray
from sandbox.formatting import format_plural
from sandbox.report.html.page import fragment
from sandbox.report.html.replay_data import (
    ABSENT,
    QuantisationBox,
    compress,
    encode_angles,
    encode_positions,
    quantisation_box,
    static_geometry,
    viewport,
)
from sandbox.scene.compile.scene import Scene
from sandbox.trajectory import Trajectory

MAX_FRAMES = 600
MIN_FRAMES = 75
MAX_BODIES = 2000
BUDGET = 700_000
"""Characters of all tracks together."""
TARGET_DURATION = 8.0
"""Approximate duration of the replay at its initial speed, s."""
SPEEDS = (0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.25, 0.5, 1.0, 2.0, 4.0, 10.0, 25.0)
TRUTH = "truth"
"""Name and class of the track of the truth."""


@dataclass(frozen=True, eq=False)
class Track:
    """One run of a replay."""

    name: str
    css_class: str
    """class that has its colour: `e0`, `e1`, … for engines, `truth`"""
    run: Trajectory
    error: tuple[FloatArray, FloatArray] | None = None
    """times (K,), s, and position errors (K,), m, shown in the legend"""
    value: float | None = None
    """value of the swept key, selected by a slider; None: always shown"""


def replay(scene: Scene, tracks: Sequence[Track], trusted_until: float | None, swept: str | None = None) -> Markup:
    """Return the canvas with its controls, legend and data.

    Args:
        scene: scene of all runs.
        tracks: tracks in the order in which they are drawn; the truth last.
        trusted_until: time until which the truth is trusted, s.
        swept: swept key, whose values a slider selects; the tracks have the values.
    """
    document = replay_document(scene, tracks, trusted_until, swept)
    names = ", ".join(track.name for track in tracks)
    return fragment("replay.html.j2", "replay", scene.title or "this scene", names, tracks, SPEEDS, document)


def replay_document(
    scene: Scene, tracks: Sequence[Track], trusted_until: float | None, swept: str | None = None
) -> dict[str, Any]:
    """Return the data of the canvas as JSON: static geometry, tracks, times, and a note on omitted parts."""
    moving = np.flatnonzero(~scene.bodies.fixed)
    drawn = moving[:: max(1, math.ceil(len(moving) / MAX_BODIES))]
    trusted = [track.run for track in tracks if track.css_class == TRUTH] or [track.run for track in tracks]
    view = viewport(scene, [run.position for run in trusted])
    box = quantisation_box(view)
    has_angles = _has_visible_rotation(scene, tracks, drawn)
    longest = max((track.run.time for track in tracks), key=len, default=np.empty(0))
    time, texts = _encoded(tracks, longest, drawn, has_angles, box)
    origin = (box.x + 0.5 * box.side, box.y + 0.5 * box.side)
    notes = []
    if len(drawn) < len(moving):
        notes.append(f"{len(drawn):,} of {format_plural(len(moving), 'body', 'bodies')} are drawn")
    if len(time) < len(longest):
        notes.append(f"{len(time):,} of {len(longest):,} frames are kept; the replay interpolates between them")
    return {
        "geometry": static_geometry(scene, drawn, origin),
        "tracks": [
            {
                "name": track.name,
                "css_class": track.css_class,
                "codes": text,
                "errors": _errors(track, time),
                "breaks": _breaks(track.run, scene),
                "value": track.value,
                "shape": None,
                "absent": {},
                "marks": [],
            }
            for track, text in zip(tracks, texts, strict=True)
        ],
        "has_angles": has_angles,
        "bodies": len(drawn),
        "time": [float(f"{t:.9g}") for t in time.tolist()],
        "duration": scene.world.duration,
        "start": 0.0,
        "panes": None,
        "unit": "m",
        "mark_time": 0.0,
        "trusted_until": trusted_until,
        "step": box.step,
        "half": 0.5 * box.side,
        "view": [view[0] - origin[0], view[1] - origin[1], view[2] - origin[0], view[3] - origin[1]],
        "speed": initial_speed(scene.world.duration),
        "note": "; ".join(notes),
        "swept": swept,
        "values": sorted({track.value for track in tracks if track.value is not None}),
    }


def _encoded(
    tracks: Sequence[Track], longest: FloatArray, drawn: IntArray, has_angles: bool, box: QuantisationBox
) -> tuple[FloatArray, list[str]]:
    """Return the times of as many frames as the budget allows, and the encoded tracks at these times."""
    max_frames = MAX_FRAMES
    while True:
        time = longest[evenly_spread(len(longest), max_frames)]
        texts = [_encode(track, time, drawn, has_angles, box) for track in tracks]
        if sum(map(len, texts)) <= BUDGET or max_frames <= MIN_FRAMES:
            return time, texts
        max_frames = max(MIN_FRAMES, max_frames // 2)


def evenly_spread(count: int, max_frames: int) -> IntArray:
    """Return the indices of at most `max_frames` frames, evenly spread, with the first and the last one."""
    return np.unique(np.rint(np.linspace(0, max(count - 1, 0), min(count, max_frames))).astype(np.int64))


def _encode(track: Track, time: FloatArray, drawn: IntArray, has_angles: bool, box: QuantisationBox) -> str:
    """Return the positions, and angles, of the drawn bodies at some times, as text."""
    run = track.run
    if not len(run.time):
        return compress(np.full((len(time), len(drawn), 3 if has_angles else 2), ABSENT, np.uint16))
    before, weight = _neighbours(run.time, time)
    retired = run.retired_time[drawn]
    known = time <= run.time[-1] + _half_interval(time)
    present = known[:, None] & (np.isnan(retired) | (time[:, None] < retired))
    codes = encode_positions(_blended(run.position[:, drawn], before, weight), present, box)
    if has_angles:
        angles = encode_angles(_blended(run.angle[:, drawn], before, weight))
        codes = np.concatenate((codes, angles[..., None]), axis=2)
    return compress(codes)


def _neighbours(times: FloatArray, wanted: FloatArray) -> tuple[IntArray, FloatArray]:
    """Return for each wanted time the index of the frame before it, and the weight of the frame after it.

    A run with a longer step than the replay has fewer frames; its bodies move in straight lines between them.
    """
    if len(times) < 2:
        return np.zeros(len(wanted), np.int64), np.zeros(len(wanted))
    before = np.searchsorted(times, wanted).clip(1, len(times) - 1) - 1
    weight = (wanted - times[before]) / (times[before + 1] - times[before])
    return before, np.clip(weight, 0.0, 1.0)


def _blended(values: FloatArray, before: IntArray, weight: FloatArray) -> FloatArray:
    """Return values (T, …) between the frames `before` and the next ones; a frame of weight 0 does not matter."""
    shape = (-1,) + (1,) * (values.ndim - 1)
    first, second = values[before], values[np.minimum(before + 1, len(values) - 1)]
    fraction = weight.reshape(shape)
    with np.errstate(invalid="ignore", over="ignore"):
        mixed = first + fraction * (second - first)
    return np.where(fraction == 0.0, first, np.where(fraction == 1.0, second, mixed))


def _nearest(times: FloatArray, wanted: FloatArray) -> IntArray:
    """Return the index of the nearest of the ascending times for each wanted one."""
    if len(times) < 2:
        return np.zeros(len(wanted), np.int64)
    after = np.searchsorted(times, wanted).clip(1, len(times) - 1)
    return np.where(np.abs(times[after - 1] - wanted) <= np.abs(times[after] - wanted), after - 1, after)


def _half_interval(time: FloatArray) -> float:
    """Return half the interval of frames, s: the largest error of the time at which a frame of a run is shown."""
    return 0.5 * float(np.median(np.diff(time))) if len(time) > 1 else math.inf


def _has_visible_rotation(scene: Scene, tracks: Sequence[Track], drawn: IntArray) -> bool:
    """Return whether any of the drawn bodies rotates visibly."""
    if not len(drawn):
        return False
    if not scene.bodies.round[drawn].all() or scene.bodies.angle[drawn].any():
        return True
    return any(bool(np.any(track.run.angular_velocity[:, drawn])) for track in tracks)


def _errors(track: Track, time: FloatArray) -> list[float | None] | None:
    """Return the error at each time, to three digits; None where it is unknown."""
    if track.error is None or not len(track.error[0]):
        return None
    times, values = track.error
    nearest = _nearest(times, time)
    known = np.abs(times[nearest] - time) <= max(_half_interval(time), _half_interval(times))
    found = zip(known.tolist(), values[nearest].tolist(), strict=True)
    return [float(f"{value:.3g}") if is_known and math.isfinite(value) else None for is_known, value in found]


def _breaks(run: Trajectory, scene: Scene) -> Mapping[str, float]:
    """Return the times at which joints broke, s, by the numbers of the joints."""
    times = run.breaks(len(scene.joint_arrays)).tolist()
    return {str(k): float(f"{time:.6g}") for k, time in enumerate(times) if time < math.inf}


def initial_speed(duration: float) -> float:
    """Return the speed at which the replay takes about `TARGET_DURATION`."""
    return min(SPEEDS, key=lambda speed: abs(math.log(duration / speed / TARGET_DURATION)))
