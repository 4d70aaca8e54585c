"""A run as a page: its replay, its energy, and its key figures."""

from dataclasses import replace

import numpy as np

from sandbox.measure.collisions import collisions, first_collision
from sandbox.measure.energy import energies
from sandbox.report.page.document import Page, Section
from sandbox.report.page.markup import Child, Markup, joined, tag
from sandbox.report.page.replay import Track, replay
from sandbox.report.page.tables import Column, pairs, table
from sandbox.report.page.time_chart import Curve, energy_chart
from sandbox.report.page.verdicts import look_of
from sandbox.report.page.wording import NONE, number
from sandbox.scene.files.load import from_session
from sandbox.scene.scene import Scene
from sandbox.trajectory import Trajectory

MAX_LISTED = 12
"""Bodies whose final state is listed."""
FINAL = (
    Column("body"),
    Column("x, m", True),
    Column("y, m", True),
    Column("v_x, m/s", True),
    Column("v_y, m/s", True),
)


def run_page(run: Trajectory, replayed: bool = True) -> Page:
    """Return the page of a run.

    Args:
        run: which; one without frames, as of an engine that refused the scene, is its status and reason.
        replayed: with the replay.
    """
    scene = from_session(dict(run.info["scene"]), "info.scene")
    sections: list[Section] = []
    if len(run.time) and replayed:
        sections.append(Section("Replay", _replay(run, scene)))
    sections.append(Section("Figures", pairs(_figures(run))))
    if len(run.time):
        sections.append(Section("Final state", _final(run)))
    lead = joined(tag("p", tag("bdi", str(run.reason)))) if run.reason else None
    engine = run.info.get("engine")
    return Page(scene.title or "Untitled scene", f"Run on {engine}" if engine else "Run", sections, lead)


def _replay(run: Trajectory, scene: Scene) -> Markup:
    """Return the replay, and beside it the energy where the run has the scene's own bodies and joints."""
    name = str(run.info.get("engine") or "truth")
    look = look_of(name)
    own_bodies = len(run.names) == len(scene.bodies)
    own_joints = len(run.broken_time) in (0, len(scene.links))
    if not own_joints:
        return tag("p", "The run changed its joints; `sandbox replay` shows it.")
    shown = run if own_bodies else _with_bodies(run, len(scene.bodies))
    canvas = replay(scene, [Track(name, look, shown)], None)
    if not own_bodies:
        spawned = len(run.names) - len(scene.bodies)
        return joined(canvas, tag("p", f"Without {spawned:,} bodies that were added during the run.", class_="soft"))
    total = energies(run, scene).total
    finite = np.where(np.isfinite(total), total, np.nan)
    duration = max(scene.world.duration, float(run.time[-1]))
    curve = Curve(name, look, run.time, finite)
    chart = energy_chart([curve], "total energy", duration, None, "run-energy", whole=True)
    return tag("div", canvas, tag("div", chart, class_="plots"), class_="side linked")


def _with_bodies(run: Trajectory, count: int) -> Trajectory:
    """Return a run with its first bodies alone: those of the scene; added ones follow."""
    columns = ("position", "velocity", "angle", "angular_velocity")
    kept = {key: getattr(run, key)[:, :count] for key in columns}
    return replace(run, names=run.names[:count], retired_time=run.retired_time[:count], **kept)


def _figures(run: Trajectory) -> list[tuple[str, str]]:
    info = run.info
    settings = info.get("settings") or {}
    missed = run.missed_contacts
    start, end = info.get("energy_start"), info.get("energy_end")
    first = first_collision(run)
    return [
        ("engine", str(info.get("engine") or NONE)),
        ("status", run.status),
        ("bodies", f"{len(run.names):,}"),
        ("frames", f"{len(run.time):,}" + (f", to {number(float(run.time[-1]), 4)} s" if len(run.time) else "")),
        ("dt", f"{number(settings['dt'], 4)} s" if "dt" in settings else NONE),
        ("energy", f"{number(start, 4)} → {number(end, 4)} J"),
        ("contacts", f"{collisions(run):,}"),
        ("first contact", NONE if first is None else f"{number(first, 6)} s"),
        ("missed contacts", NONE if missed is None else f"{missed:,}"),
        ("computing time", f"{number(info.get('seconds'))} s"),
    ]


def _final(run: Trajectory) -> Markup:
    rows: list[list[Child]] = [
        [tag("bdi", name), *(number(value, 4) for value in (*position, *velocity))]
        for name, position, velocity in zip(
            run.names[:MAX_LISTED].tolist(),
            run.position[-1, :MAX_LISTED].tolist(),
            run.velocity[-1, :MAX_LISTED].tolist(),
            strict=True,
        )
    ]
    more = len(run.names) - MAX_LISTED
    note = tag("p", f"and {more:,} more bodies", class_="soft") if more > 0 else None
    return joined(table(FINAL, rows, "Final state"), note)
