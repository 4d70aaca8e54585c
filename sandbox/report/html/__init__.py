"""Self-contained HTML pages that need no network: inline charts, tables, and a replay on a canvas."""

from sandbox.report.html.page import Page, Section, write_page

__all__ = ["Page", "Section", "write_page"]
