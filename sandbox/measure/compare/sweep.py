"""Sweeps: variants of a scene, one for each combination of values."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from sandbox.scene.description.world import Settings
from sandbox.scene.files.document import to_document
from sandbox.scene.files.load import from_session
from sandbox.scene.files.overrides import combinations
from sandbox.scene.scene import Scene

Sweep = Mapping[str, Sequence[Any]]
"""Values by key, such as `{"solver.integrator": ["explicit_euler", "rk4"]}`; several keys give each combination."""


@dataclass(frozen=True, eq=False)
class Variant:
    """Scene with one combination of swept values."""

    scene: Scene
    set: Mapping[str, Any] = field(default_factory=dict)
    """swept keys and their values in this variant"""


def variants_of(scene: Scene, sweep: Sweep) -> list[Variant]:
    """Return a scene with each combination of swept values, the last key changing fastest.

    Raises:
        ValueError: a key has no values, or there are too many combinations.
        SceneError: a key or a value is wrong.
    """
    for key, values in sweep.items():
        if isinstance(values, str) or not len(values):
            raise ValueError(f"sweep: {key} needs a sequence of values, such as [0.01, 0.001]")
    document = to_document(scene)
    points = combinations([(key, list(values)) for key, values in sweep.items()])
    return [Variant(from_session(document, "sweep", list(point)), dict(point)) for point in points]


def set_text(chosen: Mapping[str, Any]) -> str:
    """Return swept values as one line: `integrator rk4, dt 0.01`."""
    return ", ".join(f"{short_key(key)} {value_text(value)}" for key, value in chosen.items())


def short_key(key: str) -> str:
    """Return a key as a column's head: a setting without `solver.`."""
    return key.removeprefix("solver.")


def value_text(value: Any) -> str:
    """Return a value as it is read best: a text bare, a number to 9 digits."""
    if isinstance(value, str):
        return value
    if isinstance(value, float):
        return f"{value:.9g}"
    return json.dumps(value, default=str)


def physics_of(scene: Scene) -> str:
    """Return all that a scene says but for its `[solver]`: scenes that share it have the same truth."""
    return json.dumps({**to_document(scene), "solver": None}, sort_keys=True, default=str)


def truth_settings(own: Settings, all_settings: Sequence[Settings]) -> Settings:
    """Return the settings by which the truth of a variant is sought.

    The times of the frames are the variant's own. Iterations and substeps, which make a refined truth better, are the
    most of all variants, so that the truth does not depend on the variant.
    """
    return own.replace(
        iterations=max(each.iterations for each in all_settings),
        substeps=max(each.substeps for each in all_settings),
    )
