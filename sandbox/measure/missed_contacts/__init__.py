"""Audit of a run: contacts that an engine missed, found by sweeping each substep against exact geometry."""

from sandbox.measure.missed_contacts.detector import Audit

__all__ = ["Audit"]
