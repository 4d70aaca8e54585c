"""rolling: event-driven spheres on a floor, which slide, roll and spin in closed form between events."""
