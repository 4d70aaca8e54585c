"""Interrupts (SIGINT, Ctrl-C): deferred during operations that must complete, and raised again where they were lost."""

import signal
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from types import FrameType

Signal = tuple[int, FrameType | None]
"""Arguments of a signal handler."""

_deferring: list[tuple[Callable[[int, FrameType | None], object], list[Signal]]] = []
"""Handler and deferred signals of each `defer_interrupt` that is entered, the outermost first."""


@contextmanager
def defer_interrupt() -> Iterator[Sequence[Signal]]:
    """Defer SIGINT until the end of the block. Yields the signals that are deferred so far.

    Without it, Python may raise KeyboardInterrupt at any line, also within the clean-up after an earlier one. Only the
    main thread gets signals; in other threads this does nothing.
    """
    before = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is not threading.main_thread() or not callable(before):
        yield ()
        return
    held: list[Signal] = []
    signal.signal(signal.SIGINT, lambda number, frame: held.append((number, frame)))
    _deferring.append((before, held))
    try:
        yield held
    finally:
        _deferring.pop()
        signal.signal(signal.SIGINT, before)
    if held:
        before(*held[0])


def deliver_deferred_interrupt() -> None:
    """Deliver an interrupt that `defer_interrupt` has deferred, during a long wait in which nothing is incomplete."""
    if threading.current_thread() is not threading.main_thread():
        return
    for before, held in reversed(_deferring):
        if held:
            before(*held.pop(0))


@contextmanager
def reraise_interrupt() -> Iterator[None]:
    """Raise the exception of the SIGINT handler, usually KeyboardInterrupt, even if a library has discarded it.

    C libraries that call Python may discard exceptions: pymunk frees bodies in callbacks whose errors are printed and
    ignored, as are errors in `__del__`; numpy's comparison of rows replaces any exception by a TypeError. The exception
    is then raised in place of that error, or at the end of the block, and is not printed as ignored. Only the main
    thread gets signals; in other threads this does nothing.
    """
    before = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is not threading.main_thread() or not callable(before):
        yield
        return
    raised: list[BaseException] = []

    def note(number: int, frame: FrameType | None) -> None:
        try:
            before(number, frame)
        except BaseException as error:
            raised.append(error)
            raise

    report = sys.unraisablehook

    def report_others(unraisable: "sys.UnraisableHookArgs") -> None:
        if not any(unraisable.exc_value is error for error in raised):
            report(unraisable)

    try:
        sys.unraisablehook = report_others
        signal.signal(signal.SIGINT, note)
        yield
    except Exception:
        if raised:
            raise raised[0] from None
        raise
    finally:
        signal.signal(signal.SIGINT, before)
        sys.unraisablehook = report
    if raised:
        raise raised[0]
