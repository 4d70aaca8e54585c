"""A shot as a page: the paths of the balls over the table, its replay, and its key figures."""

import math
from collections import Counter
from collections.abc import Sequence

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.engines.exact.tabletop.shot_result import ShotEvent, ShotResult
from sandbox.report.colours import COLOURS
from sandbox.report.page.document import Page, Section
from sandbox.report.page.markup import Child, Markup, joined, named, tag
from sandbox.report.page.replay import MOST_FRAMES, Track, replay
from sandbox.report.page.scene_page import PictureFrame, circle, fixed_objects, line
from sandbox.report.page.sight import box_of
from sandbox.report.page.tables import Column, pairs, table
from sandbox.report.page.verdicts import look_of
from sandbox.report.page.wording import NONE, number, plural
from sandbox.trajectory import Trajectory

ENGINE = "exact"
"""Engine that computes shots."""
FRAMES_PER_SECOND = 60.0
"""Frames of the replay per second of the shot, as long as there are at most `MOST_FRAMES`."""
WIDTH, HEIGHT = 480.0, 480.0
"""Units of the picture."""
SPACING = 3.0
"""Distance between points of a drawn path, in units of the picture: curved parts look smooth."""
MAX_LISTED = 24
"""Balls that are listed: a rack of snooker has 22."""
BALLS = (
    Column("ball"),
    Column("path, m", True, "length of the path"),
    Column("balls hit", True, "number of collisions with other balls"),
    Column("cushions hit", True, "number of collisions with cushions and jaws"),
    Column("ends at x, m", True),
    Column("y, m", True),
    Column("pocket"),
)
NOT_RECORDED = (
    "Paths were not recorded, so the picture shows the balls at the end only; shoot(…, ways=True) records them."
)


def shot_page(shot: ShotResult, replayed: bool = True) -> Page:
    """Return the page of a shot.

    Args:
        shot: result of the shot; its paths are drawn if they were recorded.
        replayed: with the replay.
    """
    events = shot.events
    # A ball takes part in an event by itself, or as the partner of another ball.
    moving = {name for event in events for name in (event.ball, event.partner if event.kind == "ball" else None)}
    moved = [k for k, name in enumerate(shot.names) if name in moving]
    figures = pairs(_figures(shot, events, len(moved)))
    sections = [Section("Paths", _pictures(shot, moved, figures, replayed))]
    if moved:
        sections.append(Section("Balls", _balls(shot, events, moved)))
    return Page(shot.scene.title or "Untitled scene", "Shot", sections)


def _pictures(shot: ShotResult, moved: Sequence[int], figures: Markup, replayed: bool) -> Markup:
    """Return the replay with the figures below it, and beside it the picture of the paths."""
    if shot.path is None:
        figures = joined(figures, tag("p", NOT_RECORDED, class_="soft remark"))
    elif replayed and shot.duration > 0.0:
        lasting = shot.scene.world.model_copy(update={"duration": shot.duration})
        scene = shot.scene.model_copy(update={"world": lasting})
        canvas = replay(scene, [Track(ENGINE, look_of(ENGINE), _frames(shot))], None)
        figures = joined(canvas, tag("div", figures, class_="remark"))
    return tag("div", tag("div", figures), tag("div", _picture(shot, moved)), class_="side")


def _frames(shot: ShotResult) -> Trajectory:
    """Return the positions of the balls at evenly spaced times, as a run that can be replayed."""
    count = min(math.ceil(FRAMES_PER_SECOND * shot.duration) + 1, MOST_FRAMES)
    times = np.linspace(0.0, shot.duration, count)
    position = shot.at(times)
    still, balls = np.zeros(position.shape[:2]), len(shot.names)
    contacts = shot.contacts
    return Trajectory(
        time=times,
        position=position,
        velocity=np.zeros_like(position),
        angle=still,
        angular_velocity=still,
        names=np.asarray(shot.names),
        contact_time=contacts.time,
        contact_pair=contacts.pair,
        contact_point=contacts.point,
        contact_normal=contacts.normal,
        contact_impulse=contacts.impulse,
        retired_time=np.full(balls, np.nan),
        missed_time=np.empty(0),
        missed_pair=np.empty((0, 2), np.int64),
        info={"engine": ENGINE},
    )


