"""Messages of a front end to a live scene: JSON arrays of inputs, each an object with a `type`.

One request is one array, and has one reply (`viewer.Viewer.handle`).
"""

from functools import cache
from typing import Annotated, Literal

from pydantic import Field, TypeAdapter, ValidationError

from sandbox.echo import MAX_MESSAGE, printable, shorten
from sandbox.scene.description.base import Name, Part, Point
from sandbox.scene.description.play import PlaybackSpeed

MAX_INPUTS = 32
"""Inputs of one request."""
MAX_CHARACTERS = 64_000
"""Length of a request; the inputs of a front end take a few hundred."""

BodyIndex = Annotated[int, Field(ge=0, le=1_000_000)]
"""Index among the drawn bodies."""
UnitComponent = Annotated[float, Field(ge=-1, le=1)]


class MessageError(ValueError):
    """A request is not a valid array of inputs; `str()` gives the reason."""


class OpenInput(Part):
    """Ask for everything that is drawn, as if the viewer had seen nothing yet."""

    type: Literal["open"]


class AdvanceInput(Part):
    """Advance the scene by elapsed real time, if it plays."""

    type: Literal["advance"]
    elapsed: Annotated[float, Field(ge=0, le=1e9)]
    """s"""


class PlayInput(Part):
    """Play or pause."""

    type: Literal["play"]
    on: bool


class StepInput(Part):
    """Pause, and make some time steps."""

    type: Literal["step"]
    count: Annotated[int, Field(ge=1, le=1000)] = 1


class ResetInput(Part):
    """Start the scene again, with the values of the sliders."""

    type: Literal["reset"]


class SpeedInput(Part):
    """Set the speed."""

    type: Literal["speed"]
    speed: PlaybackSpeed
    """multiple of real time"""


class GrabInput(Part):
    """Begin to drag a body."""

    type: Literal["grab"]
    body: BodyIndex
    grip: Point
    """point at which the body is held, in its own frame, m"""
    target: Point
    """m"""


class DragInput(Part):
    """Move the target of the dragged body."""

    type: Literal["drag"]
    target: Point
    """m"""


class ReleaseInput(Part):
    """Release the dragged body."""

    type: Literal["release"]


class PushInput(Part):
    """Apply an impulse to a body."""

    type: Literal["push"]
    body: BodyIndex
    direction: tuple[UnitComponent, UnitComponent]
    """times an impulse that suits the body"""


class SliderInput(Part):
    """Set the value of a slider."""

    type: Literal["set"]
    key: Name
    value: float


class EngineInput(Part):
    """Continue with another engine."""

    type: Literal["engine"]
    name: Name


class GhostInput(Part):
    """Start or end a second run beside the scene."""

    type: Literal["ghost"]
    engine: Name | None
    """its engine; null ends the ghost"""
    dt_fraction: Annotated[float, Field(ge=0.001, le=1)] = 1.0
    """its time step, as a fraction of that of the scene"""


Input = Annotated[
    OpenInput
    | AdvanceInput
    | PlayInput
    | StepInput
    | ResetInput
    | SpeedInput
    | GrabInput
    | DragInput
    | ReleaseInput
    | PushInput
    | SliderInput
    | EngineInput
    | GhostInput,
    Field(discriminator="type"),
]


@cache
def _inputs() -> TypeAdapter[list[Input]]:
    return TypeAdapter(Annotated[list[Input], Field(max_length=MAX_INPUTS)])


def read_inputs(text: str) -> list[Input]:
    """Read a request.

    Raises:
        MessageError: it is too long, or not a JSON array of inputs.
    """
    if len(text) > MAX_CHARACTERS:
        raise MessageError(f"a message of {len(text):,} characters is too long; the limit is {MAX_CHARACTERS:,}")
    try:
        return _inputs().validate_json(text, strict=True)
    except ValidationError as error:
        faults = error.errors(include_url=False, include_context=False, include_input=False)[:3]
        parts = (f"{'.'.join(map(str, each['loc'])) or 'message'}: {each['msg']}" for each in faults)
        raise MessageError(shorten(printable("; ".join(parts)), MAX_MESSAGE)) from None
