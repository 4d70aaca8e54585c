"""Player: who plays a headless game, as a value that a run can be known by."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

from sandbox.games.bout import Bout
from sandbox.games.policies import POLICIES, Script
from sandbox.games.registry import fitting_rules
from sandbox.games.rules import Press, UnfitError
from sandbox.games.script_file import faults_of, read_script
from sandbox.recording import Recording
from sandbox.scene.errors import Fault, SceneError
from sandbox.scene.scene import Scene

RECORDED = "as recorded"
"""What the player of a session is called that is seen again."""


@dataclass(frozen=True)
class Player:
    """One of the policies, who presses what a script says, or whoever played a session."""

    name: str = "random"
    """of `POLICIES`, a script's file, or `RECORDED`"""
    presses: tuple[Press, ...] = ()
    """of a script or a session"""

    @classmethod
    def named(cls, text: str) -> Self:
        """Return the player that a text names: one of `POLICIES`, or else the file of a script.

        Raises:
            SceneError: there is none, or the script cannot be read, or has faults.
        """
        if text in POLICIES:
            return cls(text)
        try:
            reason = "" if Path(text).exists() else "No such file"
        except (OSError, ValueError) as error:  # such as a name longer than any file's
            reason = (error.strerror if isinstance(error, OSError) else None) or str(error)
        if reason:
            message = f"cannot be read: {reason}; a player is {', '.join(POLICIES)} or a script file"
            raise SceneError([Fault(text, None, "", message)])
        return cls(text, read_script(text))

    @classmethod
    def of(cls, session: Recording) -> Self:
        """Return who played a session: what was done is known, and the rules look on."""
        return cls(RECORDED, session.presses)

    def bout(self, scene: Scene, file: str = "<scene>") -> Bout | None:
        """Begin the game of a scene; none where it has no game with rules.

        Args:
            scene: as it is run.
            file: what faults call it.

        Raises:
            SceneError: the scene lacks what its game needs, or the game what the script presses.
        """
        rules = fitting_rules(scene, file)
        if rules is None:
            return None
        if self.name == RECORDED:
            return Bout(rules, None, RECORDED, self.presses)
        if self.name in POLICIES:
            try:
                return Bout(rules, POLICIES[self.name](scene), self.name)
            except UnfitError as error:
                raise SceneError([Fault("--player", None, "", str(error))]) from None
        faults = faults_of(self.presses, rules.controls, self.name)
        if faults:
            raise SceneError(faults)
        return Bout(rules, Script(self.presses), self.name)

    def document(self, scene: Scene) -> dict[str, Any]:
        """Return what of the player decides how a game goes, as JSON values."""
        name = self.name if self.name in (*POLICIES, RECORDED) else "script"
        return {"game": scene.play.game, "player": name, "presses": [list(press) for press in self.presses]}
