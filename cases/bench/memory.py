"""Bytes per particle of a tank of still water, and what they hold."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from fsi.fluid.fluid import Fluid
from fsi.scene.model import Scene
from fsi.simulation.loop import Simulation

# Parts by the names of the fluid's attributes; what is not named here belongs to the boundary alone.
PARTS = {
    "state": {"position", "velocity", "pressure_values", "label", "kept"},
    "spare, to sort into": {"spare"},
    "packed rows": {"flow", "trial", "field", "twin"},
    "coefficients, before them orders and positions for the search": {"scratch", "orders", "xs", "coefficients"},
    "lists of the fluid": {"near"},
    "cells": {"sort"},
    "responses": {"echoes"},
}
BOUNDARY = "boundary alone, its lists included"
VARIANTS = {
    "single": {},
    "single, one sweep": {"sweeps": 1},
    "single, no viscosity": {"viscosity": "none"},
    "single, one sweep, no viscosity": {"sweeps": 1, "viscosity": "none"},
    "double": {"precision": "double"},
}


def breakdown(fluid: Fluid) -> dict[str, int]:
    """Bytes of each part; memory that stands under two names counts once."""
    sizes, seen = dict.fromkeys([*PARTS, BOUNDARY], 0), set()
    for name, value in vars(fluid).items():
        part = next((part for part, names in PARTS.items() if name.strip("_") in names), BOUNDARY)
        for array in _sized(value):
            place = array.ctypes.data if isinstance(array, np.ndarray) else id(array)
            if place not in seen:
                seen.add(place)
                sizes[part] += array.nbytes
    return sizes


def _sized(value) -> Iterator:
    """The arrays of an attribute: itself, those in a list or a dict, or an object that knows its size."""
    if isinstance(value, list | dict):
        items = value.values() if isinstance(value, dict) else value
        yield from (item for item in items if isinstance(item, np.ndarray) and item.size)
    elif isinstance(size := getattr(value, "nbytes", None), int) and size:
        yield value


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
        parts = {part: size / count for part, size in breakdown(sim.fluid).items()}
        share = sim.counts["fluid"] / count
        rows.append({"numerics": name, "fluid_share": share, "bytes_per_particle": sum(parts.values()), "parts": parts})
        sim.team.close()
    return rows
