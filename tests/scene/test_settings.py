"""Settings as a value."""

import pytest
from pydantic import ValidationError

from sandbox.scene.settings import Settings


def test_substep_is_the_frame_step_divided() -> None:
    assert Settings(dt=0.01, substeps=4).h == 0.01 / 4


def test_replace_changes_what_it_names_and_nothing_else() -> None:
    before = Settings(dt=0.5, slop=0.1, integrator="rk4")
    after = before.replace(dt=0.25, bias=None)
    assert after == Settings(dt=0.25, slop=0.1, integrator="rk4")
    assert before.dt == 0.5


@pytest.mark.parametrize(
    "changes", [{"dt": 0.0}, {"dt": "0.1"}, {"dt": True}, {"step": 1}, {"substeps": 1.0}, {"dt": float("nan")}]
)
def test_replace_is_as_strict_as_a_file(changes: dict[str, object]) -> None:
    with pytest.raises(ValidationError):
        Settings().replace(**changes)


def test_choices_left_to_the_engine_are_none() -> None:
    left = {key for key, value in Settings().model_dump().items() if value is None}
    words = {"integrator", "detection", "response", "impact", "broad_phase", "joints"}
    assert left == words | {"slop", "bias", "persistence", "stiffness", "damping", "stretch"}
