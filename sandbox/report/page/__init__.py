"""Pages: self-contained HTML, without network: plots as inline SVG, tables, and a replay on a canvas."""

from sandbox.report.page.document import Page, Section, write_page

__all__ = ["Page", "Section", "write_page"]
