"""Settings: replacement, validation and defaults of engines."""

import pytest
from pydantic import ValidationError

from sandbox.engines.registry import ENGINES
from sandbox.scene.description.world import Settings
from sandbox.scene.files.load import from_document


def test_substep_length_is_dt_over_substeps() -> None:
    assert Settings(dt=0.01, substeps=4).h == 0.01 / 4


def test_replace_changes_only_the_given_settings() -> None:
    before = Settings(dt=0.5, slop=0.1, integrator="rk4")
    after = before.replace(dt=0.25, bias=None)
    assert after == Settings(dt=0.25, slop=0.1, integrator="rk4")
    assert before.dt == 0.5


@pytest.mark.parametrize(
    "changes", [{"dt": 0.0}, {"dt": "0.1"}, {"dt": True}, {"step": 1}, {"substeps": 1.0}, {"dt": float("nan")}]
)
def test_replace_validates_as_strictly_as_a_file(changes: dict[str, object]) -> None:
    with pytest.raises(ValidationError):
        Settings().replace(**changes)


def test_settings_left_to_the_engine_are_none() -> None:
    unset = {key for key, value in Settings().model_dump().items() if value is None}
    choices = {"integrator", "detection", "response", "impact", "broad_phase", "joints"}
    contacts = {"slop", "bias", "persistence", "stiffness", "damping", "stretch"}
    assert unset == choices | contacts | {"continuous", "sleeping", "sleep_time", "idle_speed", "workers"}


@pytest.mark.parametrize("engine", ["pymunk", "reference"])
def test_resolved_settings_of_extreme_sizes_and_masses_are_within_bounds(engine: str) -> None:
    corners = [[-1e15, -1e15], [1e15, -1e15], [1e15, 1e15], [-1e15, 1e15]]
    giant = {"position": [0, 0], "points": corners, "mass": 1e30}
    plane = {"point": [0, -2e15], "normal": [0, 1]}
    solver, world = {"dt": 1e-9}, {"duration": 1e-9}
    scene = from_document({"polygon": [giant], "plane": [plane], "solver": solver, "world": world})
    settings = scene.solver if engine == "pymunk" else scene.solver.replace(response="penalty")
    chosen = ENGINES[engine].resolve(scene, settings)
    assert chosen.slop == 1e9
    assert chosen.stiffness == (None if engine == "pymunk" else 1e30)
