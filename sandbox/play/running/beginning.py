"""Beginning: a scene becomes a session that is watched, on the engine that is wished for or one that can."""

from sandbox.engines.contract import Refusal
from sandbox.engines.registry import able
from sandbox.games.referee import Referee
from sandbox.games.registry import rules_of
from sandbox.play.billiards.seats import laid
from sandbox.play.hosting.host import refereed
from sandbox.play.messages import Messages
from sandbox.play.running.live import Live
from sandbox.play.running.session import Session
from sandbox.recording import Recording
from sandbox.scene.description.world import Settings
from sandbox.scene.scene import Scene


def played_again(recording: Recording) -> Live:
    """Return a session that has done again all that was done in another, and goes on from there."""
    rules = rules_of(recording.scene)
    game = None if rules is None else Referee(rules, recording.presses)
    session = Session(
        recording.scene, recording.engine, recording.settings, recording.actions, game, recording.duration
    )
    session.note_unsaved()
    live = Live(session)
    live.seek(round(recording.duration / session.settings.dt))
    return live


def begun(scene: Scene, engine: str, settings: Settings | None, messages: Messages) -> Live | None:
    """Begin a session of a scene, with its game where it has one; None where no engine can, which is told.

    Args:
        scene: as its file has it.
        engine: the wish; where it cannot, one that can takes its place, and that is told.
        settings: by default the scene's own.
        messages: told of what is not as wished.
    """
    scene = laid(scene)
    game = refereed(scene, messages)
    try:
        return Live(Session(scene, engine, settings, game=game))
    except Refusal as refusal:
        others = able(scene)
        if not others:
            messages.tell(str(refusal), "error")
            return None
        messages.tell(f"{refusal}; opened with {others[0]}", "warning")
        return Live(Session(scene, others[0], game=game))
