"""Joints that break: at their strength, for good, and without a trace on what they held."""

from typing import Any

import numpy as np
import pytest

from sandbox.action import Action, Force, Impulse, Launch, Remove, SetParameter, Switch
from sandbox.engines.switching import SwitchableSimulation, start
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import from_document

ENGINES = ("pymunk", "reference")
OTHER = {"pymunk": "reference", "reference": "pymunk"}
G = 10.0

every_engine = pytest.mark.parametrize("engine", ENGINES)


def scene_of(*joints: dict[str, Any], gravity: float = -G, substeps: int = 1, **document: Any) -> Scene:
    world = {"gravity": [0, gravity], "duration": 3.0}
    return from_document({"world": world, "solver": {"dt": 0.01, "substeps": substeps}, "joint": [*joints], **document})


def ball(name: str, x: float, y: float, **more: Any) -> dict[str, Any]:
    return {"name": name, "position": [x, y], "radius": 0.1, "mass": 1.0, **more}


def joint(kind: str, *between: str, **more: Any) -> dict[str, Any]:
    return {"kind": kind, "between": list(between), **more}


def chain(*strengths: float | None, collides: str = "none") -> Scene:
    """Balls of 1 kg on rods of 1 m, hung from the origin, the strongest load on the first rod."""
    balls = [ball(f"b{k}", 0, -1 - k, collides=collides) for k in range(len(strengths))]
    held = [[each["name"] for each in balls[max(k - 1, 0) : k + 1]] for k in range(len(strengths))]
    rods = [
        joint("rod", *pair, **({} if bears is None else {"strength": bears}))
        for pair, bears in zip(held, strengths, strict=True)
    ]
    return scene_of(*rods, ball=balls)


def loaded(relay: SwitchableSimulation, body: str, rise: float, steps: int = 400) -> float:
    """Pull a body down by a force that grows with each step until something breaks; return that force, N."""
    for k in range(steps):
        relay.apply(Force(time=0.0, body=body, force=(0.0, -rise * k)))
        relay.step()
        if relay.broken:
            return rise * k
    raise AssertionError("nothing broke")


@every_engine
@pytest.mark.parametrize(
    "how",
    [{"kind": "rod"}, {"kind": "pivot", "at": [0, 0]}, {"kind": "spring", "stiffness": 2e3, "damping": 20.0}],
    ids=lambda how: str(how["kind"]),
)
def test_joint_breaks_under_the_load_of_its_strength(engine: str, how: dict[str, Any]) -> None:
    relay = start(scene_of({**how, "between": ["w"], "strength": 20.0}, ball=[ball("w", 0, -1)]), engine)
    rise = 0.05
    # G m and the force are the load. The spring trails the load by less than a step of it, and swings by less than one.
    assert loaded(relay, "w", rise) + G == pytest.approx(20.0, abs=1.5 * rise)
    assert relay.broken == {0: relay.time}


@pytest.mark.parametrize("way", ["relaxation", "xpbd", "rattle"])
@pytest.mark.parametrize("kind", ["rod", "spring"])
def test_joint_held_by_positions_breaks_under_the_same_load(way: str, kind: str) -> None:
    how = {"stiffness": 2e3, "damping": 20.0} if kind == "spring" else {}
    scene = scene_of(joint(kind, "w", strength=20.0, **how), ball=[ball("w", 0, -1)])
    relay = start(scene, "reference", scene.solver.replace(joints=way))
    assert loaded(relay, "w", 0.05) + G == pytest.approx(20.0, abs=0.075)  # N, a step and a half of load, as above


@every_engine
def test_joint_bears_its_strength(engine: str) -> None:
    relay = start(chain(G * 1.0001), engine)  # solved to rounding, as one rod is
    for _ in range(50):
        relay.step()
    assert not relay.broken


@every_engine
def test_chain_breaks_at_its_weakest_link_and_the_rest_falls_as_one(engine: str) -> None:
    relay = start(chain(50.0, 60.0, 24.0, 30.0), engine)  # they bear 40, 30, 20 and 10 N, and the growing force
    loaded(relay, "b3", 0.05)
    assert set(relay.broken) == {2}
    relay.apply(Force(time=0.0, body="b3", force=(0.0, 0.0)))
    before = relay.frame()
    for _ in range(30):
        relay.step()
    after = relay.frame()
    assert set(relay.broken) == {2}
    held, fallen = after.position[1, 1], after.velocity[2:, 1] - before.velocity[2:, 1]
    assert held == pytest.approx(-2.0, abs=0.005)  # m; the two above stay but for what solvers leave of a stretch
    assert fallen.mean() == pytest.approx(-G * 0.3, rel=1e-12)  # v = g t, to rounding: what is below falls free


@every_engine
def test_spring_breaks_at_the_stretch_of_its_strength(engine: str) -> None:
    stiffness, strength = 100.0, 12.0
    spring = joint("spring", "w", stiffness=stiffness, rest_length=1.0, strength=strength)
    relay = start(scene_of(spring, ball=[ball("w", 0, -1)]), engine)
    stretch = 0.0
    while not relay.broken and relay.time < 1.0:
        assert stiffness * stretch <= strength * (1.0 + 1e-4)  # pymunk springs end a little ahead of k·x
        relay.step()
        stretch = -float(relay.frame().position[0, 1]) - 1.0
    assert set(relay.broken) == {0}
    assert stiffness * stretch > strength * (1.0 - 1e-4)  # as above


