"""Fan: many shots from one state, as arrays."""

from dataclasses import dataclass

from sandbox.trajectory import FloatArray, IntArray


@dataclass(frozen=True, eq=False, slots=True)
class Fan:
    """M shots of N balls from one state."""

    position: FloatArray
    """(M, N, 2) m, where the balls came to rest"""
    pocket: IntArray
    """(M, N) into which pocket each fell, −1 for none"""
    duration: FloatArray
    """(M,) s, until the last event"""
    events: IntArray
    """(M,) how many there were"""
    complete: FloatArray
    """(M,) whether everything came to rest"""