def _picture(shot: ShotResult, moved: Sequence[int]) -> Markup:
    """Return the table as SVG: paths as lines, start positions as rings, final positions as discs with names."""
    scene, ends = shot.scene, shot.position
    starts = ends if shot.path is None else shot.at(np.zeros(1))[0]
    frame = PictureFrame.around(box_of(scene, [np.stack((starts, ends))]), WIDTH, HEIGHT)
    lines, rings, discs, labels = list[Markup](), list[Markup](), list[Markup](), list[Markup]()
    radii, pocketed = scene.bodies.radius.tolist(), shot.pocketed
    colours = {k: f"var(--e{index % len(COLOURS)})" for index, k in enumerate(moved)}
    for k, (name, radius) in enumerate(zip(shot.names, radii, strict=True)):
        colour = colours.get(k, "var(--faint)")
        if shot.path is not None and k in colours:
            path = frame.at(shot.way(name, SPACING / frame.scale))
            lines.append(line(path, fill="none", stroke=colour, stroke_width=1.6, stroke_linejoin="round"))
            rings.append(circle(frame, starts[k], radius, fill="var(--paper)", stroke=colour, stroke_width=1.4))
        if name not in pocketed:
            discs.append(circle(frame, ends[k], radius, fill=colour, stroke="var(--paper)", stroke_width=0.5))
            x, y = frame.at(ends[k]).tolist()
            labels.append(tag("text", name, x=x + frame.scale * radius + 2.0, y=y + 4.0, class_="note"))
    parts = [*fixed_objects(scene, frame), *lines, *rings, *discs, *labels]
    return frame.svg(parts, f"Paths of the balls of {scene.title or 'the shot'}", "paths")


def _figures(shot: ShotResult, events: Sequence[ShotEvent], moved: int) -> list[tuple[str, Child]]:
    """Return names and values of what happened."""
    kinds = Counter(event.kind for event in events)
    first = next((event for event in events if event.kind == "ball"), None)
    met = NONE if first is None else f"{first.ball} and {first.partner} at {number(first.time, 6)} s"
    fell = ", ".join(f"{ball} in {pocket}" for ball, pocket in shot.pocketed.items())
    return [
        ("balls", f"{len(shot.names):,}, of which {moved:,} moved"),
        ("duration", f"{number(shot.duration, 4)} s"),
        ("at the end", "all balls at rest" if shot.complete else "not at rest: the time limit ended the shot"),
        ("collisions of balls", f"{kinds['ball']:,}"),
        ("cushion contacts", f"{kinds['cushion'] + kinds['jaw']:,}"),
        ("first collision", named(met)),
        ("pocketed", named(fell or "none")),
    ]


def _balls(shot: ShotResult, events: Sequence[ShotEvent], moved: Sequence[int]) -> Markup:
    """Return a row for each ball that moved."""
    met = Counter(name for event in events if event.kind == "ball" for name in (event.ball, event.partner))
    cushions = Counter(event.ball for event in events if event.kind in ("cushion", "jaw"))
    rows: list[list[Child]] = []
    for k in moved[:MAX_LISTED]:
        name = shot.names[k]
        length = None if shot.path is None else _length(shot.way(name))
        pocket = shot.pocketed.get(name)
        end = [NONE, NONE] if pocket else [f"{value:.3f}" for value in shot.position[k].tolist()]
        cells: list[Child] = [number(length), f"{met[name]:,}", f"{cushions[name]:,}", *end]
        rows.append([named(name), *cells, named(pocket) if pocket else NONE])
    more = len(moved) - MAX_LISTED
    note = tag("p", f"and {plural(more, 'more ball')}", class_="soft") if more > 0 else None
    return joined(table(BALLS, rows, "Balls that moved"), note)


def _length(points: FloatArray) -> float:
    """Return the length of a path through points (K, 2), m."""
    return float(np.hypot(*np.diff(points, axis=0).T).sum())
