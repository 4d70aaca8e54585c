"""Notebook displays of a billiard shot and of its odds."""

import base64
import io
import math
from collections import Counter
from collections.abc import Sequence
from warnings import catch_warnings

import numpy as np
from markupsafe import Markup

from sandbox.arrays import FloatArray
from sandbox.engines.exact.tabletop.shot_result import ShotEvent, ShotResult
from sandbox.formatting import UNKNOWN, format_number, format_plural
from sandbox.measure.shots.monte_carlo import Odds
from sandbox.report.colours import COLOURS, css_class_of
from sandbox.report.html.page import (
    Content,
    HtmlColumn,
    Page,
    Section,
    concatenated,
    definitions,
    fragment,
    isolated,
    paragraph,
    table,
)
from sandbox.report.html.replay import MAX_FRAMES, Track, replay
from sandbox.report.html.replay_data import viewport
from sandbox.report.html.scene_page import TEMPLATE, PictureFrame, Shape, circle, line, static_shapes
from sandbox.report.shots_plot import draw_rests
from sandbox.report.style import ignore_missing_glyphs
from sandbox.trajectory import Trajectory

ENGINE = "exact"
"""Engine that computes shots."""
FRAMES_PER_SECOND = 60.0
"""Frames of the replay per second of the shot, as long as there are at most `MAX_FRAMES`."""
WIDTH, HEIGHT = 480.0, 480.0
"""Units of the picture."""
SPACING = 3.0
"""Distance between points of a drawn path, in units of the picture: curved parts look smooth."""
MAX_LISTED = 24
"""Balls that are listed: a rack of snooker has 22."""
BALLS = (
    HtmlColumn("ball"),
    HtmlColumn("path, m", True, "length of the path"),
    HtmlColumn("balls hit", True, "number of collisions with other balls"),
    HtmlColumn("cushions hit", True, "number of collisions with cushions and jaws"),
    HtmlColumn("ends at x, m", True),
    HtmlColumn("y, m", True),
    HtmlColumn("pocket"),
)
NOT_RECORDED = (
    "Paths were not recorded, so the picture shows the balls at the end only; shoot(…, record_paths=True) records them."
)


def shot_page(shot: ShotResult, replayed: bool = True) -> Page:
    """Return the page of a shot.

    Args:
        shot: result of the shot; its paths are drawn if they were recorded.
        replayed: with the replay.
    """
    events = shot.events
    # A ball is the subject of an event, or the partner of another ball.
    moving = {name for event in events for name in (event.ball, event.partner if event.kind == "ball" else None)}
    moved = [k for k, name in enumerate(shot.names) if name in moving]
    figures = definitions(_figures(shot, events, len(moved)))
    sections = [Section("Paths", _pictures(shot, moved, figures, replayed))]
    if moved:
        sections.append(Section("Balls", _balls(shot, events, moved)))
    return Page(shot.scene.title or "Untitled scene", "Shot", sections)


def _pictures(shot: ShotResult, moved: Sequence[int], figures: Markup, replayed: bool) -> Markup:
    """Return the replay with the figures below it, and beside it the picture of the paths."""
    if shot.path is None:
        figures = concatenated(figures, paragraph(NOT_RECORDED, "soft remark"))
    elif replayed and shot.duration > 0.0:
        scene = shot.scene.with_duration(shot.duration)
        canvas = replay(scene, [Track(ENGINE, css_class_of(ENGINE), _frames(shot))], None)
        figures = concatenated(canvas, figures)
    return fragment(TEMPLATE, "side", figures, _picture(shot, moved))


