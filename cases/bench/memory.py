"""Bytes per particle of a tank of still water, and what they hold."""

from __future__ import annotations

from fsi.scene.model import Scene
from fsi.simulation.loop import Simulation

VARIANTS = {
    "single": {},
    "single, one sweep": {"sweeps": 1},
    "single, no viscosity": {"viscosity": "none"},
    "single, one sweep, no viscosity": {"sweeps": 1, "viscosity": "none"},
    "double": {"precision": "double"},
}


def tank(dimension: int, particles: int, numerics: dict) -> Scene:
    """A cube of still water of about so many fluid particles, walled on its sides and its bottom."""
    spacing = 1 / round(particles ** (1 / dimension))
    low, high = (0.0,) * (dimension - 1), (1.0,) * (dimension - 1)
    return Scene.model_validate(
        {
            "dimension": dimension,
            "spacing": spacing,
            "duration": 1.0,
            "tank": {"min": (*low, -1.0), "max": (*high, 4 * spacing)},
            "numerics": {"smoothing_ratio": 1.5, "artificial_viscosity": 0.0} | numerics,
        }
    )


def memory(dimension: int, particles: int) -> list[dict]:
    """One row a variant of the numerics: bytes per particle, boundary included, of each part after one step."""
    rows = []
    for name, numerics in VARIANTS.items():
        sim = Simulation(tank(dimension, particles, numerics), threads=1)
        sim.step()
        count = sum(sim.counts.values())
        parts = {part: size / count for part, size in sim.fluid.memory.items()}
        share = sim.counts["fluid"] / count
        found = {"numerics": name, "lanes": sim.fluid.lanes, "fluid_share": share}
        rows.append(found | {"bytes_per_particle": sum(parts.values()), "parts": parts})
        sim.team.close()
    return rows
