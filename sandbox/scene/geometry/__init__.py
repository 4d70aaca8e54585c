"""Geometry of scenes: polygons, convex pieces, polylines and neighbours."""
