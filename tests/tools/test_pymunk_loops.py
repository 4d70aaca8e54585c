"""Hand-written pymunk loops: contacts merged in each step and at the end are the same rows."""

import numpy as np
import pytest

from tools.benchmarks import pymunk_loops
from tools.benchmarks.workloads import balls_on_plane, scene


@pytest.mark.fail_slow(60)  # half a second of a pile
@pytest.mark.parametrize("name", ["balls", "pile"])
def test_contacts_merged_in_each_step_and_at_the_end_are_equal(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    which = balls_on_plane(10, 300) if name == "balls" else scene("benchmark/pile", "world.duration=0.4")
    found = []
    for many in (0, 10_000):
        monkeypatch.setattr(pymunk_loops, "MANY", many)
        frames, contacts = pymunk_loops.states_and_contacts(which)
        order = np.lexsort((contacts[:, 2], contacts[:, 1], contacts[:, 0]))
        found.append((frames, contacts[order]))
    assert len(found[0][1]) > 10
    assert np.array_equal(found[0][0], found[1][0])
    # impulses are summed in another order: rounding of sums of some N·s
    np.testing.assert_allclose(found[0][1], found[1][1], rtol=0.0, atol=1e-12)
