"""Editing of scene files: elements, transformations, fields, and drafts with undo."""