@every_engine
def test_rotary_spring_breaks_at_the_turn_of_its_strength(engine: str) -> None:
    spring = joint("rotary_spring", "w", stiffness=2.0, strength=0.5)
    where = joint("pivot", "w", at=[0, 0])
    relay = start(scene_of(spring, where, gravity=0.0, ball=[ball("w", 0, 0, angular_velocity=40.0)]), engine)
    turned = 0.0
    while not relay.broken and relay.time < 1.0:
        assert 2.0 * turned <= 0.5
        relay.step()
        turned = float(relay.frame().angle[0])
    assert 2.0 * turned > 0.5
    spin = relay.frame().angular_velocity[0]
    relay.step()
    assert set(relay.broken) == {0}
    assert relay.frame().angular_velocity[0] == spin  # nothing else turns it


@every_engine
def test_springs_off_centre_break_at_the_stretch_between_their_ends(engine: str) -> None:
    anchors = {"anchors": [[0.0, 0.05], [0.05, 0.0]]}
    spring = joint("spring", "a", "b", stiffness=50.0, rest_length=0.5, damping=0.5, strength=20.0, **anchors)
    spun = [ball("a", 0, 0, velocity=[-2, 0], angular_velocity=3), ball("b", 1, 0, velocity=[2, 0])]
    relay = start(scene_of(spring, gravity=0.0, ball=spun), engine)
    forces = [0.0]
    while not relay.broken and relay.time < 1.0:
        relay.step()
        frame = relay.frame()
        first, second = (end[0] for end in relay.setup.links.ends(frame.position, frame.angle))
        arms = np.asarray([first - frame.position[0], second - frame.position[1]])
        speed = frame.velocity + frame.angular_velocity[:, None] * np.column_stack((-arms[:, 1], arms[:, 0]))
        way = second - first
        length = np.hypot(*way)
        forces.append(50.0 * (length - 0.5) + 0.5 * float((speed[1] - speed[0]) @ way) / length)
    assert max(forces[:-1]) <= 20.0 < forces[-1]


@every_engine
def test_momentum_is_kept_where_a_spring_breaks(engine: str) -> None:
    spring = joint("spring", "a", "b", stiffness=80.0, strength=40.0)
    apart = [ball("a", 0, 0, velocity=[-3, 1], mass=2.0), ball("b", 1, 0, velocity=[5, 0])]
    scene = scene_of(spring, gravity=0.0, ball=apart)
    relay = start(scene, engine)
    for _ in range(60):
        relay.step()
    assert relay.broken
    frame = relay.frame()
    assert scene.bodies.mass @ frame.velocity == pytest.approx([-1.0, 2.0], abs=1e-13)  # a few roundings of 6 kg·m/s
    speeds = frame.velocity
    relay.step()
    assert np.array_equal(relay.frame().velocity, speeds)  # free


@every_engine
@pytest.mark.parametrize("kind", ["ball", "box"])
def test_two_that_a_joint_kept_apart_meet_once_it_is_broken(engine: str, kind: str) -> None:
    size = {"radius": 0.1} if kind == "ball" else {"size": [0.2, 0.2]}
    post = {"name": "post", "position": [0, 0], "fixed": True, "restitution": 1.0, **size}
    stone = {"name": "stone", "position": [1, 0], "velocity": [3, 0], "mass": 1.0, "restitution": 1.0, **size}
    string = joint("slide", "post", "stone", most=1.2, strength=5.0)
    for bears in (True, False):
        tied = {key: value for key, value in string.items() if not (bears and key == "strength")}
        relay = start(scene_of(tied, gravity=0.0, **{kind: [post, stone]}), engine)
        for _ in range(20):
            relay.step()
        relay.apply(Impulse(time=0.0, body="stone", impulse=(-3.0 - float(relay.frame().velocity[1, 0]), 0.0)))
        for _ in range(50):
            relay.step()
        frame = relay.frame()
        if bears:
            assert not relay.broken
            assert frame.position[1, 0] < 0.0  # through the post
        else:
            assert set(relay.broken) == {0}
            assert frame.velocity[1, 0] == pytest.approx(3.0, rel=1e-9)  # back from it, with all its speed


@every_engine
def test_break_is_told_at_the_end_of_its_substep(engine: str) -> None:
    relay = start(scene_of(joint("rod", "w", strength=1.0), substeps=4, ball=[ball("w", 0, -1)]), engine)
    relay.step()
    assert relay.broken == {0: 0.0025}  # of four of 2.5 ms
    assert dict(start(chain(None), engine).broken) == {}


def test_exact_breaks_nothing() -> None:
    relay = start(scene_of(ball=[ball("w", 0, -1)]), "exact")
    relay.step()
    assert relay.broken == {}


