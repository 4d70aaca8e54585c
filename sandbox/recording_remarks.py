"""Remarks on the recording of a game: what it lacks, and how far its replay departs from the game."""

import numpy as np

from sandbox.formatting import format_quantity
from sandbox.recording import Recording, ReplayCheck
from sandbox.scene.compile.scene import Scene

MIN_PIXELS = 8.0
"""Median size of the moving bodies of a game, from which on its unit of length is taken for a pixel. Bodies of games in
metres are smaller, because solvers are made for 0.1 to 10 m; bodies of fewer pixels can hardly be seen."""


def is_in_pixels(scene: Scene) -> bool:
    """Return whether the lengths of a scene are probably pixels, judged by the sizes of its bodies."""
    bodies = scene.bodies
    sizes = 2.0 * bodies.radius[~bodies.fixed & (bodies.radius > 0.0)]
    return bool(len(sizes)) and float(np.median(sizes)) >= MIN_PIXELS


def remarks_on(recording: Recording) -> tuple[str, ...]:
    """Return what a recording lacks of its game, and how far its replay departs; empty if it is the game."""
    game = recording.game
    if game is None:
        return ()
    check = game.replay
    remarks = [f"left out: {each}" for each in game.omitted]
    if check is None or not check.is_equal:
        remarks += [f"a replay may differ by rounding: {each}" for each in game.inexact]
    if check is not None and not check.is_equal:
        remarks.append(replay_sentence(recording.scene, check))
    if remarks and recording.inputs is not None:
        remarks.append(f"`sandbox advise {recording.inputs.program}` runs the game itself, which lacks nothing of this")
    return tuple(remarks)


def replay_sentence(scene: Scene, check: ReplayCheck) -> str:
    """Return how far the replay of a game, on pymunk with the settings of the game, departs from it."""
    if check.is_equal:
        return "the replay equals the game after each step, bit for bit"
    if check.reason is not None:
        departs = "" if check.step is None else f"departs from the game at step {check.step} and "
        return f"the replay {departs}ends early: {check.reason}"
    at_end = "" if check.distance is None else f"{_length(scene, check.distance)} at the end: {check.body}"
    if check.distance == 0.0:
        at_end = "0 at the end"
    if check.step is None:
        if check.departed is None and check.largest is not None:
            return f"the replay differs from the game by rounding only, by up to {_length(scene, check.largest)}"
        return f"the replay can be compared with the game at the end only; the farthest body is {at_end or 'unknown'}"
    parts = [f"the replay departs from the game at step {check.step} ({check.departed})"]
    if check.largest is not None and check.largest > (check.distance or 0.0):
        parts.append(f"up to {_length(scene, check.largest)}")
    return ", ".join([*parts, at_end] if at_end else parts)


def _length(scene: Scene, length: float) -> str:
    return f"{length:.3g} px" if is_in_pixels(scene) else format_quantity(length, "m")
