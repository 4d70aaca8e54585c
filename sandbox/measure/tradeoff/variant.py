"""Variant: one engine with one choice of settings, and the variants that are one choice away."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import cached_property
from itertools import chain
from typing import Any, get_args

from pydantic import ValidationError

from sandbox.engines.registry import ENGINES
from sandbox.measure.compare.refined import preferences
from sandbox.scene.compile.contacts import contact_matrix
from sandbox.scene.description.base import MAX_STEPS
from sandbox.scene.description.world import Detection, Integrator, Joints, Response, Settings
from sandbox.scene.scene import Scene

MOST_SUBSTEPS, MOST_ITERATIONS = 512, 1000
FEWEST_STEPS = 4
"""A run of fewer says nothing, and is tried only where the scene has no more itself."""
COARSE = 2.0
"""Frames of a game that a step may last, unless the scene's own lasts longer: just to see what that does."""
FINEST, COARSEST = Fraction(256), Fraction(1, 16)
"""How many frames are made of one of the scene's own."""

WORDS: dict[str, tuple[Any, ...]] = {
    "integrator": get_args(Integrator),
    "detection": get_args(Detection),
    "joints": get_args(Joints),
    "response": get_args(Response),
    "half_kick": (False, True),
}
"""The choices between ways of doing things. Broad phases are none: all give the same answer."""


@dataclass(frozen=True)
class Variant:
    """Settings as they differ from a scene's own."""

    engine: str
    finer: Fraction = Fraction(1)
    """steps in one of the scene's"""
    substeps: int = 1
    iterations: int = 10
    words: tuple[tuple[str, Any], ...] = ()

    @classmethod
    def of(cls, engine: str, settings: Settings) -> "Variant":
        """Return the settings themselves."""
        return cls(engine, Fraction(1), settings.substeps, settings.iterations)

    @property
    def work(self) -> float:
        """About what a run costs beside others of the same words: substeps, of more iterations a little more."""
        return float(self.finer) * self.substeps * (1.0 + self.iterations / 20.0)

    def settings(self, base: Settings) -> Settings:
        """Return the settings in full; frames are kept at times at which the base keeps them too, if not at all these.

        Raises:
            pydantic.ValidationError: dt leaves its bounds.
        """
        every = Fraction(base.record_every) * self.finer
        return base.replace(
            dt=float(Fraction(base.dt) / self.finer),
            record_every=every.numerator,
            substeps=self.substeps,
            iterations=self.iterations,
            **dict(self.words),
        )

    def with_word(self, key: str, value: Any) -> "Variant":
        """Return the variant with another way of doing one thing."""
        return replace(self, words=tuple(sorted([*self.without_word(key).words, (key, value)])))

    def with_words(self, words: Mapping[str, Any]) -> "Variant":
        """Return the variant with other ways of doing several things."""
        variant = self
        for key, value in words.items():
            variant = variant.with_word(key, value)
        return variant

    def without_word(self, key: str) -> "Variant":
        """Return the variant with one thing done as the scene has it, or as the engine likes it."""
        return replace(self, words=tuple((k, v) for k, v in self.words if k != key))


