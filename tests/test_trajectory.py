"""Trajectories: saving, loading, contacts and status."""

import dataclasses
import math
import random
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from sandbox.trajectory import ContactEvent, Contacts, Trajectory

ARRAYS = [field.name for field in dataclasses.fields(Trajectory) if field.name != "info"]


def trajectory(frames: int = 4, bodies: int = 3, contacts: int = 2, **info: Any) -> Trajectory:
    """Return a trajectory of random numbers; its scene has that many bodies and one plane per contact."""
    draw = np.random.default_rng(1).standard_normal
    names = [f"bödy {k} 🎱" for k in range(bodies)]
    ramp = {"position": [0.0, 0.0], "radius": 1.0, "to_layer": "ramp"}
    balls = [{"name": name, "position": [3.0 * k, 0.0], "radius": 1.0} for k, name in enumerate(names)]
    planes = [{"point": [0.0, -9.0 - k], "normal": [0.0, 1.0]} for k in range(contacts)]
    missed = min(bodies // 2, 1)
    return Trajectory(
        time=np.arange(frames) * 0.1,
        position=draw((frames, bodies, 2)),
        velocity=draw((frames, bodies, 2)),
        angle=draw((frames, bodies)),
        angular_velocity=draw((frames, bodies)),
        names=np.array(names, dtype=np.str_),
        contact_time=np.sort(np.abs(draw(contacts))),
        contact_pair=np.array([[k, -1 - k] for k in range(contacts)], dtype=np.int64).reshape(-1, 2),
        contact_point=draw((contacts, 2)),
        contact_normal=draw((contacts, 2)),
        contact_impulse=draw((contacts, 2)),
        retired_time=np.array([math.nan] * bodies),
        missed_time=np.abs(draw(missed)),
        missed_pair=np.array([[0, 1]] * missed, dtype=np.int64).reshape(-1, 2),
        spin=draw((frames, bodies, 3)),
        layer=np.arange(frames * bodies, dtype=np.int16).reshape(frames, bodies) % 2,
        info={
            "scene": {"title": "é", "ball": balls, "plane": planes, "zone": [ramp]},
            "engine": "pymunk",
            "settings": {},
            "seed": 0,
            "versions": {"numpy": np.__version__},
            "status": "ok" if frames else "refused",
            "reason": None,
            "steps": frames,
            "seconds": 0.25,
            "energy_start": 0.1,
            "energy_end": math.nan,
            "audited": True,
            **info,
        },
    )


def equal(a: Trajectory, b: Trajectory) -> bool:
    """Return whether two trajectories are equal bit by bit, including the types of their arrays."""
    same = all(
        getattr(a, key).dtype == getattr(b, key).dtype
        and getattr(a, key).shape == getattr(b, key).shape
        and getattr(a, key).tobytes() == getattr(b, key).tobytes()
        for key in ARRAYS
    )
    return same and repr(a.info) == repr(b.info)  # repr, because info contains nan


@pytest.mark.parametrize("shape", [(4, 3, 2), (1, 0, 0), (0, 0, 0), (2, 1, 0)])
def test_trajectory_round_trips_bit_for_bit(tmp_path: Path, shape: tuple[int, int, int]) -> None:
    before = trajectory(*shape)
    path = before.save(tmp_path / "run.npz")
    assert path == tmp_path / "run.npz"
    assert equal(Trajectory.load(path), before)
    assert [entry.name for entry in tmp_path.iterdir()] == ["run.npz"]


def test_nan_infinities_and_subnormals_round_trip(tmp_path: Path) -> None:
    before = trajectory()
    before.info["status"] = "diverged"  # a complete run must have finite states
    before.position[:] = np.resize([math.nan, math.inf, -math.inf, -0.0, 5e-324, 1.7e308], before.position.shape)
    assert equal(Trajectory.load(before.save(tmp_path / "run.npz")), before)


def test_file_is_saved_under_the_given_name(tmp_path: Path) -> None:
    for name in ("run", "run.tmp", "a b.é.npz", ".hidden"):
        path = trajectory().save(tmp_path / name)
        assert path.name == name
        assert path.exists()
    assert len(list(tmp_path.iterdir())) == 4


class Interrupted(BaseException):
    """Stand-in for KeyboardInterrupt."""


@pytest.mark.parametrize("error", [OSError("disk full"), Interrupted(), MemoryError()])
def test_failed_write_leaves_no_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, error: BaseException) -> None:
    def write_half(stream: Any, **arrays: Any) -> None:
        stream.write(b"half a file")
        raise error

    monkeypatch.setattr(np, "savez_compressed", write_half)
    with pytest.raises(type(error)):
        trajectory().save(tmp_path / "run.npz")
    assert list(tmp_path.iterdir()) == []


