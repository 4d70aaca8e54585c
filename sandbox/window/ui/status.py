"""Status text of the window: values of the HUD, quantities of a body, and a summary of solver settings."""

import math

from sandbox.formatting import format_si
from sandbox.game_names import spec_of
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.description.bodies import Box, Capsule
from sandbox.scene.description.generators import Stack
from sandbox.scene.description.scene import zone_visits
from sandbox.scene.description.world import Settings
from sandbox.trajectory import Contacts, Frame
from sandbox.window.app_state import AppState
from sandbox.window.playback.live import LiveView
from sandbox.window.playback.recorded import RecordedView
from sandbox.window.playback.snapshot import HudStatus


def body_facts(bodies: Bodies, frame: Frame, contacts: Contacts, body_index: int) -> tuple[str, ...]:
    """Return lines about a body: its name, then its quantities."""
    if body_index >= len(frame.position):
        return ()
    (x, y), (vx, vy) = frame.position[body_index].tolist(), frame.velocity[body_index].tolist()
    spin, angle = float(frame.angular_velocity[body_index]), float(frame.angle[body_index])
    mass, moment = float(bodies.mass[body_index]), float(bodies.moment[body_index])
    lines = [bodies.names[body_index]]
    if not frame.present[body_index]:
        return (*lines, "removed")
    if bodies.fixed[body_index]:
        lines.append("fixed")
    else:
        speed = math.hypot(vx, vy)
        kinetic = 0.5 * (mass * speed * speed + moment * spin * spin)
        lines += [
            f"v {format_si(vx, 'm/s')}, {format_si(vy, 'm/s')}",
            f"|v| {format_si(speed, 'm/s')}",
            f"ω {format_si(spin, 'rad/s')}",
            f"E kin {format_si(kinetic, 'J')}",
        ]
        lines += ["kinematic"] if bodies.kinematic[body_index] else []
    lines.insert(1, f"x {format_si(x, 'm')}, {format_si(y, 'm')}")
    lines.append(f"m {format_si(mass, 'kg')}, {_size(bodies, body_index)}")
    if not (bodies.fixed[body_index] or bodies.round[body_index]):  # a disc has I = ½ m r²
        lines.append(f"I {format_si(moment, 'kg·m²')}")
    if angle:
        lines.append(f"angle {format_si(angle, 'rad')}")
    touching = int((contacts.pair == body_index).any(axis=1).sum()) if len(contacts) else 0
    if touching:
        lines.append(f"{touching} contact{'s' if touching > 1 else ''}")
    return tuple(lines)


def _size(bodies: Bodies, body_index: int) -> str:
    """Return the dimensions of a body as text, in terms of its shape."""
    element = bodies.elements[int(bodies.element[body_index])]
    if isinstance(element, Box | Stack):
        return f"{format_si(element.size[0], 'm')} × {format_si(element.size[1], 'm')}"
    if isinstance(element, Capsule):
        return f"l {format_si(element.length, 'm')}, r {format_si(element.radius, 'm')}"
    word = "r" if bodies.round[body_index] else "reach"
    return f"{word} {format_si(float(bodies.radius[body_index]), 'm')}"


def settings_text(settings: Settings, has_counts: bool = True) -> str:
    """Return a one-line summary of settings, without those that the engine does not use.

    Args:
        settings: the settings.
        has_counts: whether substeps and iterations are stated; the side panel states them too.
    """
    words = [f"dt {format_si(settings.dt, 's')}"]
    if settings.integrator is not None:
        if has_counts:
            words.append(f"{settings.substeps} × {settings.iterations} iterations")  # those of a step
        words.append(settings.integrator.replace("_", " "))
        if settings.detection not in (None, "discrete"):
            words.append(str(settings.detection))
        if settings.response not in (None, "impulse"):
            words.append(str(settings.response))
    return " · ".join(words)


def hud_status(
    app_state: AppState,
    scene_keys: tuple[tuple[str, str], ...],
    frame_rate: float,
    recording: str | None,
    has_panel: bool = False,
) -> HudStatus:
    """Return the values of the head-up display.

    Args:
        app_state: the application state.
        scene_keys: (keys, action) bound by the scene.
        frame_rate: frames per second.
        recording: format and length of the film being recorded, if any.
        has_panel: whether the side panel is visible.
    """
    show, messages = app_state.view, app_state.messages.visible()
    if show is None:
        return HudStatus("No scene", "Ctrl+O", "opens a scene", 0, 0.0, messages=messages, faults=app_state.faults)
    picked = app_state.body_tools.picked
    live = app_state.live
    diagnostics = live.diagnostics if live is not None else None
    contacts = show.contacts.some(~zone_visits(show.contacts.pair, show.scene))
    divergence = diagnostics.divergence if diagnostics is not None else None
    return HudStatus(
        title=show.scene.title or (app_state.path.stem if app_state.path is not None else "scene"),
        engine=show.engine,
        settings=settings_text(show.settings, not has_panel),
        step=show.step_number,
        time=show.frame.time,
        paused=app_state.paused,
        waits_for_start=app_state.waits_for_start,
        start_keys=_start_keys(show, scene_keys) if app_state.waits_for_start else "",
        question=app_state.question,
        unfocused=app_state.unfocused,
        ended=_ended(show),
        replay=live is None,
        speed=show.clock.speed,
        real_speed=show.clock.real_speed,
        frames_per_second=frame_rate,
        trust=divergence.state if divergence is not None else "unknown",
        horizon=divergence.horizon if divergence is not None else None,
        ghost=diagnostics.ghost_engine if diagnostics is not None else None,
        distance=diagnostics.ghost_distance if diagnostics is not None else None,
        missed=show.missed_contacts,
        recording=recording,
        busy=show.busy,
        picked=body_facts(show.bodies, show.frame, contacts, picked) if picked is not None else (),
        messages=messages,
        faults=app_state.faults,
        claimed=scene_keys,
    )


MAX_START_KEYS = 4
"""number of keys that a game names before its start, unless it has a line of its own"""


def _start_keys(show: LiveView | RecordedView, scene_keys: tuple[tuple[str, str], ...]) -> str:
    """Return the most important keys of a game in one line."""
    spec = spec_of(show.scene.play.game)
    if spec is not None and spec.hint:
        return spec.hint
    return " · ".join(f"{keys}: {about}" for keys, about in scene_keys[:MAX_START_KEYS])


def _ended(show: LiveView | RecordedView) -> str | None:
    """Return the reason why the run ends at the displayed time; None if it continues."""
    if isinstance(show, LiveView):
        session = show.session
        return session.ended if show.step_number == session.step_number else None
    return "end of the run" if show.frame.time >= show.end_time else None
