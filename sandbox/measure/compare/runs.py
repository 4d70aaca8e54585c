"""Runs to be compared: what each keeps, and frames of one that also another has."""

import numpy as np

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.scene.description.world import Settings
from sandbox.scene.files.document import to_document
from sandbox.scene.scene import Scene
from sandbox.trajectory import Contacts, Trajectory

SAME_TIME = 1e-6
"""Frames closer than this share of a run's shortest interval are of the same time: the rounding of k·dt."""


def frames_as_run(
    scene: Scene,
    settings: Settings,
    time: FloatArray,
    state: tuple[FloatArray, FloatArray, FloatArray, FloatArray],
    contacts: Contacts,
    retired: FloatArray,
) -> Trajectory:
    """Return frames that no engine made as a run: position, velocity, angle and angular velocity at T times."""
    position, velocity, angle, spin = state
    return Trajectory(
        time=time,
        position=position,
        velocity=velocity,
        angle=angle,
        angular_velocity=np.broadcast_to(spin, angle.shape),
        names=np.asarray(scene.bodies.names, dtype=np.str_),
        contact_time=contacts.time,
        contact_pair=contacts.pair,
        contact_point=contacts.point,
        contact_normal=contacts.normal,
        contact_impulse=contacts.impulse,
        retired_time=retired,
        missed_time=np.empty(0),
        missed_pair=np.empty((0, 2), np.int64),
        info={
            "scene": to_document(scene),
            "engine": None,
            "settings": settings.model_dump(mode="json"),
            "actions": [],
            "status": "ok",
            "reason": None,
            "seconds": 0.0,
            "audited": False,
        },
    )


def common_frames(a: Trajectory, b: Trajectory) -> tuple[IntArray, IntArray]:
    """Return the numbers of the frames (K,) that two runs have of the same times."""
    if not len(a.time) or not len(b.time):
        return np.empty(0, np.int64), np.empty(0, np.int64)
    after = np.searchsorted(b.time, a.time).clip(1, max(len(b.time) - 1, 1))
    before = after - 1
    after = after.clip(0, len(b.time) - 1)
    nearest = np.where(np.abs(b.time[before] - a.time) <= np.abs(b.time[after] - a.time), before, after)
    slack = SAME_TIME * min(float(np.min(np.diff(each.time), initial=np.inf)) for each in (a, b))
    same = np.abs(b.time[nearest] - a.time) <= slack
    return np.flatnonzero(same), nearest[same]


def there(run: Trajectory, frames: IntArray) -> BoolArray:
    """Tell which bodies have not been retired at some frames, (K, N)."""
    gone = np.where(np.isnan(run.retired_time), np.inf, run.retired_time)
    return np.asarray(run.time[frames, None] < gone)
