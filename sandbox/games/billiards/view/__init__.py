"""Billiards in the window: table, balls, aim, cue controls, scoreboard, the bot as a player."""
