"""Pinball: rules as small machines that read switches and answer with points, sounds and actions."""
