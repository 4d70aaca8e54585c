"""Patience: runs that are given up where they take too long."""

from time import perf_counter

from sandbox.engines.compiling import COMPILING
from sandbox.measure.run import run
from sandbox.scene.model import Scene
from sandbox.scene.settings import Settings
from sandbox.trajectory import Trajectory


class TookTooLongError(Exception):
    """A run was given up."""


def working() -> float:
    """Return the time by a clock that stands still while something is compiled, s: only differences mean anything."""
    return perf_counter() - COMPILING.seconds


def patient_run(scene: Scene, engine: str, settings: Settings, seconds: float, *, audit: bool = False) -> Trajectory:
    """Run a scene, but give up after some time; looked at between steps, as a step cannot be interrupted.

    The time runs from the end of the first step on, and stands still while an engine compiles.

    Args:
        scene: what to run.
        engine: its name.
        settings: all of them; the scene's own do not count.
        seconds: how long it may take.
        audit: count the contacts that the engine misses.

    Raises:
        TookTooLongError: it took longer.
        TooLargeError: the frames would not fit into memory.
    """
    began: float | None = None

    def watch(share: float) -> None:
        nonlocal began
        began = working() if began is None else began
        if share < 1.0 and working() - began > seconds:
            raise TookTooLongError(f"given up after {seconds:.3g} s, {share:.0%} done")

    return run(scene, engine, audit=audit, progress=watch, **settings.model_dump())
