"""Replay: a scene and the runs of several engines, packed for the canvas that `replay.js` draws.

Frames are thinned to `MOST_FRAMES`, and further, down to `FEWEST_FRAMES`, until all fits into `BUDGET`; of more than
`MOST_BODIES` bodies some are drawn. The page says what was left out.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from sandbox.arrays import FloatArray, IntArray
from sandbox.report.page.markup import Markup, data, joined, named, tag
from sandbox.report.page.packing import Crate, packed, rounded, turned
from sandbox.report.page.scenery import scenery_of
from sandbox.report.page.sight import box_of, crate_of
from sandbox.report.page.wording import plural
from sandbox.scene.scene import Scene
from sandbox.trajectory import Trajectory

MOST_FRAMES = 600
FEWEST_FRAMES = 75
MOST_BODIES = 2000
BUDGET = 700_000
"""Letters of all tracks together."""
SEEN = 8.0
"""s that a replay takes at the speed it begins with, about."""
SPEEDS = (0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.25, 0.5, 1.0, 2.0, 4.0, 10.0, 25.0)


@dataclass(frozen=True, eq=False)
class Track:
    """One run as it is overlaid."""

    name: str
    look: str
    """its class: `e0`, `e1`, … for engines, `truth`"""
    run: Trajectory
    error: tuple[FloatArray, FloatArray] | None = None
    """(K,) s and (K,) m: the position error that is told beside it"""


def replay(scene: Scene, tracks: Sequence[Track], trusted_until: float | None, unit: str = "m") -> Markup:
    """Return the canvas with its controls, legend and data.

    Args:
        scene: of all runs.
        tracks: in the order in which they are drawn; the truth last.
        trusted_until: when the truth ends, s.
        unit: of the errors.
    """
    document = replay_document(scene, tracks, trusted_until)
    title = scene.title or "this scene"
    canvas = tag("canvas", role="img", aria_label=f"{title}, computed by {', '.join(each.name for each in tracks)}")
    note = tag("p", document["note"], class_="left-out") if document["note"] else None
    stage = tag("div", canvas, tag("p", "", class_="told", aria_live="off"), class_="stage")
    legend = [_entry(each, unit) for each in tracks]
    return tag(
        "figure",
        stage,
        _controls(document["speed"]),
        tag("ul", *legend, class_="legend"),
        note,
        tag("noscript", tag("p", "The replay needs JavaScript; the plots and tables hold all figures.")),
        data(document, class_="data"),
        class_="replay",
        tabindex="0",
        role="group",
        aria_label=f"Replay of {title}. Space plays and pauses, arrows step, plus and minus zoom.",
    )


def replay_document(scene: Scene, tracks: Sequence[Track], trusted_until: float | None) -> dict[str, Any]:
    """Return what the canvas needs, as JSON: scenery, tracks, times, and what was left out."""
    moving = np.flatnonzero(~scene.bodies.fixed)
    drawn = moving[:: max(1, math.ceil(len(moving) / MOST_BODIES))]
    trusted = [each.run for each in tracks if each.look == "truth"] or [each.run for each in tracks]
    box = box_of(scene, [each.position for each in trusted])
    crate = crate_of(box)
    turns = _turning(scene, tracks, drawn)
    longest = max((each.run.time for each in tracks), key=len, default=np.empty(0))
    most = MOST_FRAMES
    while True:
        chosen = _spread(len(longest), most)
        time = longest[chosen]
        texts = [_packed(each, time, drawn, turns, crate) for each in tracks]
        if sum(map(len, texts)) <= BUDGET or most <= FEWEST_FRAMES:
            break
        most = max(FEWEST_FRAMES, most // 2)
    origin = (crate.x + 0.5 * crate.side, crate.y + 0.5 * crate.side)
    note = []
    if len(drawn) < len(moving):
        note.append(f"{len(drawn):,} of {plural(len(moving), 'body').replace('bodys', 'bodies')} are drawn")
    if len(time) < len(longest):
        note.append(f"{len(time):,} of {len(longest):,} frames are kept; the replay interpolates between them")
    return {
        "scenery": scenery_of(scene, drawn, origin),
        "tracks": [
            {
                "name": each.name,
                "look": each.look,
                "packed": text,
                "errors": _errors(each, time),
                "breaks": _breaks(each.run, scene),
            }
            for each, text in zip(tracks, texts, strict=True)
        ],
        "turns": turns,
        "bodies": len(drawn),
        "time": [float(f"{t:.9g}") for t in time.tolist()],
        "duration": scene.world.duration,
        "trusted_until": trusted_until,
        "step": crate.step,
        "half": 0.5 * crate.side,
        "box": [box[0] - origin[0], box[1] - origin[1], box[2] - origin[0], box[3] - origin[1]],
        "speed": _speed(scene.world.duration),
        "note": "; ".join(note),
    }


def _spread(count: int, most: int) -> IntArray:
    """Return the numbers of at most so many frames, evenly spread, the first and the last among them."""
    return np.unique(np.rint(np.linspace(0, max(count - 1, 0), min(count, most))).astype(np.int64))


def _packed(track: Track, time: FloatArray, drawn: IntArray, turns: bool, crate: Crate) -> str:
    """Return the places, and angles, of the bodies that are drawn, at some times."""
    run = track.run
    if not len(run.time):
        return packed(np.full((len(time), len(drawn), 3 if turns else 2), 65535, np.uint16))
    nearest = np.abs(run.time[:, None] - time[None]).argmin(axis=0) if len(run.time) < 2 else _nearest(run.time, time)
    slack = 0.5 * float(np.median(np.diff(time))) if len(time) > 1 else math.inf
    known = np.abs(run.time[nearest] - time) <= slack
    retired = run.retired_time[drawn]
    there = known[:, None] & (np.isnan(retired) | (time[:, None] < retired))
    words = rounded(run.position[nearest][:, drawn], there, crate)
    if turns:
        words = np.concatenate((words, turned(run.angle[nearest][:, drawn])[..., None]), axis=2)
    return packed(words)


def _nearest(its: FloatArray, wanted: FloatArray) -> IntArray:
    after = np.searchsorted(its, wanted).clip(1, len(its) - 1)
    return np.where(np.abs(its[after - 1] - wanted) <= np.abs(its[after] - wanted), after - 1, after)


def _turning(scene: Scene, tracks: Sequence[Track], drawn: IntArray) -> bool:
    """Tell whether any body that is drawn turns so that it can be seen."""
    if not len(drawn):
        return False
    if not scene.bodies.round[drawn].all() or scene.bodies.angle[drawn].any():
        return True
    return any(bool(np.any(each.run.angular_velocity[:, drawn])) for each in tracks)


def _errors(track: Track, time: FloatArray) -> list[float | None] | None:
    """Return the error at each time, to three digits; None where it is not known."""
    if track.error is None or not len(track.error[0]):
        return None
    its, values = track.error
    nearest = _nearest(its, time) if len(its) > 1 else np.zeros(len(time), np.int64)
    slack = 0.5 * float(np.median(np.diff(time))) if len(time) > 1 else math.inf
    known = np.abs(its[nearest] - time) <= slack
    found = zip(known.tolist(), values[nearest].tolist(), strict=True)
    return [float(f"{value:.3g}") if fine and math.isfinite(value) else None for fine, value in found]


def _breaks(run: Trajectory, scene: Scene) -> Mapping[str, float]:
    """Return when joints broke, by their numbers, s."""
    times = run.breaks(len(scene.links)).tolist()
    return {str(k): float(f"{time:.6g}") for k, time in enumerate(times) if time < math.inf}


def _speed(duration: float) -> float:
    return min(SPEEDS, key=lambda speed: abs(math.log(duration / speed / SEEN)))


def _entry(track: Track, unit: str) -> Markup:
    """Return a line of the legend: it shows or hides the track, and tells its error."""
    label = tag(
        "label",
        tag("input", type="checkbox", checked=True, data_track=track.name),
        tag("span", class_=f"swatch {track.look}", aria_hidden="true"),
        named(track.name),
    )
    error = tag("output", "–", class_="error", data_unit=unit) if track.error is not None else None
    return tag("li", label, error)


def _controls(speed: float) -> Markup:
    """Return the buttons, the slider and the speed."""

    def button(action: str, sign: str, about: str) -> Markup:
        return tag("button", sign, type="button", data_action=action, title=about, aria_label=about)

    speeds = [tag("option", f"{each:g}×", value=f"{each:g}", selected=each == speed) for each in SPEEDS]
    return tag(
        "div",
        button("play", "▶", "Play or pause (Space)"),
        button("back", "◂", "Previous frame (←)"),
        button("on", "▸", "Next frame (→)"),
        tag("input", type="range", class_="scrub", min="0", max="1000", value="0", step="any", aria_label="Time"),
        tag("output", "0 s", class_="time"),
        tag("label", tag("span", "Speed", class_="unseen"), tag("select", joined(*speeds), class_="speed")),
        tag(
            "span",
            button("nearer", "+", "Zoom in (+)"),
            button("farther", "−", "Zoom out (−)"),
            button("fit", "⤢", "Fit all (0)"),
            class_="zoom",
        ),
        class_="controls",
    )
