"""Warnings about a run that has reached its end.

It ended after its duration, its energy rose without a source, or its joints are less accurate than its integrator.
"""

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from sandbox.engines.reference.integrators import INTEGRATORS
from sandbox.measure.metrics.invariants import CONSTRAINT_KINDS, energy_gain
from sandbox.scene.compile.scene import Scene
from sandbox.schedule import ROUNDING
from sandbox.trajectory import Trajectory

MAX_ENERGY_GAIN = 0.1
"""Energy counts as created if it exceeds its initial value by a larger fraction of the exchanged energy: position
correction adds less at usual steps.
"""
MAX_FRAMES = 200
"""Largest number of frames at which the energy is computed."""


def run_warnings(run: Trajectory, scene: Scene, energy: tuple[float, float]) -> Iterator[str]:
    """Yield what to know about a run with the status `ok`.

    Args:
        run: the run.
        scene: its scene.
        energy: total energy at its start and end, J.
    """
    end, duration = float(run.time[-1]), scene.world.duration
    if end > duration * (1.0 + ROUNDING) and "game" not in run.info:
        name = run.info["engine"]
        yield f"{name} makes whole steps of dt only: the run ends at {end:.6g} s, after its duration of {duration:g} s"
    if run.info["engine"] == "reference" and (text := wasted_integrator(scene, run.info["settings"])):
        yield text
    if _may_gain(run, scene) and energy[1] > energy[0]:
        frames = np.unique(np.linspace(0, len(run.time) - 1, min(len(run.time), MAX_FRAMES)).astype(np.int64)).tolist()
        gain = energy_gain(run.at(frames), scene)
        if gain > MAX_ENERGY_GAIN:
            yield (
                f"the energy rose from {energy[0]:.4g} to {energy[1]:.4g} J without a source{_remedy(run.info, scene)}"
            )


class JointOrder(NamedTuple):
    """Order of convergence that joints have at most on `reference`."""

    order: int
    text: str


def joint_order_limit(scene: Scene, joints: str) -> JointOrder | None:
    """Return the order to which a joint method limits every integrator; None without rigid joints.

    Args:
        scene: the scene.
        joints: method, as `solver.joints`.
    """
    if not len(scene.joint_arrays.of(*CONSTRAINT_KINDS)):
        return None
    order = 2 if joints == "rattle" else 1
    remedy = "" if order == 2 else '; solver.joints = "rattle" gives order 2'
    return JointOrder(order, f"rigid joints by {joints} limit every integrator to order {order}{remedy}")


def wasted_integrator(scene: Scene, settings: Mapping[str, Any]) -> str | None:
    """Return the reason if rigid joints on `reference` are less accurate than the integrator in the settings."""
    integrator = settings["integrator"]
    limit = joint_order_limit(scene, settings["joints"] or "impulses")
    if integrator is None or limit is None or INTEGRATORS[integrator].order <= limit.order:
        return None
    return f"{integrator} gains nothing for joints: {limit.text}"


def _may_gain(run: Trajectory, scene: Scene) -> bool:
    """Return whether nothing does work on a scene, as far as `energy_gain` does not see it."""
    has_work = run.info["actions"] or "game" in run.info or scene.zones
    return not (has_work or (scene.bodies.born > 0.0).any() or np.isfinite(run.retired_time).any())


def _remedy(info: Mapping[str, Any], scene: Scene) -> str:
    oscillates = len(scene.joint_arrays) > 0 or bool(scene.attractions or scene.liquids)
    if info["engine"] == "reference" and info["settings"]["integrator"] == "explicit_euler" and oscillates:
        return "; explicit Euler gains energy in every oscillation: use solver.integrator = 'semi_implicit_euler'"
    return "; use a smaller dt or more substeps"
