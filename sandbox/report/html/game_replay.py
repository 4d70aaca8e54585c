"""Replay of the runs of a game side by side, with the contacts for which its callbacks differ.

Lengths are in px of the game. The canvas has y up; most games have y down, so that y and angles change sign for them.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from markupsafe import Markup

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.formatting import format_plural
from sandbox.measure.game_advice.difference import DifferingContact
from sandbox.rehearsal.rehearse import Rehearsal
from sandbox.rehearsal.space_log import GameShape
from sandbox.report.html.page import fragment
from sandbox.report.html.replay import BUDGET, MAX_BODIES, MAX_FRAMES, MIN_FRAMES, SPEEDS, evenly_spread, initial_speed
from sandbox.report.html.replay_data import (
    MARGIN,
    Bounds,
    QuantisationBox,
    compress,
    encode_angles,
    encode_positions,
    quantisation_box,
)

MAX_NAMES = 8
"""Up to this number of bodies with names, each is labelled with it"""
MARK_TIME = 0.4
"""s after a differing contact in which a ring marks it"""
INSIDE = 0.8
"""Fraction of the positions within the window from which on the window is what the replay shows"""
TYPICAL = 2.0
"""Positions left out at each side otherwise, percent: bodies that fall out of the game"""
_Piece = list[float]
"""radius, and centre, ends or corners"""


@dataclass(frozen=True, eq=False)
class GameTrack:
    """One run of a replay."""

    name: str
    css_class: str
    """class that has its colour: `e0`, `e1`, …, `truth`"""
    run: Rehearsal
    error: Sequence[float] | None = None
    """px, error in each frame, shown in the legend"""
    contacts: Sequence[tuple[DifferingContact, str]] = ()
    """contacts that differ from those of the truth, each with the function that is called"""


def game_replay(
    title: str, tracks: Sequence[GameTrack], duration: float, zoom: float, start: float, marks: Markup
) -> Markup:
    """Return the canvases of some runs with their controls, legend and data.

    Args:
        title: name of the game.
        tracks: runs, the truth first. Each has a canvas, in which the truth is dashed.
        duration: of the recorded session, s.
        zoom: px per unit of length of the game.
        start: time at which the replay is shown first, s.
        marks: chart of the differing contacts over time, below the controls.
    """
    document = game_replay_document(tracks, duration, zoom, start)
    names = ", ".join(track.name for track in tracks)
    return fragment("replay.html.j2", "replay", title, names, tracks, SPEEDS, document, marks)


def game_replay_document(
    tracks: Sequence[GameTrack], duration: float, zoom: float, start: float = 0.0
) -> dict[str, Any]:
    """Return the data of the canvases as JSON, as `replay.js` reads it; arguments as for `game_replay`."""
    truth = tracks[0].run
    sides = np.array([zoom, zoom if truth.gravity[1] < 0.0 else -zoom])
    poses = _poses([track.run for track in tracks], sides)
    is_still = _is_still(poses)
    moving = np.flatnonzero(~is_still)
    drawn = moving[:: max(1, math.ceil(len(moving) / MAX_BODIES))]
    frames = max(len(each) for each in poses)
    times = frame_times([track.run for track in tracks], duration)
    view = _view(truth, poses[0][:, moving], sides)
    box = quantisation_box(view)
    origin = np.array([box.x + 0.5 * box.side, box.y + 0.5 * box.side])
    kept, codes = _encoded([each[:, drawn] for each in poses], frames, box)
    forms = _Forms(sides)
    shapes = [forms.numbers(track.run, drawn) for track in tracks]
    names = [truth.body_names.get(number, "") for number in drawn.tolist()]
    notes = []
    if len(drawn) < len(moving):
        notes.append(f"{len(drawn):,} of {format_plural(len(moving), 'body', 'bodies')} are drawn")
    if len(kept) < frames:
        notes.append(f"{len(kept):,} of {frames:,} frames are kept; the replay interpolates between them")
    return {
        "geometry": _geometry(truth, poses[0], is_still, forms, origin)
        | {
            "shapes": forms.pieces,
            "shape": shapes[0],
            "names": names if sum(map(bool, names)) <= MAX_NAMES else [],
        },
        "tracks": [
            {
                "name": track.name,
                "css_class": track.css_class,
                "codes": text,
                "errors": None if track.error is None else _errors_at(track.error, kept),
                "breaks": {},
                "value": None,
                "shape": None if shape == shapes[0] else shape,
                "absent": _absent_times(track.run, times),
                "marks": _marks(track, pose, poses[0], times, origin),
            }
            for track, text, shape, pose in zip(tracks, codes, shapes, poses, strict=True)
        ],
        "has_angles": True,
        "bodies": len(drawn),
        "time": [float(f"{time:.6g}") for time in times[kept].tolist()],
        "duration": duration,
        "start": float(f"{start:.6g}"),
        "panes": [list(dict.fromkeys([track.name, tracks[0].name])) for track in tracks],
        "unit": "px",
        "mark_time": MARK_TIME,
        "trusted_until": None,
        "step": box.step,
        "half": 0.5 * box.side,
        "view": [view[0] - origin[0], view[1] - origin[1], view[2] - origin[0], view[3] - origin[1]],
        "speed": initial_speed(duration),
        "note": "; ".join(notes),
        "swept": None,
        "values": [],
    }


def frame_times(runs: Iterable[Rehearsal], duration: float) -> FloatArray:
    """Return the times of the frames of a session, s, evenly spread; a run that fails lacks the last ones."""
    return np.linspace(0.0, duration, max((run.frames for run in runs), default=0))


def _poses(runs: Sequence[Rehearsal], sides: FloatArray) -> list[FloatArray]:
    """Return x, y (px) and angle (F, N, 3) of all bodies in each run; nan where one is absent."""
    count = max((int(run.bodies.max(initial=-1)) + 1 for run in runs), default=0)
    found = []
    for run in runs:
        poses = np.full((run.frames, count, 3), np.nan)
        rows = np.repeat(np.arange(run.frames), np.diff(run.offsets))
        poses[rows, run.bodies] = run.states[:, :3] * (*sides, math.copysign(1.0, sides[1]))
        found.append(poses)
    return found


def _is_still(poses: Sequence[FloatArray]) -> BoolArray:
    """Return which bodies are present and at rest in all frames of all runs."""
    first = poses[0][:1]
    found = np.ones(first.shape[1], np.bool_)
    for each in poses:
        found &= (each == first).all(axis=(0, 2))
    return found


def _view(truth: Rehearsal, poses: FloatArray, sides: FloatArray) -> Bounds:
    """Return the part of the game to show, px: its window if most positions are in it, otherwise that of its bodies."""
    points = poses[..., :2].reshape(-1, 2)
    points = points[np.isfinite(points).all(axis=1)]
    if truth.window is not None:
        width, height = truth.window
        low, high = np.sort([[0.0, 0.0], [width, math.copysign(height, sides[1])]], axis=0)
        if not len(points) or np.mean(((points >= low) & (points <= high)).all(axis=1)) >= INSIDE:
            return float(low[0]), float(low[1]), float(high[0]), float(high[1])
    if not len(points):
        return -1.0, -1.0, 1.0, 1.0
    low, high = np.percentile(points, (TYPICAL, 100.0 - TYPICAL), axis=0)
    margin = 2.0 * MARGIN * max(float((high - low).max()), 1.0)
    return float(low[0]) - margin, float(low[1]) - margin, float(high[0]) + margin, float(high[1]) + margin


def _encoded(poses: Sequence[FloatArray], frames: int, box: QuantisationBox) -> tuple[IntArray, list[str]]:
    """Return as many frames as the budget allows, and the encoded runs in them."""
    max_frames = MAX_FRAMES
    while True:
        kept = evenly_spread(frames, max_frames)
        texts = [_encode(each, kept, box) for each in poses]
        if sum(map(len, texts)) <= BUDGET or max_frames <= MIN_FRAMES:
            return kept, texts
        max_frames = max(MIN_FRAMES, max_frames // 2)


def _encode(poses: FloatArray, frames: IntArray, box: QuantisationBox) -> str:
    shown = np.full((len(frames), *poses.shape[1:]), np.nan)
    is_run = frames < len(poses)  # a run that failed has fewer frames
    shown[is_run] = poses[frames[is_run]]
    positions = encode_positions(shown[..., :2], np.ones(shown.shape[:2], bool), box)
    return compress(np.concatenate((positions, encode_angles(shown[..., 2])[..., None]), axis=2))


class _Forms:
    """Different forms of bodies, each a list of pieces in px.

    Args:
        sides: px per unit of the game along x and y.
    """

    def __init__(self, sides: FloatArray) -> None:
        self._sides = sides
        self.pieces: list[list[_Piece]] = []
        self._numbers: dict[str, int] = {}

    def numbers(self, run: Rehearsal, bodies: IntArray) -> list[int]:
        """Return the number of the form of each body in a run."""
        by_body: dict[int, list[GameShape]] = {}
        for body, shape in zip(run.shape_bodies.values(), run.shapes.values(), strict=True):
            by_body.setdefault(body, []).append(shape)
        return [self._number(by_body.get(body, [])) for body in bodies.tolist()]

    def piece(self, shape: GameShape) -> _Piece:
        """Return a shape as radius and points."""
        radius = abs(float(self._sides[0])) * shape.radius
        points = (np.asarray(shape.points) * self._sides).reshape(-1).tolist()
        return [_short(each) for each in (radius, *points)]

    def _number(self, shapes: Sequence[GameShape]) -> int:
        solid = [shape for shape in shapes if not shape.is_sensor] or shapes
        pieces = [self.piece(shape) for shape in solid] or [[0.0, 0.0, 0.0]]
        number = self._numbers.setdefault(repr(pieces), len(self.pieces))
        if number == len(self.pieces):
            self.pieces.append(pieces)
        return number


def _geometry(
    truth: Rehearsal, poses: FloatArray, is_still: BoolArray, forms: _Forms, origin: FloatArray
) -> dict[str, Any]:
    """Return the shapes of static bodies, and of others that never move, with position, angle, and number."""
    kinds: dict[bool, list[list[Any]]] = {False: [], True: []}
    for number, shape in truth.shapes.items():
        body = truth.shape_bodies[number]
        if body >= len(is_still) or (body >= 0 and not is_still[body]):
            continue
        x, y, angle = (0.0, 0.0, 0.0) if body < 0 else poses[0, body].tolist()
        at = [_short(x - origin[0]), _short(y - origin[1]), _short(angle)]
        kinds[shape.is_sensor].append([*at, forms.piece(shape), number])
    unused = ("planes", "walls", "posts", "pockets", "attractions", "joints")
    return {**{name: [] for name in unused}, "solids": kinds[False], "sensors": kinds[True]}


def _absent_times(run: Rehearsal, times: FloatArray) -> dict[str, list[list[float | None]]]:
    """Return the times, from and until, s, in which each shape is absent, by its number; until None for the rest."""
    found: dict[str, list[list[float | None]]] = {}
    for frame, is_added, number in run.shape_changes:
        spans, time = found.setdefault(str(number), []), float(f"{times[min(frame, len(times) - 1)]:.6g}")
        is_absent = bool(spans) and spans[-1][1] is None
        if not is_added and not is_absent:  # pymunk removes what a callback removes again after the step
            spans.append([time, None])
        elif is_added and is_absent:
            spans[-1][1] = time
        elif is_added and not spans:
            spans.append([0.0, time])
    return found


def _errors_at(errors: Sequence[float], frames: IntArray) -> list[float | None]:
    return [float(f"{errors[frame]:.3g}") if frame < len(errors) else None for frame in frames.tolist()]


def _marks(
    track: GameTrack, pose: FloatArray, truth: FloatArray, times: FloatArray, origin: FloatArray
) -> list[tuple[float, float, float, str]]:
    """Return time, position and text of each differing contact whose bodies are in the replay."""
    found = []
    for contact, function in track.contacts:
        poses = pose if contact.kind == "extra" else truth
        bodies = [track.run.shape_bodies.get(each, -1) for each in contact.shapes]
        at = _contact_position(poses, contact.frame, bodies)
        if at is not None:
            x, y = (at - origin).tolist()
            found.append((float(f"{times[contact.frame]:.6g}"), _short(x), _short(y), f"{contact.kind}: {function}"))
    return found


def _contact_position(poses: FloatArray, frame: int, bodies: Sequence[int]) -> FloatArray | None:
    """Return the position of the body that was added last: a bullet, rather than what it hits."""
    for body in sorted(bodies, reverse=True):
        if body < 0 or body >= poses.shape[1]:
            continue
        for near in (frame, frame - 1):  # a callback may remove the body
            if 0 <= near < len(poses) and np.isfinite(poses[near, body, 0]):
                return np.asarray(poses[near, body, :2])
    return None


def _short(value: float) -> float:
    """Return a length to 0.001 px, or an angle to 0.001 rad."""
    return round(float(value), 3)


MARK_COLOURS: Mapping[str, str] = {"missed": "bad", "late": "fair", "early": "fair", "extra": "extra"}
"""Class of the marks of each kind of differing contact"""


def contact_marks(tracks: Sequence[GameTrack], times: FloatArray, duration: float) -> Markup:
    """Return the differing contacts of each run over time, a row for each run, with the time cursor.

    Args:
        tracks: runs.
        times: of the frames, s.
        duration: of the session, s.
    """
    rows = []
    for track in tracks:
        marks = []
        for contact, function in track.contacts:
            time = float(times[contact.frame])
            about = f"{contact.kind} at {time:.2f} s: {function}"
            marks.append((1000.0 * time / duration, MARK_COLOURS[contact.kind], about))
        rows.append((track, marks))
    return fragment("game_advice.html.j2", "contact_marks", rows, duration)
