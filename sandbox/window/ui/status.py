"""Facts: what is told in words of a body and of settings.

Account: what the window tells in words of what is on.
"""

import math

from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.description.bodies import Box, Capsule
from sandbox.scene.description.generators import Stack
from sandbox.scene.description.scene import zone_visits
from sandbox.scene.description.world import Settings
from sandbox.trajectory import Contacts, Frame
from sandbox.window.app_state import AppState
from sandbox.window.format import format_si
from sandbox.window.playback.live import LiveView
from sandbox.window.playback.recorded import RecordedView
from sandbox.window.playback.snapshot import HudStatus


def body_facts(bodies: Bodies, frame: Frame, contacts: Contacts, number: int) -> tuple[str, ...]:
    """Return lines about a body: its name, then its figures."""
    if number >= len(frame.position):
        return ()
    (x, y), (vx, vy) = frame.position[number].tolist(), frame.velocity[number].tolist()
    spin, angle = float(frame.angular_velocity[number]), float(frame.angle[number])
    mass, moment = float(bodies.mass[number]), float(bodies.moment[number])
    lines = [bodies.names[number]]
    if not frame.present[number]:
        return (*lines, "removed")
    if bodies.fixed[number]:
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
    lines.insert(1, f"x {format_si(x, 'm')}, {format_si(y, 'm')}")
    lines.append(f"m {format_si(mass, 'kg')}, {_size(bodies, number)}")
    if not (bodies.fixed[number] or bodies.round[number]):  # of a disc it is ½ m r²
        lines.append(f"I {format_si(moment, 'kg·m²')}")
    if angle:
        lines.append(f"angle {format_si(angle, 'rad')}")
    touching = int((contacts.pair == number).any(axis=1).sum()) if len(contacts) else 0
    if touching:
        lines.append(f"{touching} contact{'s' if touching > 1 else ''}")
    return tuple(lines)


def _size(bodies: Bodies, number: int) -> str:
    """Return in words how large a body is, by what its kind is known by."""
    element = bodies.elements[int(bodies.element[number])]
    if isinstance(element, Box | Stack):
        return f"{format_si(element.size[0], 'm')} × {format_si(element.size[1], 'm')}"
    if isinstance(element, Capsule):
        return f"l {format_si(element.length, 'm')}, r {format_si(element.radius, 'm')}"
    word = "r" if bodies.round[number] else "reach"
    return f"{word} {format_si(float(bodies.radius[number]), 'm')}"


def settings_text(settings: Settings) -> str:
    """Return settings in a few words; what an engine has no choice of is left out."""
    words = [f"dt {format_si(settings.dt, 's')}"]
    if settings.integrator is not None:
        words.append(f"{settings.substeps} × {settings.iterations}")
        words.append(settings.integrator.replace("_", " "))
        if settings.detection not in (None, "discrete"):
            words.append(str(settings.detection))
        if settings.response not in (None, "impulse"):
            words.append(str(settings.response))
    return " · ".join(words)


def hud_status(stage: AppState, claimed: tuple[tuple[str, str], ...], rate: float, recording: str | None) -> HudStatus:
    """Return what is told in words.

    Args:
        stage: what is on.
        claimed: keys that the scene claims, and what each does.
        rate: pictures a second.
        recording: what is being recorded.
    """
    show, messages = stage.show, stage.messages.shown()
    if show is None:
        return HudStatus("No scene", "Ctrl+O", "opens a scene", 0, 0.0, messages=messages, faults=stage.faults)
    picked = stage.hands.picked
    live = stage.live
    company = live.company if live is not None else None
    touches = show.contacts.some(~zone_visits(show.contacts.pair, show.scene))
    trust = company.trust if company is not None else None
    return HudStatus(
        title=show.scene.title or (stage.path.stem if stage.path is not None else "scene"),
        engine=show.engine,
        settings=settings_text(show.settings),
        step=show.step_number,
        time=show.frame.time,
        paused=stage.paused,
        waits_for_start=stage.waits_for_start,
        question=stage.question,
        unfocused=stage.unfocused,
        ended=_ended(show),
        replay=live is None,
        speed=show.pace.speed,
        real_speed=show.pace.real_speed,
        frames_per_second=rate,
        trust=trust.state if trust is not None else "unknown",
        horizon=trust.horizon if trust is not None else None,
        ghost=company.ghost_engine if company is not None else None,
        distance=company.distance if company is not None else None,
        missed=show.missed,
        recording=recording,
        busy=show.busy,
        picked=body_facts(show.bodies, show.frame, touches, picked) if picked is not None else (),
        messages=messages,
        faults=stage.faults,
        claimed=claimed,
    )


def _ended(show: LiveView | RecordedView) -> str | None:
    """Return why nothing comes after the moment that is shown, or None."""
    if isinstance(show, LiveView):
        session = show.session
        return session.ended if show.step_number == session.step_number else None
    return "end of the run" if show.frame.time >= show.end else None
