"""Interrupts: Ctrl-C, held back while something is done that must be done whole, and heeded wherever it falls."""

import signal
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from types import FrameType

Signal = tuple[int, FrameType | None]
"""What a handler is called with."""

_holding: list[tuple[Callable[[int, FrameType | None], object], list[Signal]]] = []
"""For each `uninterrupted` that is entered, the outermost first: the handler before it, and what it holds back."""


@contextmanager
def uninterrupted() -> Iterator[Sequence[Signal]]:
    """Hold SIGINT back for a while: one that comes meanwhile is passed on at the end. Yield what is held back so far.

    Python would raise KeyboardInterrupt at any line, also within the clean-up that an earlier one set off. Only the
    main thread gets signals; elsewhere this does nothing.
    """
    before = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is not threading.main_thread() or not callable(before):
        yield ()
        return
    held: list[Signal] = []
    signal.signal(signal.SIGINT, lambda number, frame: held.append((number, frame)))
    _holding.append((before, held))
    try:
        yield held
    finally:
        _holding.pop()
        signal.signal(signal.SIGINT, before)
    if held:
        before(*held[0])


def pass_on_held() -> None:
    """Pass on an interrupt that `uninterrupted` holds back, in the middle of a long wait where nothing is half done."""
    if threading.current_thread() is not threading.main_thread():
        return
    for before, held in reversed(_holding):
        if held:
            before(*held.pop(0))


@contextmanager
def heeded() -> Iterator[None]:
    """Raise what the handler of SIGINT raised, as a rule KeyboardInterrupt, also where it was lost on the way.

    A library in C may call Python and not pass on what that raises: pymunk's bodies are freed in callbacks whose errors
    are printed and forgotten, as are errors in `__del__`, and numpy, where it compares rows, raises a TypeError in
    place of any other. Then it is raised in place of that error, or at the end, and not printed as ignored. Only the
    main thread gets signals; elsewhere this does nothing.
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
