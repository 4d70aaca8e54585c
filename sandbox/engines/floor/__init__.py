"""floor: the physics of spheres on a surface, for every engine that models it."""
