"""Instruments: what surrounds the picture: figures, graph, panel, timeline, help, and the picker of scenes."""
