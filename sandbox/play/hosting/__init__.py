"""hosting: games with rules of their own in the window: keys, gamepads, scores, sounds."""
