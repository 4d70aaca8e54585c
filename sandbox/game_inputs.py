"""Inputs of a pymunk game, as its program saw them: events, keys, mouse, clock and random seeds, frame by frame.

They are a part of a recording, with a version of its own. A frame ends when the program shows it
(`pygame.display.flip`, `flip` of a pyglet window); of a program without a window, with each `Space.step`.
"""

import hashlib
import json
import random
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NamedTuple

from pydantic import TypeAdapter, ValidationError

from sandbox.atomic_write import atomic_write
from sandbox.resource_limits import SESSION_SIZE, read_limited
from sandbox.scene.errors import Fault, SceneError

VERSION = 1
STATES = ("keys", "modifiers", "mouse", "mouse_buttons", "focus")
"""Kinds of readings that are states of keyboard and mouse"""
PYGLET_EVENT = -1
"""Type of an event of pyglet: its values are the number of the window, from 0, the name and the arguments"""

InputValue = bool | int | float | str | list[Any] | dict[str, Any] | None
"""Value in JSON"""


class InputReading(NamedTuple):
    """Value of an input as a call of the program saw it."""

    frame: int
    """number of the frame, from 0"""
    call: int
    """number of the call of this kind within the frame, from 0"""
    value: InputValue


class InputEvent(NamedTuple):
    """Event that reached the queue of the program."""

    frame: int
    call: int
    """number of the call, within the frame, by which the program looks into its queue and finds the event"""
    type: int
    """number of the type in pygame, or `PYGLET_EVENT`"""
    values: dict[str, InputValue]
    """attributes"""


@dataclass(frozen=True)
class GameInputs:
    """Inputs of a game, with which its program can run again."""

    program: str
    """path of the program, as the user named it"""
    folder: str
    """working folder"""
    arguments: tuple[str, ...] = ()
    """arguments of the program"""
    pymunk6: bool = False
    """whether the program used names of pymunk 6, as with `--pymunk6`"""
    seed: int = 0
    """seed of `random` and `numpy.random`"""
    hash_seed: str | None = None
    """`PYTHONHASHSEED` of the process; None if strings had random hashes"""
    started: float = 0.0
    """start, s since 1970"""
    frame_times: tuple[float, ...] = ()
    """time at the end of each frame, s since the start"""
    readings: Mapping[str, tuple[InputReading, ...]] = field(default_factory=dict)
    """by kind: times (`time.perf_counter`, `pygame.time.get_ticks`, `tick`) of each call; states (`keys`, `mouse`)
    whenever they have changed"""
    events: tuple[InputEvent, ...] = ()
    """events in the order in which they reached the program"""
    steps: int = 0
    """calls of `Space.step`"""
    is_whole: bool = True
    """whether the program ended by itself, and not by a limit of steps, an interrupt or an error"""
    frame_hashes: tuple[str, ...] = ()
    """hash of the states of all bodies at the end of each frame"""
    digests: Mapping[str, str] = field(default_factory=dict)
    """SHA-256 of each file of the program that it read, by path relative to the folder of the program"""
    saved_files: Mapping[str, str | None] = field(default_factory=dict)
    """content before the start, in base64, of each file that the program wrote; None if it did not exist"""
    notes: tuple[str, ...] = ()
    """what the program did that inputs do not have, such as threads"""
    version: int = VERSION

    @property
    def frames(self) -> int:
        """Number of frames."""
        return len(self.frame_times)

    @property
    def duration(self) -> float:
        """Time from the start to the end of the last frame, s."""
        return self.frame_times[-1] if self.frame_times else 0.0

    @property
    def path(self) -> Path:
        """Path of the program, from the folder in which it ran."""
        return Path(self.folder) / self.program


_INPUTS: TypeAdapter[GameInputs] = TypeAdapter(GameInputs)


def inputs_to_json(inputs: GameInputs) -> dict[str, Any]:
    """Return inputs as JSON values."""
    document: dict[str, Any] = _INPUTS.dump_python(inputs, mode="json")
    return document


def inputs_from_json(document: Mapping[str, Any]) -> GameInputs:
    """Read inputs from JSON values.

    Raises:
        ValueError: a value has another type, or the version is unknown.
    """
    if document.get("version") != VERSION:
        raise ValueError(f"`inputs`: their version is {document.get('version')!r}, this program reads {VERSION}")
    try:
        return _INPUTS.validate_json(json.dumps(document), strict=True)
    except ValidationError as error:
        first = error.errors()[0]
        raise ValueError(f"`inputs`: {'.'.join(map(str, first['loc']))}: {first['msg']}") from None


def load_inputs(path: str | Path) -> GameInputs:
    """Read the inputs in the file of a recording.

    Args:
        path: path of the file.

    Raises:
        SceneError: the file cannot be read, or has no inputs.
    """
    try:
        document = json.loads(read_limited(Path(path), SESSION_SIZE.value))
        if not isinstance(document, dict) or "inputs" not in document:
            raise ValueError("it has no inputs of a game; `sandbox record GAME.py` writes them")
        return inputs_from_json(document["inputs"])
    except (OSError, ValueError) as error:
        reason = (error.strerror if isinstance(error, OSError) else None) or error
        raise SceneError([Fault.of(str(path), f"cannot be read: {reason}")]) from None


def save_inputs(inputs: GameInputs, path: Path) -> None:
    """Write a file that has the inputs of a game only, and no scene.

    Raises:
        OSError: the file cannot be written.
    """
    with atomic_write(path) as temporary:
        temporary.write_text(json.dumps({"inputs": inputs_to_json(inputs)}, indent=1), encoding="utf-8")


def file_digest(path: Path) -> str:
    """Return the SHA-256 of a file."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def jittered(inputs: GameInputs, seed: int) -> GameInputs:
    """Return inputs in which keys, mouse and events of a frame come in it or in the next one, at random.

    Their order stays. The clock does not change.

    Args:
        inputs: of a game.
        seed: of the random numbers.
    """
    delays = random.Random(seed)
    delay = [delays.randrange(2) for _ in range(inputs.frames + 1)]
    states = {kind for kind in inputs.readings if kind in STATES}

    def at(frame: int, call: int) -> tuple[int, int]:
        return (frame + 1, 0) if delay[min(frame, inputs.frames)] else (frame, call)

    readings = {
        kind: tuple(InputReading(*at(each.frame, each.call), each.value) for each in known) if kind in states else known
        for kind, known in inputs.readings.items()
    }
    events = tuple(InputEvent(*at(each.frame, each.call), each.type, each.values) for each in inputs.events)
    return replace(inputs, readings=readings, events=events)
