"""Contact rows: one row per impact, and impulses that balance momentum."""

import numpy as np
import pytest

from sandbox.engines.common.contact_log import PairIndex
from sandbox.engines.registry import start
from sandbox.scene.files.load import from_document
from tests.engines.builders import make_scene
from tests.engines.stepping import advance

BOUNCING_SCENE = {
    "world": {"gravity": [0, -9.81]},
    "solver": {"dt": 0.001},
    "plane": [{"point": [0, 0], "normal": [0, 1]}],
    "ball": [{"position": [0, 1.5], "radius": 0.5, "mass": 2.0, "restitution": 0.5}],
}


def test_each_bounce_is_one_row_and_resting_contact_another():
    simulation = start(from_document(BOUNCING_SCENE))
    assert len(simulation.contacts()) == 0
    advance(simulation, 4000)
    contacts = simulation.contacts()
    fall = np.sqrt(2 / 9.81)
    bounces = fall + 2 * fall * np.cumsum(0.5 ** np.arange(1, 5))
    # Each impact is found at the end of its substep, and each bounce inherits the previous delay.
    assert contacts.time[:5] == pytest.approx([fall, *bounces], abs=0.02)
    assert (contacts.pair == [0, -1]).all()
    assert np.allclose(contacts.normal, [0, -1], rtol=0, atol=1e-12)  # a plane is a segment of 2e4 m: noise 3e-13
    # The floor takes the momentum of the fall and then the weight for the remaining time.
    total = contacts.impulse.sum(axis=0)
    assert total == pytest.approx([0, -2 * 9.81 * 4.0], abs=1e-9)  # rounding of 4,000 sums of 0.02


def crowded_scene():
    """Return balls that slide, bounce and come to rest between a plane, a wall and a post."""
    stuff = {"restitution": 0.5, "friction": 0.3}
    balls = [([-2, 0.6], [3, 0]), ([0, 0.7], [0, 0]), ([0.1, 2.0], [0, -2]), ([1.5, 3.0], [-1, 0])]
    return make_scene(
        world={"gravity": [0, -9.81]}, plane=[{"point": [0, 0], "normal": [0, 1], **stuff}],
        wall=[{"points": [[3, 0], [3, 3], [2.5, 4]], "thickness": 0.1, **stuff}],
        post=[{"position": [-3, 1], "radius": 0.3, **stuff}],
        ball=[{"position": x, "velocity": v, "radius": 0.4, **stuff} for x, v in balls],
    )  # fmt: skip


@pytest.mark.fail_slow(60)  # takes over half a second
@pytest.mark.parametrize(
    ("engine", "settings"),
    [
        ("pymunk", {}), ("exact", {}), ("reference", {}), ("reference", {"detection": "swept"}),
        ("reference", {"detection": "bisect"}), ("reference", {"response": "penalty"}),
    ],
)  # fmt: skip
def test_contacts_queried_every_step_sum_to_those_queried_once(engine, settings):
    scene = crowded_scene()
    often, once = (start(scene, engine, scene.solver.replace(**settings)) for _ in range(2))
    once.contacts()
    batches = [often.contacts()]
    for _ in range(200):
        once.step()
        often.step()
        batches.append(often.contacts())
    sums = {}
    for time, pair, impulse in (
        each for rows in batches for each in zip(rows.time, rows.pair, rows.impulse, strict=True)
    ):
        key = time, *pair
        sums[key] = sums.get(key, 0.0) + impulse
    whole = once.contacts()
    assert len(whole) >= len(sums) > 5  # two balls may touch twice at one time
    totals = {}
    for time, pair, impulse in zip(whole.time, whole.pair, whole.impulse, strict=True):
        totals[time, *pair] = totals.get((time, *pair), 0.0) + impulse
    assert sums.keys() == totals.keys()
    for key, impulse in totals.items():
        assert sums[key] == pytest.approx(impulse, rel=1e-11, abs=1e-12)  # the order of up to 200 additions differs
    assert often.state_hash() == once.state_hash()


@pytest.mark.parametrize("engine", ["pymunk", "reference"])
def test_first_query_returns_current_contacts(engine):
    document = {**BOUNCING_SCENE, "ball": [{"position": [0, 0.4999], "radius": 0.5}]}
    simulation = advance(start(from_document(document), engine), 10)
    contacts = simulation.contacts()
    assert contacts.pair.tolist() == [[0, -1]]
    assert contacts.time.tolist() == [simulation.time]
    assert contacts.normal[0] == pytest.approx([0.0, -1.0], abs=1e-12)  # a plane of pymunk is a segment of 2e4 m
    assert contacts.impulse.any() == (engine == "pymunk")  # which has that of the last step
    simulation.step()
    later = simulation.contacts()
    assert later.time.tolist() == contacts.time.tolist()
    assert later.impulse[0] == pytest.approx([0.0, -9.81e-3], rel=1e-3)  # its weight for a step; it still settles


def test_order_and_sign_of_a_pair_do_not_depend_on_the_moving_body():
    for speeds in ((3, 0), (0, -3)):
        balls = [
            {"name": "left", "position": [-0.6, 0], "velocity": [speeds[0], 0], "radius": 0.5, "restitution": 1},
            {"name": "right", "position": [0.6, 0], "velocity": [speeds[1], 0], "radius": 0.5, "restitution": 1},
        ]
        simulation = start(from_document({"solver": {"dt": 0.01}, "ball": balls}))
        simulation.contacts()
        advance(simulation, 20)
        (event,) = simulation.contacts()
        assert event.pair == (0, 1)
        assert event.normal == pytest.approx((1, 0), abs=1e-15)  # head-on: y is 0 throughout
        assert event.impulse == pytest.approx((3.0, 0), rel=1e-14)  # from the left body to the right body


def test_ball_in_a_corner_of_one_wall_is_one_contact():
    wall = {"points": [[0, 5], [0, 0], [5, 0]], "restitution": 0}
    ball = {"position": [0.6, 0.6], "velocity": [-1, -1], "radius": 0.5}
    simulation = start(from_document({"wall": [wall], "ball": [ball], "solver": {"dt": 0.01}}))
    simulation.contacts()
    advance(simulation, 50)
    contacts = simulation.contacts()
    assert contacts.pair.tolist() == [[0, -1]]
    assert contacts.impulse[0] == pytest.approx([-1, -1], abs=1e-9)  # both sides, summed; iterations converge to 1e-10


def test_pair_index_agrees_with_a_dictionary():
    random = np.random.default_rng(1)
    for highest in (50, 5000):  # a square table, and a search for larger indices
        table, last, count = PairIndex(), {}, 0
        for _ in range(60):
            pairs = sorted({tuple(p) for p in random.integers(0, highest, (30, 2)) % [highest, 8]})
            pairs += [p for p in last if random.random() < 0.5 and p not in pairs]
            random.shuffle(pairs)
            first, second = np.array(pairs, np.int64).reshape(-1, 2).T
            row, new = table.find(first, second)
            assert [pairs[k] for k in new] == [p for p in pairs if p not in last]
            row[new] = count + np.arange(len(new))
            count += len(new)
            assert [int(r) for r in row] == [last.get(tuple(p), int(r)) for p, r in zip(pairs, row, strict=True)]
            table.keep(row)
            last = {tuple(p): int(r) for p, r in zip(pairs, row, strict=True)}
