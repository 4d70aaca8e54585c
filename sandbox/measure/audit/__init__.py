"""The audit: contacts that an engine never saw, found by sweeping each substep against exact geometry."""

from sandbox.measure.audit.missed import Audit

__all__ = ["Audit"]
