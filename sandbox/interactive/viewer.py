"""One viewer of a live scene: its requests and replies, and the body that it drags."""

import math
from time import perf_counter
from typing import Any

from sandbox.action import ActionError, Impulse, Move, Pull
from sandbox.engines.contract import Refusal
from sandbox.interactive.live_scene import STEP_TIMEOUT, LiveScene
from sandbox.interactive.messages import (
    AdvanceInput,
    DragInput,
    EngineInput,
    GhostInput,
    GrabInput,
    Input,
    MessageError,
    OpenInput,
    PlayInput,
    PushInput,
    ReleaseInput,
    ResetInput,
    SliderInput,
    SpeedInput,
    StepInput,
    read_inputs,
)
from sandbox.scene.description.base import Point
from sandbox.scene.errors import PartError
from sandbox.scene.geometry.vectors import rotate

PUSH_SPEED = 1.0
"""m/s that a push adds to a body; in small scenes 10 radii/s"""
MAX_GRIP = 2.0
"""Largest distance of a grip from the centre of its body, in radii of the body."""


class Viewer:
    """A viewer of a live scene. Closing it releases the body that it drags, not the scene."""

    def __init__(self, live: LiveScene) -> None:
        self._live = live
        self._held: str | None = None  # name of the dragged body
        self._grip: Point = (0.0, 0.0)  # m, in its frame
        self._seen = self._seen_picture = -1  # revisions that were sent

    def handle(self, request: str) -> dict[str, Any]:
        """Handle a request, a JSON array of inputs, and return the reply as JSON values.

        The reply has the keys of `LiveScene.frame_document`; `state` and `picture` if they have changed since the last
        reply; `messages` with refusals and remarks. A request that is no array of inputs changes nothing.
        """
        messages: list[str] = []
        try:
            inputs = read_inputs(request)
        except MessageError as error:
            inputs, messages = [], [str(error)]
        until = perf_counter() + STEP_TIMEOUT  # of all inputs: the server ends when the last request is answered
        for each in inputs:
            if isinstance(each, StepInput | AdvanceInput) and perf_counter() > until:
                continue
            try:
                message = self._apply(each)
            except (ActionError, Refusal) as refusal:
                message = str(refusal)
            if message:
                messages.append(message)
        return self._reply(messages)

    def _reply(self, messages: list[str]) -> dict[str, Any]:
        live = self._live
        reply = live.frame_document()
        if self._seen_picture != live.picture_revision:
            self._seen_picture, reply["picture"] = live.picture_revision, live.picture.document()
        if self._seen != live.revision:
            self._seen, reply["state"] = live.revision, live.state()
        if messages:
            reply["messages"] = messages
        return reply

    def _apply(self, given: Input) -> str | None:
        """Apply an input; return a remark, or None.

        Raises:
            ActionError: it is refused.
        """
        live = self._live
        match given:
            case OpenInput():
                self._seen = self._seen_picture = -1
            case AdvanceInput():
                live.advance(given.elapsed)
            case PlayInput():
                live.play(given.on)
            case StepInput():
                live.step(given.count)
            case ResetInput():
                return live.reset()
            case SpeedInput():
                live.set_speed(given.speed)
            case GrabInput():
                self._grab(given)
            case DragInput():
                self._drag(given.target)
            case ReleaseInput():
                self._release()
            case PushInput():
                self._push(given)
            case SliderInput():
                return live.set_value(given.key, given.value)
            case EngineInput():
                return live.set_engine(given.name)
            case GhostInput():
                live.set_ghost(given.engine, given.dt_fraction)
        return None

    def _index_of(self, body: int) -> int:
        """Return the index of a drawn body among all bodies.

        Raises:
            ActionError: there is no such body.
        """
        drawn = self._live.picture.drawn
        if body >= len(drawn):
            raise ActionError(f"there is no body {body}; the scene draws {len(drawn):,}")
        return int(drawn[body])

    def _grab(self, given: GrabInput) -> None:
        self._release()
        live, index = self._live, self._index_of(given.body)
        bodies = live.simulation.bodies
        name = bodies.names[index]
        if math.hypot(*given.grip) > MAX_GRIP * float(bodies.radius[index]):
            raise ActionError(f"the grip is not on {name}")
        if any(drive.body == name for drive in live.simulation.scene.drives):
            raise ActionError(f"{name} cannot be dragged: a drive moves it")
        self._held, self._grip = name, given.grip
        self._drag(given.target)

    def _drag(self, point: Point) -> None:
        """Pull the held body towards a point, m; while paused, move it there. A refusal releases it."""
        if self._held is not None:
            try:
                self._move(self._held, self._live.picture.to_world(point))
            except ActionError:
                self._held = None
                raise
            except PartError:  # beyond the range of coordinates, with the origin of the picture
                self._held = None
                raise ActionError("the point is out of range") from None

    def _move(self, name: str, target: Point) -> None:
        live = self._live
        index = live.simulation.bodies.number_of.get(name)
        if index is None:  # the scene was started again with fewer bodies
            raise ActionError(f"{name} is no longer there")
        if live.playing:
            live.apply(Pull(time=0.0, body=name, grip=self._grip, target=target))
            return
        angle = float(live.frame.angle[index])
        arm = rotate(*self._grip, math.cos(angle), math.sin(angle))
        live.apply(Move(time=0.0, body=name, position=(target[0] - arm[0], target[1] - arm[1])))

    def _release(self) -> None:
        held, self._held = self._held, None
        if held is not None and held in self._live.simulation.pulls:
            self._live.apply(Pull(time=0.0, body=held))

    def _push(self, given: PushInput) -> None:
        index, bodies = self._index_of(given.body), self._live.simulation.bodies
        kick = float(bodies.mass[index]) * min(PUSH_SPEED, 10.0 * float(bodies.radius[index]))
        impulse = (given.direction[0] * kick, given.direction[1] * kick)
        self._live.apply(Impulse(time=0.0, body=bodies.names[index], impulse=impulse))

    def close(self) -> None:
        """Release the body that is dragged."""
        self._release()
