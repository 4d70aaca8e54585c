"""Setup: an engine and what it is told beside the scene's own `[solver]`."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from sandbox.engines.registry import ENGINES

Choice = float | int | str | bool


@dataclass(frozen=True)
class Setup:
    """One row of a heat map."""

    name: str
    engine: str
    changes: Mapping[str, Choice] = field(default_factory=dict)
    """to the scene's settings"""


COMMON = (
    Setup("pymunk", "pymunk"),
    Setup("pymunk, 4 substeps", "pymunk", {"substeps": 4}),
    Setup("reference", "reference"),
    Setup("reference, swept", "reference", {"integrator": "velocity_verlet", "detection": "swept"}),
    Setup("exact", "exact"),
)
"""For every axis."""

JOINTED = (
    *COMMON[:3],
    *(Setup(f"reference, {way}", "reference", {"joints": way}) for way in ("relaxation", "xpbd", "rattle")),
    COMMON[4],
)
"""Where joints hold; swept impacts are no matter there."""

SWINGING = (
    *COMMON[:3],
    *(
        Setup(f"reference, {name}", "reference", {"integrator": name})
        for name in ("velocity_verlet", "rk4", "explicit_euler")
    ),
    Setup("reference, xpbd", "reference", {"joints": "xpbd"}),
    COMMON[4],
)
"""Where springs act."""

PIERCING = (
    *COMMON[:4],
    *(Setup(f"reference, {way}", "reference", {"detection": way}) for way in ("bisect", "shrink")),
    COMMON[4],
)
"""Where it matters when an impact is found."""


def of_engines(setups: Sequence[Setup], engines: Sequence[str] | None) -> tuple[Setup, ...]:
    """Return the setups of some engines, by default all of the registry's; one that has none runs as it comes."""
    names = tuple(ENGINES) if engines is None else tuple(engines)
    strangers = (Setup(name, name) for name in names if all(setup.engine != name for setup in setups))
    return (*(setup for setup in setups if setup.engine in names), *strangers)
