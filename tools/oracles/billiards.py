"""Write the shots that billiards are held against: scenes of ours, and what pooltool makes of them.

    PYTHON-WITH-POOLTOOL -m tools.oracles.billiards [NAME…] [--out DIR]

Pooltool is another hand's event-driven simulator of the same models. What is known to be at fault in it is put right
while it runs (pooltool_world.py); every run is then audited by formulas of our own (audit.py), and played
again with bodies parted by ten times the distance and with the first ball started 1e-12 m aside. What these change
bounds the time up to which the file is to be trusted. Each shot becomes NAME.toml and NAME.json; the scenes that
benchmarks/pooltool_shots.py times are written too. Pooltool 0.6.0 runs headless beside numba 0.68 and panda3d 1.10,
although it asks for others.
"""

import argparse
import atexit
import json
import os
import shutil
import sys
import tempfile
from pathlib import Path
from typing import Any

# Pooltool writes settings into the home folder; compiled code that is patched is not to be mixed with its own.
os.environ["HOME"] = os.environ["NUMBA_CACHE_DIR"] = tempfile.mkdtemp(prefix="pooltool-")

import numpy as np
import pooltool as pt

from tools.oracles import pooltool_world as world
from tools.oracles.audit import Event, Rules, Verdict, audit
from tools.oracles.billiard_shots import TO_COMPARE, full
from tools.oracles.scene_text import text
from tools.oracles.shot_parts import Document, Shot

CASES = Path(__file__).resolve().parents[2] / "tests" / "engines" / "exact" / "tabletop" / "cases"
SHOTS = Path(__file__).resolve().parents[1] / "benchmarks" / "shots"

SPACER = 1e-12
"""m, by which pooltool parts bodies that have met, so that they do not meet again at once."""
TRUSTED = 1e-8
"""m, by which a run may be off where it counts."""
SAMPLES = 20

KINDS = {
    "ball_ball": "ball_ball",
    "ball_linear_cushion": "cushion",
    "ball_circular_cushion": "cushion",
    "ball_pocket": "pocket",
    "sliding_rolling": "slide_roll",
    "rolling_spinning": "roll_spin",
    "rolling_stationary": "roll_stop",
    "spinning_stationary": "spin_stop",
}


def played(document: Document, spacer: float, aside: float = 0.0) -> list[Event]:
    """Return pooltool's events of a shot up to the scene's duration, the start first."""
    world.correct(spacer)
    system = world.system(document)
    names = list(system.balls)
    system.balls[names[0]].state.rvw[0, 0] += aside
    end = document["world"]["duration"]
    done = pt.simulate(system, engine=world.engine(document), t_final=end)
    events: list[Event] = []
    states = np.array([[state.rvw for state in ball.history] for ball in done.balls.values()])
    states[:, :, 0, 2] = 0.0  # heights: where it draws balls, nothing that moves
    for number, event in enumerate(done.events):
        after = states[:, number]
        kind = str(event.event_type)
        if kind == "none" and number:
            continue
        before = after.copy()
        for agent in event.agents:
            if agent.id in names and number:
                before[names.index(agent.id)] = agent.initial.state.rvw
        before[:, 0, 2] = 0.0
        who = tuple(sorted(event.ids, key=names.index)) if kind == "ball_ball" else tuple(event.ids)
        events.append(Event(float(event.time), KINDS.get(kind, "start"), who if number else (), before, after))
    return [event for event in events if event.time <= end]


def sampled(rules: Rules, events: list[Event], times: list[float]) -> np.ndarray:
    """Return the states (T, N, 3, 3) at some times, moved on from the last event before each."""
    made = []
    for time in times:
        last = [event for event in events if event.time <= time][-1]
        made.append([rules.moved(state, time - last.time) for state in last.after])
    return np.array(made)


def frames(document: Document) -> list[int]:
    """Return the numbers of the frames to sample: some 20, closer at the start, where most happens."""
    count = round(document["world"]["duration"] / document["solver"]["dt"])
    terms = SAMPLES
    while len(found := sorted({round(k) for k in np.geomspace(1.0, count, terms)})) < min(SAMPLES, count):
        terms += 1
    return found


