"""Contact rows: one row per impact, and impulses that balance momentum."""

import numpy as np
import pytest

from sandbox.engines.common.contact_log import PairIndex
from sandbox.engines.registry import start
from sandbox.scene.files.load import from_document, load
from sandbox.scene.files.shipped_scenes import find

BOUNCING_SCENE = {
    "world": {"gravity": [0, -9.81]},
    "solver": {"dt": 0.001},
    "plane": [{"point": [0, 0], "normal": [0, 1]}],
    "ball": [{"position": [0, 1.5], "radius": 0.5, "mass": 2.0, "restitution": 0.5}],
}


def test_each_bounce_is_one_row_and_resting_contact_another():
    simulation = start(from_document(BOUNCING_SCENE))
    assert len(simulation.contacts()) == 0
    for _ in range(4000):
        simulation.step()
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


def test_repeated_queries_split_the_impulse_but_keep_the_first_contact_time():
    queried_once, queried_often = start(from_document(BOUNCING_SCENE)), start(from_document(BOUNCING_SCENE))
    queried_once.contacts()
    queried_often.contacts()
    batches = []
    for k in range(4000):
        queried_once.step()
        queried_often.step()
        if k % 7 == 0:
            batches.append(queried_often.contacts())
    batches.append(queried_often.contacts())
    expected = queried_once.contacts()
    times = np.unique(np.concatenate([c.time for c in batches]))
    assert np.array_equal(times, expected.time)
    for time, impulse in zip(expected.time, expected.impulse, strict=True):
        split = sum(c.impulse[c.time == time].sum(axis=0) for c in batches)
        assert split == pytest.approx(impulse, rel=1e-11)  # the order of up to 3,000 additions differs


@pytest.mark.parametrize("persistence", [1, 3, 10])
def test_impulses_of_a_pile_balance_its_momentum(persistence):
    """Includes pairs that separate and collide again at once, where pymunk counts remembered impulses twice."""
    scene = load(find("pile"), ["grid.ball.rows=8", "grid.ball.columns=10"])
    simulation = start(scene, "pymunk", scene.solver.replace(persistence=persistence))
    simulation.contacts()
    for _ in range(240):
        simulation.step()
    contacts, frame = simulation.contacts(), simulation.frame()
    outside = contacts.pair[:, 1] < 0
    mass = scene.bodies.mass[:, None]
    gained = (mass * frame.velocity).sum(axis=0) - (mass * scene.bodies.velocity).sum(axis=0)
    weight = mass.sum() * np.array([0, -9.81]) * simulation.time
    # Rounding of about 1e5 additions of terms of 1e-2 N·s.
    assert gained == pytest.approx(weight - contacts.impulse[outside].sum(axis=0), abs=1e-9)
    assert (contacts.pair[~outside, 0] < contacts.pair[~outside, 1]).all()


def test_first_query_returns_current_contacts():
    document = {**BOUNCING_SCENE, "ball": [{"position": [0, 0.4999], "radius": 0.5}]}
    simulation = start(from_document(document))
    for _ in range(10):
        simulation.step()
    contacts = simulation.contacts()
    assert contacts.pair.tolist() == [[0, -1]]
    assert contacts.time.tolist() == [simulation.time]


def test_order_and_sign_of_a_pair_do_not_depend_on_the_moving_body():
    for speeds in ((3, 0), (0, -3)):
        balls = [
            {"name": "left", "position": [-0.6, 0], "velocity": [speeds[0], 0], "radius": 0.5, "restitution": 1},
            {"name": "right", "position": [0.6, 0], "velocity": [speeds[1], 0], "radius": 0.5, "restitution": 1},
        ]
        simulation = start(from_document({"solver": {"dt": 0.01}, "ball": balls}))
        simulation.contacts()
        for _ in range(20):
            simulation.step()
        (event,) = simulation.contacts()
        assert event.pair == (0, 1)
        assert event.normal == pytest.approx((1, 0), abs=1e-15)  # head-on: y is 0 throughout
        assert event.impulse == pytest.approx((3.0, 0), rel=1e-14)  # from the left body to the right body


def test_ball_in_a_corner_of_one_wall_is_one_contact():
    wall = {"points": [[0, 5], [0, 0], [5, 0]], "restitution": 0}
    ball = {"position": [0.6, 0.6], "velocity": [-1, -1], "radius": 0.5}
    simulation = start(from_document({"wall": [wall], "ball": [ball], "solver": {"dt": 0.01}}))
    simulation.contacts()
    for _ in range(50):
        simulation.step()
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
