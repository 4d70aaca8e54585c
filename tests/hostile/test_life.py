"""Life cycle of a simulation: start, threads, copies, end, and use after its end."""

import pytest

from tests.hostile.ordeal import INTERPRETER_FLAGS, run_isolated

pytestmark = pytest.mark.fail_slow(60)  # fuzzing and inputs at the ends of their ranges

SETTING = """
def pile(**world):
    return start(from_document({
        "world": {"gravity": [0, -9.81], **world},
        "plane": [{"point": [0, 0], "normal": [0, 1], "friction": 0.5}],
        "grid": [{"name": "g", "origin": [0, 1], "columns": 5, "rows": 5, "spacing": [1.9, 2], "radius": 1,
                  "friction": 0.5, "restitution": 0.5}],
    }))
def raised(do, *arguments):
    "Return the name of the exception that a call raises, or None."
    try:
        do(*arguments)
    except Exception as error:
        return type(error).__name__
    return None
"""


@INTERPRETER_FLAGS
def test_ended_simulation_can_be_read_but_not_continued(flags: tuple[str, ...]) -> None:
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
                  raised(simulation.contacts), simulation.state_hash() == ended, is_finite(simulation)])
report(found)
"""
    wanted = ["RuntimeError", "RuntimeError", "RuntimeError", None, None, None, None, True, True]
    assert run_isolated(SETTING + code, flags) == [wanted, wanted]


@INTERPRETER_FLAGS
def test_diverged_simulation_can_be_read_but_not_continued(flags: tuple[str, ...]) -> None:
    code = """
simulation = pile(wind=[1e12, 0], linear_drag=1e9)
found = [raised(steps, simulation, 20), raised(simulation.step), raised(simulation.finish, 0.5)]
simulation.frame(), simulation.contacts(), simulation.state_hash(), simulation.close()
report(found)
"""
    assert run_isolated(SETTING + code, flags) == ["Divergence", "RuntimeError", "RuntimeError"]


@INTERPRETER_FLAGS
def test_invalid_partial_step_is_refused_and_a_diverging_one_is_reported(flags: tuple[str, ...]) -> None:
    code = """
simulation = pile()
before = simulation.state_hash()
found = [raised(simulation.finish, part) for part in (0.0, 1.0, -1.0, 2.0, 1e300, math.nan, math.inf, -math.inf)]
wild = pile(wind=[1e12, 0], linear_drag=1e9)
wild.step()
report([found, simulation.state_hash() == before, raised(wild.finish, 0.9), raised(wild.finish, 0.9)])
"""
    assert run_isolated(SETTING + code, flags) == [["ValueError"] * 8, True, "Divergence", "RuntimeError"]


@INTERPRETER_FLAGS
def test_concurrent_steps_of_threads_are_refused(flags: tuple[str, ...]) -> None:
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
report([len(done) + len(refused), len(done) > 0, simulation.state_hash() == alone.state_hash()])
"""
    assert run_isolated(SETTING + code, flags) == [1600, True, True]


@INTERPRETER_FLAGS
def test_step_by_an_observer_is_refused(flags: tuple[str, ...]) -> None:
    code = """
simulation = pile()
simulation.watch(lambda *_: simulation.step())
report(raised(simulation.step))
"""
    assert run_isolated(SETTING + code, flags) == "RuntimeError"


@INTERPRETER_FLAGS
def test_arrays_that_were_read_outlive_their_simulation(flags: tuple[str, ...]) -> None:
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
report([bool(np.array_equal(array, kept)) for array, kept in zip(arrays, copies)])
"""
    assert run_isolated(SETTING + code, flags) == [True] * 6