@dataclass(frozen=True, eq=False)
class Space:
    """All variants that a scene can be run with."""

    scene: Scene
    base: Settings
    engines: tuple[str, ...]
    frame: float = 1.0 / 60.0
    """s that a game shows a picture: `exact` is not asked for fewer, nor the others for less than half as many"""
    _sound: dict[Variant, bool] = field(default_factory=dict, init=False, repr=False)
    _filled: dict[Variant, Settings] = field(default_factory=dict, init=False, repr=False)

    def starts(self) -> list[Variant]:
        """Return each engine with the scene's own settings; what only some engines take is left out for the others."""
        return [Variant.of(name, self.own(name)) for name in self.engines]

    def suited(self) -> list[Variant]:
        """Return the ways together that are known to suit such a scene, which one at a time would not show."""
        ways = (start.with_words(words) for start in self.starts() for words in preferences(self.scene))
        found = dict.fromkeys(self.plain(way) for way in ways if self.sound(way))
        return [way for way in found if way.words]

    def own(self, engine: str) -> Settings:
        """Return the settings that an engine's variants differ from: the scene's, or of these what all engines take."""
        return self._own[engine]

    @cached_property
    def _own(self) -> dict[str, Settings]:
        kept = {name: not ENGINES[name].missing(self.scene, self.base) for name in self.engines}
        return {name: self.base if whole else self.base.common() for name, whole in kept.items()}

    def settings(self, variant: Variant) -> Settings:
        """Return a variant's settings in full, choices that are left to the engine still open."""
        return variant.settings(self.own(variant.engine))

    def sound(self, variant: Variant) -> bool:
        """Tell whether a variant can be run at all."""
        if variant not in self._sound:
            self._sound[variant] = self._can_run(variant)
        return self._sound[variant]

    def _can_run(self, variant: Variant) -> bool:
        if not (COARSEST <= variant.finer <= FINEST and 1 <= variant.substeps <= MOST_SUBSTEPS):
            return False
        if not 1 <= variant.iterations <= MOST_ITERATIONS:
            return False
        try:
            settings = self.settings(variant)
        except ValidationError:
            return False
        longest = self.frame if variant.engine == "exact" else COARSE * self.frame
        if variant.finer < 1 and settings.dt > longest:
            return False
        steps = self.scene.world.duration / settings.dt
        if (variant.finer < 1 and steps < FEWEST_STEPS) or steps > MAX_STEPS / variant.substeps:
            return False
        return not ENGINES[variant.engine].missing(self.scene, settings)

    def filled(self, variant: Variant) -> Settings:
        """Return a variant's settings as the engine fills them in."""
        if variant not in self._filled:
            self._filled[variant] = ENGINES[variant.engine].resolve(self.scene, self.settings(variant))
        return self._filled[variant]

    def plain(self, variant: Variant) -> Variant:
        """Return a variant without the words that say what is done anyway, so that none goes by two names."""
        filled = self.filled(variant)
        for key, _ in variant.words:
            less = variant.without_word(key)
            if self.filled(less) == filled:
                variant = less
        return variant

    def near(self, variant: Variant) -> list[Variant]:
        """Return the sound variants that are one choice away, each choice up and down."""
        if variant.engine == "exact":  # for whom dt is but the time between two frames
            others: Iterator[Variant] = iter([replace(variant, finer=variant.finer / 2)])
        else:
            others = chain(self._steps(variant), self._ways(variant))
        found = dict.fromkeys(self.plain(other) for other in others if self.sound(other))
        return [other for other in found if other != variant]

    def _steps(self, variant: Variant) -> Iterator[Variant]:
        own = self.own(variant.engine)
        if variant.substeps == own.substeps:  # more substeps do the same for less
            yield replace(variant, finer=variant.finer / 2)
            if variant.finer < 4:
                yield replace(variant, finer=variant.finer * 2)
        if variant.finer <= 1:
            yield replace(variant, substeps=variant.substeps * 2)
            if variant.substeps % 2 == 0:
                yield replace(variant, substeps=variant.substeps // 2)
        if variant.finer <= 1:  # as fine, but with half the frames, and back
            yield replace(variant, finer=variant.finer / 2, substeps=variant.substeps * 2)
        if variant.finer < 1 and variant.substeps % 2 == 0:
            yield replace(variant, finer=variant.finer * 2, substeps=variant.substeps // 2)
        if self.iterates:
            yield replace(variant, iterations=variant.iterations * 2)
            if variant.iterations > 1:
                yield replace(variant, iterations=variant.iterations // 2)

    def _ways(self, variant: Variant) -> Iterator[Variant]:
        filled = self.filled(variant)
        for key, values in WORDS.items():
            if key == "joints" and not len(self.scene.links):
                continue
            if key in ("detection", "response") and not self.touches:
                continue
            if key == "half_kick" and self.scene.world.gravity == (0.0, 0.0):
                continue
            for value in values:
                if value != getattr(filled, key):
                    yield variant.with_word(key, value)

    @cached_property
    def touches(self) -> bool:
        """Whether anything can meet anything."""
        return bool(contact_matrix(self.scene).touches.any())

    @cached_property
    def iterates(self) -> bool:
        """Whether more passes of the solver can change anything: where contacts or joints hang together."""
        meet = contact_matrix(self.scene)
        return bool(len(self.scene.links)) or (
            self.touches and (meet.mutual or len(self.scene.fixed) > 1 or meet.solids)
        )
