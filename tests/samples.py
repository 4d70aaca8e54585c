"""Sample scenes: twenty-one shipped scenes that together demand all that shipped scenes demand of an engine.

A law that holds for each shipped scene is tested with these on every change, and with all of them nightly.
`tests/laws/test_samples.py` asserts what they cover.
"""

from typing import Any

import pytest

from sandbox.scene.files.shipped_scenes import shipped

SAMPLE_SCENES = (
    "benchmark/incline",
    "benchmark/kepler",
    "benchmark/rolling_resistance",
    "billiards/9-ball",
    "games/conveyor",
    "games/curling",
    "games/demolition",
    "games/harbour",
    "games/landing",
    "games/moving_platforms",
    "games/racing_car",
    "games/rube_goldberg",
    "games/table_tennis",
    "joints/atwood",
    "joints/buggy",
    "joints/cloth",
    "joints/slider_crank",
    "particles/sparks",
    "pinball/full",
    "tutorial/balloon_and_feather",
    "tutorial/sensors",
)


def each_shipped_scene() -> list[Any]:
    """Return the names of all shipped scenes as parameters of a test; all but the sample scenes are nightly."""
    return [
        pytest.param(scene.name, marks=[] if scene.name in SAMPLE_SCENES else [pytest.mark.nightly])
        for scene in shipped()
    ]