def test_failed_write_keeps_the_previous_file(tmp_path: Path) -> None:
    path = trajectory().save(tmp_path / "run.npz")
    before = path.read_bytes()
    with pytest.raises(TypeError):
        trajectory(9, reason=object()).save(path)  # not a JSON value
    assert path.read_bytes() == before
    assert [entry.name for entry in tmp_path.iterdir()] == ["run.npz"]


def test_failed_rename_leaves_no_temporary_file(tmp_path: Path) -> None:
    (tmp_path / "run.npz").mkdir()
    with pytest.raises(OSError, match=r"run\.npz"):
        trajectory().save(tmp_path / "run.npz")
    assert [entry.name for entry in tmp_path.iterdir()] == ["run.npz"]


def test_missing_file_raises_file_not_found(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        Trajectory.load(tmp_path / "none.npz")


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.randoms(use_true_random=False), st.integers(0, 1))
def test_damaged_file_is_refused_or_read(tmp_path: Path, chance: random.Random, cut: int) -> None:
    path = trajectory().save(tmp_path / "run.npz")
    content = bytearray(path.read_bytes())
    if cut:
        del content[chance.randrange(len(content)) :]
    else:
        for _ in range(chance.randrange(1, 4)):
            content[chance.randrange(len(content))] = chance.randrange(256)
    path.write_bytes(content)
    try:
        assert isinstance(Trajectory.load(path), Trajectory)
    except ValueError as error:
        assert "is not a stored run" in str(error)


def test_number_returns_the_index_of_a_named_body() -> None:
    assert trajectory().number("bödy 1 🎱") == 1
    with pytest.raises(KeyError):
        trajectory().number("bödy")


def test_status_reason_and_missed_contacts_are_read_from_info() -> None:
    done = trajectory(status="diverged", reason="too fast")
    assert (done.status, done.reason, done.missed_contacts) == ("diverged", "too fast", 1)
    assert trajectory().reason is None
    assert trajectory(audited=False).missed_contacts is None


def test_contacts_iterate_as_contact_events() -> None:
    run = trajectory(contacts=2)
    contacts = Contacts(run.contact_time, run.contact_pair, run.contact_point, run.contact_normal, run.contact_impulse)
    rows = list(contacts)
    assert len(contacts) == len(rows) == 2
    assert rows[1] == ContactEvent(
        time=float(run.contact_time[1]),
        pair=(1, -2),
        point=(float(run.contact_point[1, 0]), float(run.contact_point[1, 1])),
        normal=(float(run.contact_normal[1, 0]), float(run.contact_normal[1, 1])),
        impulse=(float(run.contact_impulse[1, 0]), float(run.contact_impulse[1, 1])),
    )
    assert [type(value) for value in (rows[1].time, *rows[1].pair)] == [float, int, int]


def test_empty_contacts_have_arrays_of_the_same_types() -> None:
    none = Contacts.none()
    assert len(none) == 0
    assert list(none) == []
    assert none.time.shape == (0,)
    assert none.pair.shape == none.point.shape == none.normal.shape == none.impulse.shape == (0, 2)
    assert none.pair.dtype == np.int64


def test_contacts_recorded_in_parts_are_merged() -> None:
    """Rows with equal time and pair merge into one contact: the first row with the sum of all impulses."""
    lasting, other = (0.5, (0, -1)), (0.5, (1, -1))
    rows = [(lasting, 1.0), (other, 2.0), ((0.7, (0, -1)), 4.0), (lasting, 8.0), (other, 16.0), (lasting, 32.0)]
    time = np.array([key[0] for key, _ in rows])
    pair = np.array([key[1] for key, _ in rows], np.int64)
    points = np.arange(12.0).reshape(6, 2)
    impulse = np.array([[value, -value] for _, value in rows])
    merged = Contacts(time, pair, points, points + 100.0, impulse).merged()
    assert [(event.time, event.pair) for event in merged] == [lasting, other, (0.7, (0, -1))]
    assert merged.impulse.tolist() == [[41.0, -41.0], [18.0, -18.0], [4.0, -4.0]]
    assert merged.point.tolist() == points[:3].tolist()
    assert merged.normal.tolist() == (points[:3] + 100.0).tolist()
    assert merged.merged() is merged
    assert len(Contacts.none().merged()) == 0
