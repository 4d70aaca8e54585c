"""Ways to run a simulation step by step, and what a caller can observe of it."""

from collections.abc import Sequence
from typing import TypeVar

from sandbox.engines.contract import Divergence, Exhaustion, Simulation
from sandbox.engines.switching import SwitchableSimulation
from sandbox.frame_table import FrameTable
from sandbox.trajectory import Contacts

AnySimulation = TypeVar("AnySimulation", bound=Simulation)


def advance(simulation: AnySimulation, steps: int) -> AnySimulation:
    """Make some steps, and return the simulation."""
    for _ in range(steps):
        simulation.step()
    return simulation


def columns_of(contacts: Contacts) -> list[bytes]:
    arrays = (contacts.time, contacts.pair, contacts.point, contacts.normal, contacts.impulse)
    return [array.tobytes() for array in arrays]


def continued(simulation: Simulation, steps: int) -> list[object]:
    """Make some steps, and return everything that a caller can observe; of energies, nothing if no account is kept."""
    seen: list[object] = []
    for _ in range(steps):
        simulation.step()
        seen += [simulation.time, simulation.state_hash(), *columns_of(simulation.contacts())]
    return [
        *seen,
        dict(simulation.work),
        dict(simulation.account()),
        dict(simulation.retired),
        dict(simulation.broken),
        simulation.bodies.names,
    ]


def outcome(simulation: Simulation, made: int, error: Exception | None, contacts: Sequence[Contacts]) -> list[object]:
    """Return everything that a caller can observe at the end."""
    return [
        made,
        repr(error),
        simulation.time,
        simulation.state_hash(),
        dict(simulation.work),
        dict(simulation.retired),
        dict(simulation.broken),
        simulation.plane_reach,
        *columns_of(Contacts.joined(list(contacts))),
    ]


def stepped(simulation: SwitchableSimulation, splits: Sequence[int], every: int) -> tuple[FrameTable, list[object]]:
    """Step a simulation, and read its contacts after each split."""
    table = FrameTable(sum(splits) + 1, len(simulation.bodies), every)
    table.record(simulation.frame())
    contacts, error = [simulation.contacts()], None
    for steps in splits:
        try:
            for _ in range(steps):
                simulation.step()
                table.steps += 1
                if table.is_due():
                    table.record(simulation.frame())
        except (Divergence, Exhaustion) as caught:
            error = caught
            break
        contacts.append(simulation.contacts())
    return table, outcome(simulation, table.steps, error, contacts)


def advanced(simulation: SwitchableSimulation, splits: Sequence[int], every: int) -> tuple[FrameTable, list[object]]:
    """Advance a simulation by the same splits."""
    table = FrameTable(sum(splits) + 1, len(simulation.bodies), every)
    table.record(simulation.frame())
    contacts, error = [simulation.contacts()], None
    for steps in splits:
        end = table.steps + steps
        try:
            while table.steps < end:
                before = table.steps
                simulation.advance(end - table.steps, table)
                assert table.steps > before
        except (Divergence, Exhaustion) as caught:
            error = caught
            break
        contacts.append(simulation.contacts())
    return table, outcome(simulation, table.steps, error, contacts)


def assert_same_frames(one: FrameTable, other: FrameTable) -> None:
    assert one.count == other.count
    for key in ("time", "position", "velocity", "angle", "angular_velocity", "spin", "layer"):
        a, b = getattr(one, key), getattr(other, key)
        assert (a is None) == (b is None), key
        if a is not None:
            assert a[: one.count].tobytes() == b[: one.count].tobytes(), key