def torn(engine: str) -> SwitchableSimulation:
    """A chain of five whose fourth rod breaks, and which has then lost its first ball, so that numbers shift."""
    relay = start(chain(None, None, None, 20.5, 12.0), engine)
    loaded(relay, "b3", 0.5)
    assert set(relay.broken) == {3}
    relay.apply(Force(time=0.0, body="b3", force=(0.0, 0.0)))
    relay.apply(Remove(time=0.0, body="b0"))
    return relay


@every_engine
@pytest.mark.parametrize("to", ENGINES)
@pytest.mark.parametrize("then", [None, SetParameter(time=0.0, path="world.gravity", value=[0.0, -5.0])], ids=str)
def test_what_is_broken_stays_so_on_the_next_engine(engine: str, to: str, then: Action | None) -> None:
    relay = torn(engine)
    broken, links = dict(relay.broken), relay.setup.links
    relay.apply(Switch(time=0.0, engine=to))
    assert relay.broken == broken
    assert np.array_equal(relay.setup.links.number, links.number)
    assert np.array_equal(relay.setup.links.b, links.b)  # by the numbers of the whole
    if then is not None:
        relay.apply(then)
    gravity = G if then is None else 5.0
    before = relay.frame().velocity[3:].mean(axis=0)
    for _ in range(10):
        relay.step()
    assert relay.frame().velocity[3:].mean(axis=0) - before == pytest.approx([0.0, -gravity * 0.1], abs=1e-12)  # free
    at = relay.time
    loaded_, steps = {**relay.broken}, 0
    while len(relay.broken) == len(loaded_) and steps < 200:
        relay.apply(Force(time=0.0, body="b4", force=(0.0, -2.0 * steps)))
        relay.apply(Force(time=0.0, body="b3", force=(0.0, 2.0 * steps)))
        relay.step()
        steps += 1
    assert set(relay.broken) == {3, 4}
    assert relay.broken[3] == broken[3]
    assert at < relay.broken[4] == pytest.approx(relay.time, abs=1e-12)  # s, told in times of the whole


@every_engine
def test_what_is_broken_stays_so_from_a_checkpoint_on(engine: str) -> None:
    relay = start(chain(8.0), engine)
    for _ in range(5):
        relay.step()
    assert set(relay.broken) == {0}
    resumed = SwitchableSimulation.resumed(relay.checkpoint())
    assert resumed.broken == relay.broken
    for _ in range(20):
        relay.step()
        resumed.step()
    assert resumed.state_hash() == relay.state_hash()  # free flight goes on as it does
    assert resumed.broken == relay.broken


@every_engine
def test_torn_rope_is_whole_nowhere_after_it_is_launched_anew(engine: str) -> None:
    rope = {"name": "r", "start": [0, 0], "end": [0, -1], "links": 4, "mass": 1.0, "strength": 35.0, "fix": ["start"]}
    relay = start(scene_of(rope=[rope]), engine)
    while not relay.broken and relay.time < 1.0:  # until impulses have added up to the weights
        relay.step()
    assert set(relay.broken) == {0}  # of 40, 30, 20 and 10 N
    relay.apply(Launch(time=0.0, generator="r", seed=1))
    before = relay.frame().velocity[1:].mean(axis=0)
    for _ in range(10):
        relay.step()
    assert set(relay.broken) == {0}
    # Free fall, for nothing holds the rest: v = g t, to rounding.
    assert relay.frame().velocity[1:].mean(axis=0) - before == pytest.approx([0.0, -G * 0.1], abs=1e-12)


@every_engine
def test_each_joint_of_a_cloth_bears_the_same(engine: str) -> None:
    cloth = {"corner": [0, 0], "columns": 3, "rows": 3, "spacing": [0.1, 0.1], "stiffness": 100.0, "mass": 0.1}
    scene = scene_of(cloth=[{**cloth, "strength": 1.5}])
    assert (scene.links.strength == 1.5).all()
    assert np.isinf(scene_of(cloth=[cloth]).links.strength).all()
    relay = start(scene, engine)
    for _ in range(30):
        relay.step()
    kinds = {(int(scene.links.a[k]), int(scene.links.b[k])) for k in relay.broken}
    assert kinds == {(0, 3), (1, 4), (2, 5)}  # the uppermost threads: twice 1 N of weight, and swinging


@every_engine
def test_torn_cloth_is_the_same_each_time(engine: str) -> None:
    cloth = {"corner": [0, 0], "columns": 8, "rows": 6, "spacing": [0.1, 0.1], "stiffness": 200.0, "mass": 0.01}
    scene = scene_of(
        cloth=[{**cloth, "strength": 3.0, "damping": 0.1, "collides": "all"}],
        ball=[ball("stone", -0.6, -0.3, velocity=[8, 1], mass=0.5)],
        substeps=6,
    )
    ways = []
    for _ in range(2):
        relay = start(scene, engine)
        for k in range(60):
            if k == 30:
                relay.apply(Switch(time=0.0, engine=OTHER[engine]))
            relay.step()
        ways.append((relay.state_hash(), dict(relay.broken)))
    assert ways[0] == ways[1]
    assert len(ways[0][1]) > 5
