"""Write the shots that billiards are compared with: scenes of this project, and results of pooltool.

    PYTHON-WITH-POOLTOOL -m tools.oracles.billiards [NAME…] [--out DIR]

Pooltool is an independent event-driven simulator of the same models. Its known faults are corrected at run time
(pooltool_world.py). Every run is then audited by our formulas (audit.py), and repeated with bodies separated by ten
times the distance, and with the first ball shifted by 1e-12 m. The differences limit the time up to which the file is
trusted. Each shot becomes NAME.toml and NAME.json; the scenes that benchmarks/pooltool_shots.py times are written too.
Pooltool 0.6.0 runs headless with numba 0.68 and panda3d 1.10, although it requires other versions.
"""

import argparse
import atexit
import json
import os
import shutil
import sys
import tempfile
from collections.abc import Collection
from pathlib import Path
from typing import Any

# Pooltool writes settings into the home folder; compiled patched code must not be mixed with its own cache.
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

TRUSTED = 1e-8
"""m; largest position error of trusted times."""
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


def simulated(
    document: Document,
    spacer: float = world.SPACER,
    shift: float = 0.0,
    corrections: Collection[str] = tuple(world.CORRECTIONS),
) -> list[Event]:
    """Return pooltool's events of a shot up to the duration of the scene, beginning with the start.

    Args:
        document: the scene.
        spacer: distance that the correction "spacer" sets, m.
        shift: distance along x by which the first ball is displaced, m.
        corrections: keys of `pooltool_world.CORRECTIONS`; those of all calls of a process must be the same.
    """
    world.correct(corrections, spacer)
    system = world.system(document)
    names = list(system.balls)
    system.balls[names[0]].state.rvw[0, 0] += shift
    end = document["world"]["duration"]
    done = pt.simulate(system, engine=world.engine(document, corrections), t_final=end)
    events: list[Event] = []
    states = np.array([[state.rvw for state in ball.history] for ball in done.balls.values()])
    states[:, :, 0, 2] = 0.0  # heights are only for drawing
    for index, event in enumerate(done.events):
        after = states[:, index]
        kind = str(event.event_type)
        if kind == "none" and index:
            continue
        before = after.copy()
        for agent in event.agents:
            if agent.id in names and index:
                before[names.index(agent.id)] = agent.initial.state.rvw
        before[:, 0, 2] = 0.0
        bodies = tuple(sorted(event.ids, key=names.index)) if kind == "ball_ball" else tuple(event.ids)
        events.append(Event(float(event.time), KINDS.get(kind, "start"), bodies if index else (), before, after))
    return [event for event in events if event.time <= end]


def sampled(rules: Rules, events: list[Event], times: list[float]) -> np.ndarray:
    """Return the states (T, N, 3, 3) at these times, advanced from the last event before each."""
    states = []
    for time in times:
        last = [event for event in events if event.time <= time][-1]
        states.append([rules.advanced(state, time - last.time) for state in last.after])
    return np.array(states)


def frames(document: Document) -> list[int]:
    """Return the indices of about 20 frames to sample, closer at the start, where most events are."""
    count = round(document["world"]["duration"] / document["solver"]["dt"])
    terms = SAMPLES
    while len(found := sorted({round(k) for k in np.geomspace(1.0, count, terms)})) < min(SAMPLES, count):
        terms += 1
    return found


def evaluated(document: Document) -> tuple[Document, Verdict]:
    """Return the document to store for a shot, and the verdict of the audit.

    Raises:
        ValueError: pooltool deviates from our formulas.
    """
    rules = Rules(document)
    events = simulated(document)
    verdict = audit(document, events)
    if verdict.position > 1e-11 or verdict.velocity > 1e-11 or max(verdict.overlap, verdict.separation) > 1e-10:
        raise ValueError(f"{document['title']}: off our formulas: {verdict}")
    dt = document["solver"]["dt"]
    indices = frames(document)
    times = [k * dt for k in indices]
    states = sampled(rules, events, times)
    error = np.zeros(len(times))
    trusted = document["world"]["duration"]
    for spacer, shift, divisor in ((10.0 * world.SPACER, 0.0, 9.0), (world.SPACER, 1e-12, 1.0)):
        other = simulated(document, spacer, shift)
        deviation = np.abs(sampled(rules, other, times) - states)[:, :, 0].max(axis=(1, 2)) / divisor
        error = np.maximum(error, deviation)
        for first, second in zip(events, other, strict=False):
            if (first.kind, first.names) != (second.kind, second.names):
                trusted = min(trusted, first.time, second.time)
                break
    wrong = [time for time, deviation in zip(times, error, strict=True) if deviation > TRUSTED]
    if wrong:
        trusted = min(trusted, max([time for time in times if time < wrong[0]], default=0.0))
    kept = sum(time <= trusted for time in times)
    states, last = states[:kept], events[-1]
    is_at_rest = last.time <= trusted and not last.after[:, 1:].any()
    stored = {
        "package": "pooltool-billiards",
        "version": pt.__version__,
        "patches": [*world.CORRECTIONS.values()],
        "trusted_until": trusted,
        "position_error": float(f"{max(error[:kept], default=0.0) + world.SPACER:.1e}"),
        "balls": rules.balls,
        "events": [{"time": e.time, "kind": e.kind, "names": [*e.names]} for e in events[1:] if e.time <= trusted],
        "frames": indices[:kept],
        "times": times[:kept],
        "position": states[:, :, 0, :2].tolist(),
        "velocity": states[:, :, 1, :2].tolist(),
        "spin": states[:, :, 2].tolist(),
        "rest": {"time": last.time, "position": last.after[:, 0, :2].tolist()} if is_at_rest else None,
    }
    return stored, verdict


def with_table(shot: Shot) -> Document:
    """Return the scene of a shot with its table, balls last."""
    document = {key: value for key, value in shot.document.items() if key != "ball"}
    return {**document, **(world.furniture(shot.furniture) if shot.furniture else {}), "ball": shot.document["ball"]}


def json_text(document: Any) -> str:
    """Return JSON with one line per key, which is readable and small."""
    lines = [f"{json.dumps(key)}: {json.dumps(value, separators=(',', ':'))}" for key, value in document.items()]
    return "{\n" + ",\n".join(lines) + "\n}\n"


def main() -> int:
    """Write the named shots, or all shots and the scenes that are timed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", metavar="NAME")
    parser.add_argument("--out", type=Path, default=CASES, metavar="DIR")
    arguments = parser.parse_args()
    atexit.register(shutil.rmtree, os.environ["HOME"])
    arguments.out.mkdir(parents=True, exist_ok=True)
    for shot in (shot for make in TO_COMPARE for shot in make()):
        if arguments.names and shot.name not in arguments.names:
            continue
        document = with_table(shot)
        stored, verdict = evaluated(document)
        (arguments.out / f"{shot.name}.toml").write_text(text(document))
        (arguments.out / f"{shot.name}.json").write_text(json_text(stored))
        print(
            f"{shot.name:24}{len(stored['events']):4} events, trusted to {stored['trusted_until']:g} of "
            f"{document['world']['duration']:g} s within {stored['position_error']:g} m; off our formulas by "
            f"{verdict.position:.1e} m, {verdict.velocity:.1e} m/s, overlap {verdict.overlap:.1e} m, "
            f"separation {verdict.separation:.1e} m"
        )
    if not arguments.names:
        SHOTS.mkdir(exist_ok=True)
        for shot in full():
            (SHOTS / f"{shot.name}.toml").write_text(text(with_table(shot)))
    return 0


if __name__ == "__main__":
    sys.exit(main())