def judged(document: Document) -> tuple[Document, Verdict]:
    """Return what is to be stored of a shot, and our own verdict on it.

    Raises:
        ValueError: pooltool is off our formulas.
    """
    rules = Rules(document)
    events = played(document, SPACER)
    verdict = audit(document, events)
    if verdict.position > 1e-11 or verdict.velocity > 1e-11 or max(verdict.overlap, verdict.parted) > 1e-10:
        raise ValueError(f"{document['title']}: off our formulas: {verdict}")
    dt = document["solver"]["dt"]
    numbers = frames(document)
    times = [k * dt for k in numbers]
    states = sampled(rules, events, times)
    error = np.zeros(len(times))
    trusted = document["world"]["duration"]
    for spacer, aside, share in ((10.0 * SPACER, 0.0, 9.0), (SPACER, 1e-12, 1.0)):
        other = played(document, spacer, aside)
        off = np.abs(sampled(rules, other, times) - states)[:, :, 0].max(axis=(1, 2)) / share
        error = np.maximum(error, off)
        for one, two in zip(events, other, strict=False):
            if (one.kind, one.names) != (two.kind, two.names):
                trusted = min(trusted, one.time, two.time)
                break
    wrong = [time for time, off in zip(times, error, strict=True) if off > TRUSTED]
    if wrong:
        trusted = min(trusted, max([time for time in times if time < wrong[0]], default=0.0))
    kept = sum(time <= trusted for time in times)
    states, last = states[:kept], events[-1]
    rests = last.time <= trusted and not last.after[:, 1:].any()
    stored = {
        "package": "pooltool-billiards",
        "version": pt.__version__,
        "patches": [*world.PATCHES, f"bodies that met are parted by {SPACER:g} m instead of 1e-06 m"],
        "trusted_until": trusted,
        "position_error": float(f"{max(error[:kept], default=0.0) + SPACER:.1e}"),
        "balls": rules.balls,
        "events": [{"time": e.time, "kind": e.kind, "names": [*e.names]} for e in events[1:] if e.time <= trusted],
        "frames": numbers[:kept],
        "times": times[:kept],
        "position": states[:, :, 0, :2].tolist(),
        "velocity": states[:, :, 1, :2].tolist(),
        "spin": states[:, :, 2].tolist(),
        "rest": {"time": last.time, "position": last.after[:, 0, :2].tolist()} if rests else None,
    }
    return stored, verdict


def furnished(shot: Shot) -> Document:
    """Return a shot's scene with its table, balls last."""
    about = {key: value for key, value in shot.document.items() if key != "ball"}
    return {**about, **(world.furniture(shot.furniture) if shot.furniture else {}), "ball": shot.document["ball"]}


def written(document: Any) -> str:
    """Return JSON with a line a key, so that a file shows what it holds and stays small."""
    lines = [f"{json.dumps(key)}: {json.dumps(value, separators=(',', ':'))}" for key, value in document.items()]
    return "{\n" + ",\n".join(lines) + "\n}\n"


def main() -> int:
    """Write the shots that are named, or all; and the scenes of those that are timed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", metavar="NAME")
    parser.add_argument("--out", type=Path, default=CASES, metavar="DIR")
    arguments = parser.parse_args()
    atexit.register(shutil.rmtree, os.environ["HOME"])
    arguments.out.mkdir(parents=True, exist_ok=True)
    for shot in (shot for make in TO_COMPARE for shot in make()):
        if arguments.names and shot.name not in arguments.names:
            continue
        document = furnished(shot)
        stored, verdict = judged(document)
        (arguments.out / f"{shot.name}.toml").write_text(text(document))
        (arguments.out / f"{shot.name}.json").write_text(written(stored))
        print(
            f"{shot.name:24}{len(stored['events']):4} events, trusted to {stored['trusted_until']:g} of "
            f"{document['world']['duration']:g} s within {stored['position_error']:g} m; off our formulas by "
            f"{verdict.position:.1e} m, {verdict.velocity:.1e} m/s, overlap {verdict.overlap:.1e} m, "
            f"parted {verdict.parted:.1e} m"
        )
    if not arguments.names:
        SHOTS.mkdir(exist_ok=True)
        for shot in full():
            (SHOTS / f"{shot.name}.toml").write_text(text(furnished(shot)))
    return 0


if __name__ == "__main__":
    sys.exit(main())
