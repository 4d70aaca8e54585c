"""Switching: going on with another engine, which may not know all that was chosen for the present one."""

from sandbox.action import ActionError, Switch, Value
from sandbox.play.running.session import Session
from sandbox.scene.description.world import COMMON


def switch(session: Session, engine: str) -> str | None:
    """Go on with another engine from the state as it is.

    Choices that only the present engine knows are left to the other.

    Returns:
        Which those were, in words.

    Raises:
        ActionError: the other engine cannot go on from here.
    """
    try:
        session.act(Switch(time=0.0, engine=engine))
    except ActionError as error:
        own = [key for key in session.wanted.model_dump(exclude_defaults=True) if key not in COMMON]
        if not own:
            raise
        free: dict[str, Value] = {key: False if key == "half_kick" else None for key in own}
        try:
            session.act(Switch(time=0.0, engine=engine, settings=free))
        except ActionError:
            raise error from None
        return f"chosen by {engine}: {', '.join(own)}"
    return None
