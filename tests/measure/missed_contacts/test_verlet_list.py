import numpy as np
import pytest

from sandbox.measure.missed_contacts.verlet_list import VerletList


def accept_all(i, j):
    return np.ones(len(i), dtype=bool)


def encounters_of(neighbours, start, end, fast):
    when, first, second = neighbours.encounters(start, end, fast)
    assert (first < second).all()
    found = list(zip(when.tolist(), first.tolist(), second.tolist(), strict=True))
    assert len(set(found)) == len(found)
    return set(found)


def expected_encounters(radius, start, end, fast):
    """Return (step, body, body) of all encounters, by testing all pairs."""
    i, j = np.triu_indices(len(radius), 1)
    gap = start[:, j] - start[:, i]
    move = end[:, j] - end[:, i] - gap
    length2 = (move**2).sum(axis=2)
    fraction = np.clip(-(gap * move).sum(axis=2) / np.where(length2 > 0, length2, 1), 0, 1)
    near = ((gap + fraction[..., None] * move) ** 2).sum(axis=2) < (radius[i] + radius[j]) ** 2
    when, pair = np.nonzero(near & (fast[:, i] | fast[:, j]))
    return set(zip(when.tolist(), i[pair].tolist(), j[pair].tolist(), strict=True))


@pytest.mark.fail_slow(60)  # takes over half a second
@pytest.mark.parametrize("count", [2, 40, 300])
@pytest.mark.parametrize("speed", [1e-3, 0.1, 0.5, 5.0])
@pytest.mark.parametrize("spread", [1.0, 30.0])
def test_no_encounter_is_lost_over_many_batches(count, speed, spread):
    rng = np.random.default_rng(count)
    radius = spread ** rng.random(count)
    position = rng.random((count, 2)) * 3 * np.sqrt(count * np.mean(radius**2))
    velocity = rng.normal(size=(count, 2)) * speed
    velocity[: max(1, count // 50)] *= 300  # bullets
    neighbours = VerletList(radius, np.ones(count, dtype=bool), accept_all)
    total = 0
    for _ in range(6):
        velocity += rng.normal(size=velocity.shape) * 0.2 * speed
        path = position + np.arange(9)[:, None, None] * velocity
        path[5:, 0] += 3.0  # one body is moved between two steps
        start, end = path[:-1], path[1:].copy()
        end[4, 0] -= 3.0
        fast = rng.random((8, count)) < 0.6
        expected = expected_encounters(radius, start, end, fast)
        total += len(expected)
        assert expected <= encounters_of(neighbours, start, end, fast)
        position = path[-1]
    assert total or count == 2


def test_encounters_of_a_body_are_found_until_it_vanishes():
    radius = np.ones(300)
    position = np.stack(np.meshgrid(np.arange(20) * 5.0, np.arange(15) * 5.0), axis=-1).reshape(-1, 2)
    start = np.repeat(position[None], 4, axis=0)
    end = start.copy()
    end[1, 0] = position[299]  # a bullet across the field …
    start[2:, 0] = end[2:, 0] = np.nan  # … vanishes afterwards
    fast = np.zeros((4, 300), dtype=bool)
    fast[:, 0] = True
    found = encounters_of(VerletList(radius, np.ones(300, dtype=bool), accept_all), start, end, fast)
    assert expected_encounters(radius, start, end, fast) <= found
    assert (1, 0, 299) in found


def test_non_members_and_filtered_pairs_are_left_out():
    start = np.zeros((1, 4, 2))
    fast = np.ones((1, 4), dtype=bool)
    member = np.array([True, True, True, False])
    neighbours = VerletList(np.ones(4), member, lambda i, j: (i + j) != 3)
    assert encounters_of(neighbours, start, start, fast) == {(0, 0, 1), (0, 0, 2)}


def test_the_list_stays_short_after_bullets():
    position = np.stack(np.meshgrid(np.arange(40) * 5.0, np.arange(25) * 5.0), axis=-1).reshape(-1, 2)
    neighbours = VerletList(np.ones(1000), np.ones(1000, dtype=bool), accept_all)
    fast = np.ones((1, 1000), dtype=bool)
    for bullet in range(20):
        end = position.copy()
        end[bullet] += 1e6
        encounters_of(neighbours, position[None], end[None], fast)
    # 20 bullets each encountered 1,000 bodies
    assert len(encounters_of(neighbours, position[None], position[None], fast)) < 10_000
