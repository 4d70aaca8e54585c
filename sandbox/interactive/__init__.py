"""Live scenes in a browser or a notebook: a running simulation that JSON messages control, and its front end."""
