"""Interrupts: Ctrl-C, held back while something is done that must be done whole, and heeded wherever it falls."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType


@contextmanager
def uninterrupted() -> Iterator[None]:
    """Hold SIGINT back for a while: one that comes meanwhile is passed on at the end.

    Python would raise KeyboardInterrupt at any line, also within the clean-up that an earlier one set off. Only the
    main thread gets signals; elsewhere this does nothing.
    """
    before = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is not threading.main_thread() or not callable(before):
        yield
        return
    held: list[tuple[int, FrameType | None]] = []
    signal.signal(signal.SIGINT, lambda number, frame: held.append((number, frame)))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
    if held:
        before(*held[0])


@contextmanager
def heeded() -> Iterator[None]:
    """Raise what the handler of SIGINT raised, as a rule KeyboardInterrupt, also where it was lost on the way.

    A library in C may call Python and not pass on what that raises: pymunk's bodies are freed in callbacks whose errors
    are printed and forgotten, and numpy, where it compares rows, raises a TypeError in place of any other. Then it is
    raised in place of that error, or at the end. Only the main thread gets signals; elsewhere this does nothing.
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

    try:
        signal.signal(signal.SIGINT, note)
        yield
    except Exception:
        if raised:
            raise raised[0] from None
        raise
    finally:
        signal.signal(signal.SIGINT, before)
    if raised:
        raise raised[0]
