"""Interrupts held back, and reraise_interrupt wherever they fall."""

import gc
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from types import FrameType

import pytest

from sandbox import load, run
from sandbox.cli.main import call
from sandbox.scene.files.shipped_scenes import find
from sandbox.signals import defer_interrupt, reraise_interrupt

pytestmark = pytest.mark.full  # child processes and command lines that run long


@pytest.fixture(autouse=True)
def interruptible() -> Iterator[None]:
    """Python's own handler, whatever the tests were started with."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def test_interrupt_waits_for_the_end() -> None:
    done = []
    with pytest.raises(KeyboardInterrupt), defer_interrupt():
        signal.raise_signal(signal.SIGINT)
        signal.raise_signal(signal.SIGINT)
        done.append("all of it")
    assert done == ["all of it"]
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_nothing_happens_without_an_interrupt() -> None:
    with defer_interrupt():
        assert signal.getsignal(signal.SIGINT) is not signal.default_int_handler
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_fault_within_is_told_and_the_handler_comes_back() -> None:
    with pytest.raises(ValueError, match="broken"), defer_interrupt():
        raise ValueError("broken")
    with pytest.raises(KeyboardInterrupt):
        signal.raise_signal(signal.SIGINT)


def test_ignored_interrupts_stay_ignored() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with defer_interrupt():
        signal.raise_signal(signal.SIGINT)
    assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN


def test_other_threads_go_on_undisturbed() -> None:
    done = []

    def work() -> None:
        with defer_interrupt():
            done.append(signal.getsignal(signal.SIGINT))

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert done == [signal.default_int_handler]


def test_interrupt_in_disguise_is_an_interrupt() -> None:
    with pytest.raises(KeyboardInterrupt), reraise_interrupt():
        try:
            signal.raise_signal(signal.SIGINT)
        except KeyboardInterrupt:
            raise TypeError("as C makes of it") from None
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_interrupt_that_was_lost_comes_at_the_end() -> None:
    done = []
    with pytest.raises(KeyboardInterrupt), reraise_interrupt():
        with suppress(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
        done.append("all of it")
    assert done == ["all of it"]


def test_faults_of_its_own_are_told_and_a_handler_that_raises_nothing_is_no_interrupt() -> None:
    with pytest.raises(ValueError, match="broken"), reraise_interrupt():
        raise ValueError("broken")
    done = []
    signal.signal(signal.SIGINT, lambda *_: done.append("handled"))
    with reraise_interrupt():
        signal.raise_signal(signal.SIGINT)
    assert done == ["handled"]


def test_deferred_within_reraise_comes_at_the_end() -> None:
    done = []
    with pytest.raises(KeyboardInterrupt), reraise_interrupt(), defer_interrupt():
        signal.raise_signal(signal.SIGINT)
        done.append("all of it")
    assert done == ["all of it"]


@contextmanager
def falling_into(function: str) -> Iterator[list[str]]:
    """Send SIGINT when a function of some name is called, once; yield where it fell."""
    fell: list[str] = []

    def watch(frame: FrameType, event: str, _: object) -> None:
        if event == "call" and frame.f_code.co_name == function and not fell:
            fell.append(function)
            signal.raise_signal(signal.SIGINT)

    sys.setprofile(watch)
    try:
        yield fell
    finally:
        sys.setprofile(None)


def test_interrupt_within_numpy_ends_a_run() -> None:
    scene = load(find("bounce"), ["world.duration=0.05"])
    # numpy calls it where it compares rows, in C that does not pass on what it raises.
    with falling_into("_promote_fields") as fell, pytest.raises(KeyboardInterrupt):
        run(scene)
    assert fell


def test_interrupt_while_a_space_is_freed_is_neither_lost_nor_printed(monkeypatch: pytest.MonkeyPatch) -> None:
    printed: list[object] = []
    monkeypatch.setattr(sys, "unraisablehook", printed.append)
    scene = load(find("bounce"), ["world.duration=0.05"])
    with falling_into("spacefree") as fell, pytest.raises(KeyboardInterrupt), reraise_interrupt():
        run(scene)
        gc.collect()  # a space and its bodies know each other
    assert len(fell) == 1
    assert printed == []


def test_command_interrupted_within_numpy_tells_so(capfd: pytest.CaptureFixture[str]) -> None:
    with falling_into("_promote_fields") as fell:
        status = call(["run", "bounce", "--quiet"])
    assert fell
    assert (status, capfd.readouterr().err) == (130, "interrupted: 0 of 1 runs are complete and kept\n")


class Finalised:
    """Does something when it is freed; Python prints and forgets what that raises."""

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
