"""Geometry of solids without MuJoCo: distances and boundary particles of primitives and meshes."""
