"""Notes on break shots: racks whose balls touch, and steps too long to resolve grazing contacts."""

import math
from typing import Any

import pytest

from sandbox.arrays import FloatArray
from sandbox.engines.registry import start
from sandbox.measure.preflight import notes
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import from_document

pytestmark = pytest.mark.fail_slow(60)  # long runs and sweeps

RADIUS = 0.03


def rack(gap: float, rate: float, rows: int = 3, **more: Any) -> Scene:
    pitch = 2 * RADIUS + gap
    positions = [(0.0, 0.0)]
    positions += [
        (0.3 + row * pitch * math.sqrt(0.75), (k - row / 2) * pitch) for row in range(rows) for k in range(row + 1)
    ]
    balls = [{"position": position, "radius": RADIUS, "restitution": 0.95} for position in positions]
    return from_document(
        {
            "solver": {"dt": 1.0 / rate},
            "surface": {"sliding_friction": 0.2},
            "contact_models": {"ball_ball": "frictional"},
            "ball": [{**balls[0], "velocity": [5.0, 0.01]}, *balls[1:]],
            **more,
        }
    )


def note_kinds(scene: Scene) -> list[str]:
    return [note.kind for note in notes(scene)]


def test_touching_racks_and_long_steps_are_noted() -> None:
    assert note_kinds(rack(0.0, 1000)) == ["rack"]
    assert note_kinds(rack(1e-4, 1000)) == []
    assert note_kinds(rack(1e-4, 60)) == ["graze"]
    assert note_kinds(rack(1e-4, 60, surface={}, contact_models={})) == []
    assert note_kinds(rack(0.0, 60, rows=1)) == []  # two balls are no break


def test_recommended_step_is_the_longest_without_a_note() -> None:
    (note,) = notes(rack(1e-4, 60))
    safe = float(note.details["safe_dt"])
    assert note_kinds(rack(1e-4, 1.001 / safe)) == []
    assert note_kinds(rack(1e-4, 0.999 / safe)) == ["graze"]


def final_positions(gap: float, rate: float) -> FloatArray:
    scene = rack(gap, rate)
    simulation = start(scene)
    for _ in range(round(0.5 * rate)):
        simulation.step()
    return simulation.frame().position


@pytest.mark.parametrize("gap", [1e-4, 1e-2])
def test_break_without_a_note_does_not_depend_on_the_step(gap: float) -> None:
    # rounding of 1e-16 m, which a break of seven balls amplifies by about 1e4
    assert final_positions(gap, 240) == pytest.approx(final_positions(gap, 3840), abs=1e-9)
