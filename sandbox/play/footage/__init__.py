"""Footage: pictures and films as files, and stored runs as pictures."""
