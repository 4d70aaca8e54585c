"""Patience: runs that are given up where they take too long."""

from time import perf_counter

from sandbox.measure.run import run
from sandbox.scene.model import Scene
from sandbox.scene.settings import Settings
from sandbox.trajectory import Trajectory


class TookTooLongError(Exception):
    """A run was given up."""


def patient_run(scene: Scene, engine: str, settings: Settings, seconds: float, *, audit: bool = False) -> Trajectory:
    """Run a scene, but give up after some time; looked at between steps, as a step cannot be interrupted.

    The time runs from the end of the first step on: an engine may compile in it.

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
        began = perf_counter() if began is None else began
        if share < 1.0 and perf_counter() - began > seconds:
            raise TookTooLongError(f"given up after {seconds:.3g} s, {share:.0%} done")

    return run(scene, engine, audit=audit, progress=watch, **settings.model_dump())
