"""From a scene to particles, and their order: lattice, walls, cells, neighbours, ghosts."""
