"""Signals: `defer_interrupt` delays SIGINT, `reraise_interrupt` restores a SIGINT that was lost or replaced."""

import gc
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from types import FrameType

import pytest

from sandbox.cli.main import call
from sandbox.signals import defer_interrupt, reraise_interrupt

pytestmark = pytest.mark.fail_slow(60)  # child processes and command lines that run long


@pytest.fixture(autouse=True)
def default_handler() -> Iterator[None]:
    """Install Python's own SIGINT handler, even if the tests were started with another."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def test_deferred_interrupt_is_raised_at_the_end_of_the_block() -> None:
    done = []
    with pytest.raises(KeyboardInterrupt), defer_interrupt():
        signal.raise_signal(signal.SIGINT)
        signal.raise_signal(signal.SIGINT)
        done.append("all of it")
    assert done == ["all of it"]
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_error_within_defer_interrupt_is_raised_and_the_handler_restored() -> None:
    with pytest.raises(ValueError, match="broken"), defer_interrupt():
        raise ValueError("broken")
    with pytest.raises(KeyboardInterrupt):
        signal.raise_signal(signal.SIGINT)


def test_ignored_interrupts_stay_ignored() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with defer_interrupt():
        signal.raise_signal(signal.SIGINT)
    assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN


def test_defer_interrupt_does_nothing_in_other_threads() -> None:
    done = []

    def work() -> None:
        with defer_interrupt():
            done.append(signal.getsignal(signal.SIGINT))

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert done == [signal.default_int_handler]


def test_interrupt_replaced_by_another_exception_is_raised_again() -> None:
    with pytest.raises(KeyboardInterrupt), reraise_interrupt():
        try:
            signal.raise_signal(signal.SIGINT)
        except KeyboardInterrupt:
            raise TypeError("raised by C code") from None
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_suppressed_interrupt_is_raised_at_the_end_of_the_block() -> None:
    done = []
    with pytest.raises(KeyboardInterrupt), reraise_interrupt():
        with suppress(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
        done.append("all of it")
    assert done == ["all of it"]


def test_reraise_interrupt_keeps_other_errors_and_custom_handlers() -> None:
    with pytest.raises(ValueError, match="broken"), reraise_interrupt():
        raise ValueError("broken")
    done = []
    signal.signal(signal.SIGINT, lambda *_: done.append("handled"))
    with reraise_interrupt():
        signal.raise_signal(signal.SIGINT)
    assert done == ["handled"]


def test_interrupt_deferred_within_reraise_is_raised_at_the_end() -> None:
    done = []
    with pytest.raises(KeyboardInterrupt), reraise_interrupt(), defer_interrupt():
        signal.raise_signal(signal.SIGINT)
        done.append("all of it")
    assert done == ["all of it"]


@contextmanager
def interrupt_in(function: str) -> Iterator[list[str]]:
    """Send SIGINT at the first call of a function with this name; yield the list of functions interrupted."""
    interrupted: list[str] = []

    def watch(frame: FrameType, event: str, _: object) -> None:
        if event == "call" and frame.f_code.co_name == function and not interrupted:
            interrupted.append(function)
            signal.raise_signal(signal.SIGINT)

    sys.setprofile(watch)
    try:
        yield interrupted
    finally:
        sys.setprofile(None)


def test_command_interrupted_within_numpy_exits_with_status_130(capfd: pytest.CaptureFixture[str]) -> None:
    with interrupt_in("_promote_fields") as interrupted:
        status = call(["run", "double_pendulum", "--quiet"])
    assert interrupted
    assert (status, capfd.readouterr().err) == (130, "interrupted: 0 of 1 runs are complete and kept\n")


class Finalised:
    """Calls a function when it is freed; Python prints and drops exceptions raised there."""

    def __init__(self, action: Callable[[], object]) -> None:
        self.action = action

    def __del__(self) -> None:
        self.action()


def test_interrupt_while_an_object_is_freed_is_raised_and_not_printed(monkeypatch: pytest.MonkeyPatch) -> None:
    printed: list[object] = []
    monkeypatch.setattr(sys, "unraisablehook", lambda unraisable: printed.append(unraisable.exc_value))
    with pytest.raises(KeyboardInterrupt), reraise_interrupt():
        each = Finalised(lambda: signal.raise_signal(signal.SIGINT))
        del each
        gc.collect()
    assert printed == []


def test_other_errors_while_an_object_is_freed_are_printed(monkeypatch: pytest.MonkeyPatch) -> None:
    printed: list[object] = []
    hook = printed.append
    monkeypatch.setattr(sys, "unraisablehook", lambda unraisable: hook(type(unraisable.exc_value)))
    with reraise_interrupt():
        each = Finalised(lambda: 1 // 0)
        del each
    assert printed == [ZeroDivisionError]
