"""A simulation's life: started, shared, copied, ended, and used after its end."""

import pytest

from tests.hostile.ordeal import WAYS, endure

pytestmark = pytest.mark.full  # fuzzing and inputs at the ends of their ranges

SETTING = """
def pile(**world):
    return start(from_document({
        "world": {"gravity": [0, -9.81], **world},
        "plane": [{"point": [0, 0], "normal": [0, 1], "friction": 0.5}],
        "grid": [{"name": "g", "origin": [0, 1], "columns": 5, "rows": 5, "spacing": [1.9, 2], "radius": 1,
                  "friction": 0.5, "restitution": 0.5}],
    }))
def raised(do, *arguments):
    "The name of whatever a call raises."
    try:
        do(*arguments)
    except Exception as error:
        return type(error).__name__
    return None
"""


@WAYS
def test_ended_simulation_can_be_read_but_not_go_on(flags: tuple[str, ...]) -> None:
    code = """
found = []
for end in (lambda s: s.close(), lambda s: s.finish(0.5)):
    simulation = pile()
    simulation.contacts()
    steps(simulation, 20)
    end(simulation)
    ended = simulation.state_hash()
    remove = Remove(time=0, body="g-1")
    found.append([raised(simulation.step), raised(simulation.finish, 0.5), raised(simulation.apply, remove),
                  raised(simulation.close), raised(simulation.close), raised(simulation.frame),
                  raised(simulation.contacts), simulation.state_hash() == ended, survey(simulation)])
say(found)
"""
    wanted = ["RuntimeError", "RuntimeError", "RuntimeError", None, None, None, None, True, True]
    assert endure(SETTING + code, flags) == [wanted, wanted]


@WAYS
def test_closing_keeps_the_last_state(flags: tuple[str, ...]) -> None:
    code = """
one, other = pile(), pile()
steps(one, 20)
steps(other, 20)
one.close()
say(one.state_hash() == other.state_hash())
"""
    assert endure(SETTING + code, flags) is True


@WAYS
def test_diverged_simulation_can_be_read_but_not_go_on(flags: tuple[str, ...]) -> None:
    code = """
simulation = pile(wind=[1e12, 0], linear_drag=1e9)
found = [raised(steps, simulation, 20), raised(simulation.step), raised(simulation.finish, 0.5)]
simulation.frame(), simulation.contacts(), simulation.state_hash(), simulation.close()
say(found)
"""
    assert endure(SETTING + code, flags) == ["Divergence", "RuntimeError", "RuntimeError"]


@WAYS
def test_last_part_that_is_no_part_is_refused_and_one_that_diverges_says_so(flags: tuple[str, ...]) -> None:
    code = """
simulation = pile()
before = simulation.state_hash()
found = [raised(simulation.finish, part) for part in (0.0, 1.0, -1.0, 2.0, 1e300, math.nan, math.inf, -math.inf)]
wild = pile(wind=[1e12, 0], linear_drag=1e9)
wild.step()
say([found, simulation.state_hash() == before, raised(wild.finish, 0.9), raised(wild.finish, 0.9)])
"""
    assert endure(SETTING + code, flags) == [["ValueError"] * 8, True, "Divergence", "RuntimeError"]


@WAYS
def test_running_simulation_is_not_copied(flags: tuple[str, ...]) -> None:
    """In contact a copied space goes on differently on the very next step."""
    code = """
import copy, pickle
simulation = pile()
steps(simulation, 20)
say([raised(copy.copy, simulation), raised(copy.deepcopy, simulation), raised(pickle.dumps, simulation)])
"""
    assert endure(SETTING + code, flags) == ["TypeError"] * 3


@WAYS
def test_threads_that_step_one_simulation_are_refused_their_turn(flags: tuple[str, ...]) -> None:
    code = """
import threading
simulation, done, refused = pile(), [], []
def work():
    for _ in range(400):
        try:
            simulation.step()
        except RuntimeError:
            refused.append(1)
        else:
            done.append(1)
threads = [threading.Thread(target=work) for _ in range(4)]
for thread in threads:
    thread.start()
for thread in threads:
    thread.join()
alone = pile()
steps(alone, len(done))
say([len(done) + len(refused), len(done) > 0, simulation.state_hash() == alone.state_hash()])
"""
    assert endure(SETTING + code, flags) == [1600, True, True]


@WAYS
def test_observer_that_steps_is_refused(flags: tuple[str, ...]) -> None:
    code = """
simulation = pile()
simulation.watch(lambda *_: simulation.step())
say(raised(simulation.step))
"""
    assert endure(SETTING + code, flags) == "RuntimeError"


@WAYS
def test_interleaved_simulations_do_not_know_of_each_other(flags: tuple[str, ...]) -> None:
    code = """
alone = pile()
alone.contacts()
steps(alone, 60)
both = pile(), pile()
for simulation in both:
    simulation.contacts()
for k in range(60):
    for simulation in both:
        simulation.step()
say([each.state_hash() == alone.state_hash() for each in both] + [len(each.contacts()) for each in (alone, *both)])
"""
    same, also, *contacts = endure(SETTING + code, flags)
    assert same
    assert also
    assert len(set(contacts)) == 1


@WAYS
def test_what_was_read_outlives_its_simulation(flags: tuple[str, ...]) -> None:
    code = """
import gc
simulation = pile()
simulation.contacts()
steps(simulation, 60)
frame, contacts, bodies = simulation.frame(), simulation.contacts(), simulation.bodies
arrays = (frame.position, frame.velocity, frame.angle, contacts.point, contacts.impulse, bodies.position)
copies = [array.copy() for array in arrays]
steps(simulation, 10)
simulation.close()
del simulation
gc.collect()
for _ in range(20):
    steps(pile(), 3)
say([bool(np.array_equal(array, kept)) for array, kept in zip(arrays, copies)])
"""
    assert endure(SETTING + code, flags) == [True] * 6


@WAYS
def test_every_body_can_go_and_others_come(flags: tuple[str, ...]) -> None:
    code = """
simulation = pile()
simulation.contacts()
steps(simulation, 60)
touching = len(simulation.contacts())
for k in range(25):
    simulation.apply(Remove(time=0, body=f"g-{k + 1}"))
steps(simulation, 3)
last = len(simulation.contacts())
empty = len(simulation.contacts())
simulation.apply(Spawn(time=0, ball=Ball(name="new", position=(0.0, 0.9), radius=1.0)))
steps(simulation, 3)
contacts = simulation.contacts()
again = outcome(simulation.apply, Remove(time=0, body="g-1"))
simulation.apply(Remove(time=0, body="new"))
steps(simulation, 3)
frame = simulation.frame()
say([touching > 0, last > 0, empty, contacts.pair.tolist(), again, bool(frame.present.any()), survey(simulation)])
"""
    found = endure(SETTING + code, flags)
    assert found == [True, True, 0, [[25, -1]], "ActionError", False, True]
