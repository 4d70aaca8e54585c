import numpy as np
import pytest

from sandbox.measure.missed_contacts.verlet_list import VerletList


def everything(i, j):
    return np.ones(len(i), dtype=bool)


def encountered(neighbours, start, end, fast):
    when, first, second = neighbours.encounters(start, end, fast)
    assert (first < second).all()
    found = list(zip(when.tolist(), first.tolist(), second.tolist(), strict=True))
    assert len(set(found)) == len(found)
    return set(found)


def really(radius, start, end, fast):
    """Say when which pairs come into contact, from all pairs."""
    i, j = np.triu_indices(len(radius), 1)
    gap = start[:, j] - start[:, i]
    move = end[:, j] - end[:, i] - gap
    length2 = (move**2).sum(axis=2)
    share = np.clip(-(gap * move).sum(axis=2) / np.where(length2 > 0, length2, 1), 0, 1)
    near = ((gap + share[..., None] * move) ** 2).sum(axis=2) < (radius[i] + radius[j]) ** 2
    when, pair = np.nonzero(near & (fast[:, i] | fast[:, j]))
    return set(zip(when.tolist(), i[pair].tolist(), j[pair].tolist(), strict=True))


@pytest.mark.parametrize("count", [2, 40, 300])
@pytest.mark.parametrize("speed", [1e-3, 0.1, 0.5, 5.0])
@pytest.mark.parametrize("spread", [1.0, 30.0])
def test_no_encounter_is_lost_over_many_batches(count, speed, spread):
    rng = np.random.default_rng(count)
    radius = spread ** rng.random(count)
    place = rng.random((count, 2)) * 3 * np.sqrt(count * np.mean(radius**2))
    velocity = rng.normal(size=(count, 2)) * speed
    velocity[: max(1, count // 50)] *= 300  # bullets
    neighbours = VerletList(radius, np.ones(count, dtype=bool), everything)
    some = 0
    for _ in range(6):
        velocity += rng.normal(size=velocity.shape) * 0.2 * speed
        way = place + np.arange(9)[:, None, None] * velocity
        way[5:, 0] += 3.0  # one is moved by hand, in between
        start, end = way[:-1], way[1:].copy()
        end[4, 0] -= 3.0
        fast = rng.random((8, count)) < 0.6
        real = really(radius, start, end, fast)
        some += len(real)
        assert real <= encountered(neighbours, start, end, fast)
        place = way[-1]
    assert some or count == 2


def test_bodies_that_vanish_are_found_until_then():
    radius = np.ones(300)
    place = np.stack(np.meshgrid(np.arange(20) * 5.0, np.arange(15) * 5.0), axis=-1).reshape(-1, 2)
    start = np.repeat(place[None], 4, axis=0)
    end = start.copy()
    end[1, 0] = place[299]  # a bullet across the field …
    start[2:, 0] = end[2:, 0] = np.nan  # … is gone afterwards
    fast = np.zeros((4, 300), dtype=bool)
    fast[:, 0] = True
    found = encountered(VerletList(radius, np.ones(300, dtype=bool), everything), start, end, fast)
    assert really(radius, start, end, fast) <= found
    assert (1, 0, 299) in found


def test_who_takes_no_part_and_who_cannot_meet_is_left_out():
    start = np.zeros((1, 4, 2))
    fast = np.ones((1, 4), dtype=bool)
    member = np.array([True, True, True, False])
    neighbours = VerletList(np.ones(4), member, lambda i, j: (i + j) != 3)
    assert encountered(neighbours, start, start, fast) == {(0, 0, 1), (0, 0, 2)}


def test_the_list_stays_short_after_bullets():
    place = np.stack(np.meshgrid(np.arange(40) * 5.0, np.arange(25) * 5.0), axis=-1).reshape(-1, 2)
    neighbours = VerletList(np.ones(1000), np.ones(1000, dtype=bool), everything)
    fast = np.ones((1, 1000), dtype=bool)
    for bullet in range(20):
        end = place.copy()
        end[bullet] += 1e6
        encountered(neighbours, place[None], end[None], fast)
    assert len(encountered(neighbours, place[None], place[None], fast)) < 10_000  # 20 bullets met 1,000 each
