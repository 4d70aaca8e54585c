"""Worker: a process that serves tasks over its pipes, one JSON line each way.

    python -m sandbox.measure.extremes.worker MEMORY_MIB

It says {"ready": true} once it has imported everything, {"compiling": true} when an answer takes longer as kernels are
compiled, and then one outcome for each task. It ends when its standard input does.
"""

import json
import os
import sys
from collections.abc import Callable, Mapping
from typing import Any, TextIO

from sandbox.measure.extremes.confine import allow_processor, limit_memory

Document = dict[str, Any]
Answer = Callable[[Mapping[str, Any]], Document]

SPARE = 300.0
"""s of processor time that a task may have beside its limit, as kernels may be compiled in it."""


def serve(answer: Answer, memory: int) -> None:
    """Answer task after task.

    Args:
        answer: makes an outcome's document of a task's.
        memory: MiB that the process may have.
    """
    limit_memory(memory)
    speak = _own_output()
    speak.write('{"ready": true}\n')
    _tell_of_compiling(speak)
    for line in sys.stdin:
        asked = json.loads(line)
        allow_processor(asked["seconds"] + SPARE)
        try:
            told = answer(asked["task"])
        except MemoryError:
            told = {"verdict": "failed", "reason": "out of memory", "rule": "process"}
        speak.write(json.dumps(told) + "\n")


def _own_output() -> TextIO:
    """Return a stream to whoever asks; what else is printed, also by libraries in C, goes to standard error."""
    speak = os.fdopen(os.dup(1), "w", buffering=1, encoding="utf-8")
    os.dup2(2, 1)
    return speak


def _tell_of_compiling(speak: TextIO) -> None:
    from sandbox.engines.common.compile_clock import COMPILE_CLOCK

    COMPILE_CLOCK.on_begin = lambda _: print('{"compiling": true}', file=speak)


def _attempted(document: Mapping[str, Any]) -> Document:
    from dataclasses import asdict

    from sandbox.measure.extremes.cell import Task
    from sandbox.measure.extremes.trial import attempt

    return asdict(attempt(Task.read(document)))


def main() -> None:
    """Serve what is asked on standard input."""
    import sandbox.engines.common.kernel
    import sandbox.measure.extremes.trial  # noqa: F401, what takes long is imported before it says that it is ready

    serve(_attempted, int(sys.argv[1]))


if __name__ == "__main__":
    main()
