"""The sample scenes and the features demand all that an engine can be asked for."""

import pytest

from sandbox.scene.compile.demands import Demand, demands
from sandbox.scene.compile.setup import Setup
from sandbox.scene.files.load import load
from sandbox.scene.files.shipped_scenes import find, shipped
from tests.laws.features import FEATURES, scene_with
from tests.samples import SAMPLE_SCENES


def demanded(*names: str) -> set[Demand]:
    """Return what some shipped scenes demand together."""
    return set().union(*(demands(Setup.of(load(find(name)))) for name in names))


@pytest.mark.fail_slow(60)  # takes over half a second
def test_sample_scenes_demand_all_that_shipped_scenes_demand():
    assert demanded(*SAMPLE_SCENES) == demanded(*(scene.name for scene in shipped()))


def test_sample_scenes_and_features_demand_everything():
    featured = set().union(*(demands(Setup.of(scene_with(feature))) for feature in FEATURES))
    assert demanded(*SAMPLE_SCENES) | featured == set(Demand)