def _frames(shot: ShotResult) -> Trajectory:
    """Return the positions of the balls at evenly spaced times, as a run that can be replayed."""
    count = min(math.ceil(FRAMES_PER_SECOND * shot.duration) + 1, MAX_FRAMES)
    times = np.linspace(0.0, shot.duration, count)
    position = shot.at(times)
    rest, balls = np.zeros(position.shape[:2]), len(shot.names)
    contacts = shot.contacts
    return Trajectory(
        time=times,
        position=position,
        velocity=np.zeros_like(position),
        angle=rest,
        angular_velocity=rest,
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
    frame = PictureFrame.around(viewport(scene, [np.stack((starts, ends))]), WIDTH, HEIGHT)
    lines, rings, discs, labels = list[Shape](), list[Shape](), list[Shape](), list[Shape]()
    radii, pocketed = scene.bodies.radius.tolist(), shot.pocketed
    colours = {k: f"var(--e{index % len(COLOURS)})" for index, k in enumerate(moved)}
    for k, (name, radius) in enumerate(zip(shot.names, radii, strict=True)):
        colour = colours.get(k, "var(--faint)")
        if shot.path is not None and k in colours:
            path = frame.at(shot.path_of(name, SPACING / frame.scale))
            curve = {"fill": "none", "stroke": colour, "stroke-width": 1.6, "stroke-linejoin": "round"}
            lines.append(line(path, curve))
            ring = {"fill": "var(--paper)", "stroke": colour, "stroke-width": 1.4}
            rings.append(circle(frame, starts[k], radius, ring))
        if name not in pocketed:
            disc = {"fill": colour, "stroke": "var(--paper)", "stroke-width": 0.5}
            discs.append(circle(frame, ends[k], radius, disc))
            x, y = frame.at(ends[k]).tolist()
            attributes = {"x": f"{x + frame.scale * radius + 2.0:.6g}", "y": f"{y + 4.0:.6g}", "class": "note"}
            labels.append(Shape("text", attributes, name))
    shapes = [*static_shapes(scene, frame), *lines, *rings, *discs, *labels]
    return frame.svg(shapes, f"Paths of the balls of {scene.title or 'the shot'}", "paths")


def _figures(shot: ShotResult, events: Sequence[ShotEvent], moved: int) -> dict[str, Content]:
    """Return the key figures of a shot by name."""
    kinds = Counter(event.kind for event in events)
    first = next((event for event in events if event.kind == "ball"), None)
    first_collision = (
        UNKNOWN if first is None else f"{first.ball} and {first.partner} at {format_number(first.time, 6)} s"
    )
    pocketed_balls = ", ".join(f"{ball} in {pocket}" for ball, pocket in shot.pocketed.items())
    return {
        "balls": f"{len(shot.names):,}, of which {moved:,} moved",
        "duration": f"{format_number(shot.duration, 4)} s",
        "at the end": "all balls at rest" if shot.complete else "not at rest: the time limit ended the shot",
        "collisions of balls": f"{kinds['ball']:,}",
        "cushion contacts": f"{kinds['cushion'] + kinds['jaw']:,}",
        "first collision": isolated(first_collision),
        "pocketed": isolated(pocketed_balls or "none"),
    }


def _balls(shot: ShotResult, events: Sequence[ShotEvent], moved: Sequence[int]) -> Markup:
    """Return a row for each ball that moved."""
    collisions = Counter(name for event in events if event.kind == "ball" for name in (event.ball, event.partner))
    cushions = Counter(event.ball for event in events if event.kind in ("cushion", "jaw"))
    rows: list[list[Content]] = []
    for k in moved[:MAX_LISTED]:
        name = shot.names[k]
        length = None if shot.path is None else _length(shot.path_of(name))
        pocket = shot.pocketed.get(name)
        end = [UNKNOWN, UNKNOWN] if pocket else [f"{value:.3f}" for value in shot.position[k].tolist()]
        cells: list[Content] = [format_number(length), f"{collisions[name]:,}", f"{cushions[name]:,}", *end]
        rows.append([isolated(name), *cells, isolated(pocket) if pocket else UNKNOWN])
    more = len(moved) - MAX_LISTED
    note = paragraph(f"and {format_plural(more, 'more ball')}") if more > 0 else None
    return concatenated(table(BALLS, rows, "Balls that moved"), note)


def _length(points: FloatArray) -> float:
    """Return the length of a path through points (K, 2), m."""
    return float(np.hypot(*np.diff(points, axis=0).T).sum())


COLUMNS = (
    HtmlColumn("ball"),
    HtmlColumn("potted", True, "of all strokes, with the 95 % interval"),
    HtmlColumn("most often in"),
    HtmlColumn("rests at x, m", True, "mean and standard deviation over the strokes that leave it on the table"),
    HtmlColumn("rests at y, m", True, "mean and standard deviation over the strokes that leave it on the table"),
)
PICTURE_DPI = 80
"""Dots per inch of the picture."""


def odds_page(odds: Odds) -> Page:
    """Return the page of a shot's odds."""
    attempt = odds.shot
    title = attempt.table.scene.title or "Untitled scene"
    aim = f"{format_number(attempt.stroke.aim, 6)} rad at {format_number(attempt.stroke.speed, 4)} m/s"
    lead = (
        f"Shot {attempt.name!r} at {attempt.ball!r}: aim {aim}. "
        f"{format_plural(odds.count, 'stroke')}, seed {odds.seed}: any other ball potted {odds.any_pot}, "
        f"the struck ball potted {odds.scratch}, {format_plural(odds.miscues, 'miscue')}."
    )
    rows = [_row(odds, ball) for ball in attempt.table.names]
    sections = [
        Section("Odds", table(COLUMNS, rows, "Odds of each ball")),
        Section("Where balls come to rest", _odds_picture(odds)),
    ]
    return Page(title, "Shot", sections, lead)


def _row(odds: Odds, ball: str) -> list[Content]:
    chances = {pocket: odds.chance(ball, pocket) for pocket in odds.shot.pockets}
    pocket, likeliest = max(chances.items(), key=lambda item: item[1].hits, default=("", None))
    rest = odds.rest(ball)
    rest_text = (
        [UNKNOWN, UNKNOWN]
        if rest is None
        else [f"{m:.3f} ± {s:.3f}" for m, s in zip(rest.mean, rest.spread, strict=True)]
    )
    pocket_text = isolated(pocket) if likeliest is not None and likeliest.hits else UNKNOWN
    return [isolated(ball), str(odds.chance(ball)), pocket_text, *rest_text]


def _odds_picture(odds: Odds) -> Markup:
    """Return heat maps of the rest positions of balls, as a picture embedded in the page."""
    stream = io.BytesIO()
    with catch_warnings():
        ignore_missing_glyphs()
        draw_rests(odds).savefig(stream, format="png", dpi=PICTURE_DPI)
    text = base64.b64encode(stream.getvalue()).decode("ascii")
    return Markup('<img src="data:image/png;base64,{}" alt="Where balls come to rest">').format(text)
