"""Start states of many runs: those of the scenes, bit for bit."""

from typing import Any

from hypothesis import given, settings
from hypothesis import strategies as st

from sandbox.batch.start_states import SEED, StartStates, is_start_key
from sandbox.scene.errors import SceneError
from sandbox.scene.files.document import to_document
from sandbox.scene.files.load import loads

SCENE = """
title = "Start states"
[world]
gravity = [0, -9.81]
seed = 3
{bounds}
[[plane]]
point = [0, -5]
normal = [0, 2]
[[ball]]
name = "a"
position = [0, 4]
radius = 0.5
[[ball]]
position = [3, 4]
velocity = [1, -0.0]
radius = 0.25
angle = 1
[[grid]]
origin = [-8, 8]
columns = 3
rows = 2
spacing = [1, 1]
jitter = 0.2
velocity_jitter = 0.5
radius = 0.1
[[scatter]]
lower = [5, 5]
upper = [9, 9]
count = 7
radius = 0.2
[[box]]
position = [12, 0]
size = [1, 1]
[[stack]]
base = [20, 0]
columns = 3
rows = 3
size = [0.5, 0.5]
jitter = 0.01
"""

COORDINATES = st.floats(-1e4, 1e4) | st.integers(-20, 20) | st.sampled_from([0.0, -0.0, 1e16, 2e16, 1e13, True, "x"])
PAIRS = st.lists(COORDINATES, min_size=2, max_size=2)
KEYS: dict[str, st.SearchStrategy[Any]] = {
    SEED: st.integers(0, 2**63) | st.just(-1) | st.just(1.5),
    "ball.a.position": PAIRS | st.just([1.0]),
    "ball.a.velocity": PAIRS | st.just(1.0),
    "ball.a.angle": COORDINATES,
    "ball.1.velocity": PAIRS,
    "ball.1.angular_velocity": COORDINATES | st.just([1.0, 2.0]),
}


@settings(max_examples=60)
@given(st.data())
def test_start_states_are_those_of_the_scenes(data: st.DataObject) -> None:
    keys = tuple(data.draw(st.lists(st.sampled_from(sorted(KEYS)), min_size=1, unique=True)))
    bounds = data.draw(st.sampled_from(["", "bounds = [[-10, -10], [30, 30]]"]))
    text = SCENE.format(bounds=bounds)
    points = [tuple((key, data.draw(KEYS[key])) for key in keys) for _ in range(3)]
    states = StartStates.of(loads(text), keys)
    assert states is not None
    members, valid = states.members(points)
    for m, point in enumerate(points):
        try:
            scene = loads(text, overrides=point)
        except SceneError:
            assert not valid[m]  # so that an ordinary run reports the faults
            continue
        if valid[m]:
            for name, column in members._asdict().items():
                assert column[m].tobytes() == getattr(scene.bodies, name).tobytes()
            assert states.scene_document(point) == to_document(scene)


def test_values_within_bounds_are_valid() -> None:
    states = StartStates.of(loads(SCENE.format(bounds="")), [SEED, "ball.a.position"])
    assert states is not None
    points = [((SEED, seed), ("ball.a.position", [0.1 * seed, 5])) for seed in range(20)]
    assert states.members(points)[1].all()
    assert len({states.members([point])[0].position.tobytes() for point in points}) == 20


def test_paths_of_start_values() -> None:
    assert all(map(is_start_key, KEYS))
    assert is_start_key('ball."8 ball".position')
    others = ["ball.*.velocity", "ball.a.mass", "ball.a.velocity.0", "box.a.position", "solver.dt", "world.gravity"]
    assert not any(map(is_start_key, [*others, "ball", 'ball."']))


def test_scenes_with_other_dependences_are_left_out() -> None:
    text = SCENE.format(bounds="")
    joint = '[[joint]]\nkind = "rod"\nbetween = ["a", "ball-2"]\n'
    emitter = "[[emitter]]\nposition = [0, 0]\ncount = 3\nvelocity_min = [0, 0]\nvelocity_max = [1, 1]\n"
    passing = '[[ball]]\nname = "ghost"\nposition = [0, 9]\nradius = 0.1\ncollides = "fixed"\n'
    crowd = "[[grid]]\norigin = [50, 50]\ncolumns = 20\nrows = 20\nspacing = [1, 1]\nradius = 0.1\n"
    for more in (joint, emitter, passing, crowd):
        assert StartStates.of(loads(text + more), [SEED]) is None
    fixed = text.replace('name = "a"', 'name = "a"\nfixed = true')
    assert StartStates.of(loads(fixed), ["ball.a.position"]) is None
    assert StartStates.of(loads(text), ["ball.b.position"]) is None
