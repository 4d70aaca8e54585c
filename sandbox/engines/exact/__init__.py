"""exact: the event-driven engine. Motion between events is in closed form; next events are roots of polynomials."""
