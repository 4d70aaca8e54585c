"""Process in which a game runs again: it reads a request from standard input, and writes an answer and its states.

What the game prints goes to standard error.
"""

import base64
import json
import os
import runpy
import sys
import time
import traceback
from collections.abc import Mapping
from contextlib import ExitStack
from pathlib import Path
from statistics import median_low
from typing import Any
from unittest.mock import patch

from sandbox.worker_process import limit_cpu_time, limit_memory, private_stdout


def main() -> None:
    """Answer one request."""
    answers = private_stdout()
    request = json.loads(sys.stdin.readline())
    os.environ |= {"SDL_VIDEODRIVER": "dummy", "SDL_AUDIODRIVER": "dummy"}
    limit_memory(request["memory_limit"])
    limit_cpu_time(request["time_limit"])
    sys.dont_write_bytecode = True
    json.dump(_answer(request), answers)
    answers.write("\n")
    answers.flush()


def _answer(request: dict[str, Any]) -> dict[str, Any]:
    """Run the game, write its states, and return the rest."""
    import numpy as np

    from sandbox.game_inputs import jittered, load_inputs
    from sandbox.pymunk_capture.pymunk6 import pymunk6_names
    from sandbox.rehearsal.guard import deny_changes, mirror_folders
    from sandbox.rehearsal.space_log import SpaceLog
    from sandbox.rehearsal.step_settings import Nudge, RehearsalSettings, steps_with
    from sandbox.rehearsal.surroundings import replayed, started_as

    inputs = load_inputs(request["inputs"])
    if request["jitter_seed"] is not None:
        inputs = jittered(inputs, request["jitter_seed"])
    program, scratch = Path(request["program"]).resolve(), Path(request["scratch"])
    own_folder = program if program.is_dir() else program.parent
    saved = {
        Path(os.path.normpath(own_folder / name)): None if content is None else base64.b64decode(content)
        for name, content in inputs.saved_files.items()
    }
    kept = [own_folder, Path.cwd()]
    originals: dict[str, str] = {}
    if saved:
        mirrors = mirror_folders(kept, saved, scratch / "files")
        originals = {str(mirror): str(folder) for folder, mirror in mirrors.items()}
        program = mirrors[own_folder] / program.relative_to(own_folder)
        os.chdir(mirrors[Path.cwd()])
    name = str(program)
    log, notes = SpaceLog(), dict[str, None]()
    ended, failure = "program", None
    nudge = None if request["nudge"] is None else Nudge(**request["nudge"])
    with Path(os.devnull).open() as nothing, ExitStack() as stack:
        stack.enter_context(patch.object(sys, "stdin", nothing))
        if inputs.pymunk6:
            stack.enter_context(pymunk6_names())
        steps = stack.enter_context(steps_with(RehearsalSettings(**request["settings"]), nudge=nudge))
        tape = stack.enter_context(replayed(inputs, log, draws=request["draws"]))
        stack.enter_context(started_as(name, inputs.arguments))
        if not request["draws"]:
            _leave_out_drawing(stack)
        deny_changes(scratch, kept, lambda remark: notes.setdefault(remark))
        start = time.thread_time()
        try:
            runpy.run_path(name, run_name="__main__")
        except SystemExit as end:
            ended = "inputs" if type(end) is not SystemExit else "program"
        except BaseException as error:  # noqa: BLE001, of the user's program
            traceback.print_exc()
            ended, failure = "error", f"{type(error).__name__}: {error}"
        seconds = time.thread_time() - start
    sys.stdout.flush()
    unread = [kind for kind in tape.unread if kind not in inputs.notes]
    offsets = np.cumsum([0, *(len(frame.bodies) for frame in log.frames)])
    np.savez(
        request["states"],
        offsets=offsets,
        bodies=np.concatenate([frame.bodies for frame in log.frames] or [np.empty(0, np.int64)]),
        states=np.concatenate([frame.states for frame in log.frames] or [np.empty((0, 6))]),
    )
    return {
        "callbacks": list(log.callbacks),
        # The order of `separate` callbacks within a step follows the addresses of shapes in memory.
        "calls": [[frame, callback, *shapes, count] for (frame, callback, shapes), count in sorted(log.calls.items())],
        "shape_bodies": list(log.shape_bodies.items()),
        "shapes": list(log.shapes.items()),
        "changes": log.changes,
        "shape_changes": log.shape_changes,
        "body_names": sorted(log.body_names.items()),
        "hashes": log.hashes,
        "own_settings": log.settings,
        "gravity": log.gravity,
        "window": log.window,
        "dts": [min(log.dts), median_low(log.dts), max(log.dts)] if log.dts else [0.0, 0.0, 0.0],
        "step_calls": [[_original(file, originals), line] for (file, line), _ in log.step_calls.most_common()],
        "has_forces": steps.has_forces,
        "impulse_readers": sorted(log.impulse_readers),
        "steps": log.steps,
        "ended": ended,
        "failure": failure,
        "seconds": seconds,
        "step_seconds": steps.seconds,
        "notes": [*notes, *(f"readings that the recording has none of: {kind}" for kind in unread)],
    }


def _original(file: str, originals: Mapping[str, str]) -> str:
    """Return the path of a file of the game, which may run in a mirror of its folder."""
    found = next((mirror for mirror in originals if Path(file).is_relative_to(mirror)), None)
    return file if found is None else str(Path(originals[found]) / Path(file).relative_to(found))


def _leave_out_drawing(stack: ExitStack) -> None:
    """Let nothing reach the window: its surface is clipped to nothing, and pymunk draws no spaces."""
    import pygame
    import pymunk

    set_mode = pygame.display.set_mode

    def clipped(*arguments: Any, **more: Any) -> pygame.Surface:
        surface = set_mode(*arguments, **more)
        surface.set_clip(pygame.Rect(0, 0, 0, 0))
        return surface

    stack.enter_context(patch.object(pygame.display, "set_mode", clipped))
    stack.enter_context(patch.object(pymunk.Space, "debug_draw", lambda _space, _options: None))


if __name__ == "__main__":
    main()
