"""Account: what the window tells in words of what is on."""

from sandbox.play.facts import facts, told
from sandbox.play.running.live import Live
from sandbox.play.running.stored import Stored
from sandbox.play.sight import Status
from sandbox.play.stage import Stage
from sandbox.scene.description.scene import zone_visits


def account(stage: Stage, claimed: tuple[tuple[str, str], ...], rate: float, recording: str | None) -> Status:
    """Return what is told in words.

    Args:
        stage: what is on.
        claimed: keys that the scene claims, and what each does.
        rate: pictures a second.
        recording: what is being recorded.
    """
    show, messages = stage.show, stage.messages.shown()
    if show is None:
        return Status("No scene", "Ctrl+O", "opens a scene", 0, 0.0, messages=messages, faults=stage.faults)
    picked = stage.hands.picked
    live = stage.live
    company = live.company if live is not None else None
    touches = show.contacts.some(~zone_visits(show.contacts.pair, show.scene))
    trust = company.trust if company is not None else None
    return Status(
        title=show.scene.title or (stage.path.stem if stage.path is not None else "scene"),
        engine=show.engine,
        settings=told(show.settings),
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
        picked=facts(show.bodies, show.frame, touches, picked) if picked is not None else (),
        messages=messages,
        faults=stage.faults,
        claimed=claimed,
    )


def _ended(show: Live | Stored) -> str | None:
    """Return why nothing comes after the moment that is shown, or None."""
    if isinstance(show, Live):
        session = show.session
        return session.ended if show.step_number == session.step_number else None
    return "end of the run" if show.frame.time >= show.end else None
