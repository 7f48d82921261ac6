"""The mass of fluid that moves with a body: a cylinder in an annulus and a sphere in a spherical shell, without gravity.

Exact, for an inviscid fluid between concentric walls of radii a and b (Lamb 1932, Hydrodynamics, art. 68 and 93): per
length rho pi a^2 (b^2 + a^2) / (b^2 - a^2), and for the sphere 2/3 rho pi a^3 (b^3 + 2 a^3) / (b^3 - a^3), half of what it
displaces where b is infinite. Cylinder and sphere are let go from rest under a constant force, carried by the coupler; the
acceleration is that between a third and the end of a path of a spacing. Until then sound has gone round the body several
times: it runs 3.7 spacings a step (`fsi.fluid.chebyshev`), so that there are `STEPS` for each spacing in the radius; with 60
at 20 spacings, in which it goes round once, the mass came out 6 % low. A path of two spacings takes the cylinder a third of
its way to the wall at 6 spacings, and the mass rises by 8 %. The cylinder is moved to and fro as well, by less than a
spacing; the inertial part of its force is found by least squares.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from cases.validation.coupling import models
from cases.validation.engine.case import Case, Measure
from fsi.extras import require

DENSITY = 1000.0
CYLINDER, OUTER = 0.1, 0.2  # a, b [m]
OMEGA, SWAY = 2 * math.pi, 0.004  # 1/s, m
BALL, SHELL, RATIO = 0.1, 0.3, 0.5  # a, b [m], density ratio
STEPS, PATH = 12, 1.0  # steps for each spacing in the radius, spacings


def annulus_mass(a: float, b: float) -> float:
    """Added mass per length of a cylinder in a concentric cylinder [kg/m]."""
    return DENSITY * math.pi * a**2 * (b**2 + a**2) / (b**2 - a**2)


def shell_mass(a: float, b: float) -> float:
    """Added mass of a sphere in a concentric sphere [kg]."""
    return 2 / 3 * DENSITY * math.pi * a**3 * (b**3 + 2 * a**3) / (b**3 - a**3)


def hollow(folder: Path, radius: float, dimension: int) -> str:
    """Write a block of ground with a round hole about the origin: a cylinder's along y, or a sphere's."""
    trimesh = require("trimesh", "bodies", "a hollow")
    if dimension == 2:
        block = trimesh.creation.annulus(r_min=radius, r_max=3 * radius, height=2.0, sections=360)
        block.apply_transform(trimesh.transformations.rotation_matrix(math.pi / 2, (1, 0, 0)))
    else:
        inside = trimesh.creation.icosphere(subdivisions=4, radius=radius)
        inside.apply_scale((4 / 3 * math.pi * radius**3 / inside.volume) ** (1 / 3))
        inside.invert()
        block = trimesh.util.concatenate([trimesh.creation.box(extents=[4 * radius] * 3), inside])
    file = Path(folder, "hollow.stl")
    block.export(file)
    return str(file)


def _still_fluid(radius: float, spacing: float, dimension: int, folder: Path) -> dict:
    """The parts of a scene that both cases share: a round space filled with fluid, no gravity, no viscosity."""
    far = math.ceil(radius / spacing + 5) * spacing
    return {
        "dimension": dimension,
        "gravity": 0.0,
        "tank": {
            "min": [-far] * dimension,
            "max": [far] * dimension,
            "walls": ["x-", "x+", "y-", "y+", "z-", "z+"],
            "bathymetry": hollow(folder, radius, dimension),
        },
        "fluid": {"still_water_level": far},
    }


def annulus_scene(spacing: float, folder) -> dict:
    inner = models.body("inner", (0, 0, 0), models.HEAVE.replace("0 0 1", "1 0 0"), "cylinder", (CYLINDER, 0.5), 1000,
                        along_y=True)  # fmt: skip
    return _still_fluid(OUTER, spacing, 2, folder) | {
        "duration": 4.0,
        "bodies": models.write(folder, [inner], gravity=0.0),
        "coupler": {"scheme": "prescribed", "motion": {"inner": {"amplitude": SWAY, "omega": OMEGA, "ramp": 1.0}}},
        "numerics": {"viscosity": "none", "artificial_viscosity": 0.0, "max_time_step": 0.3 * spacing},
    }


def released_scene(dimension: int):
    """A cylinder or a sphere under a constant force, that of a soft spring with its rest far away."""

    def scene(spacing: float, folder) -> dict:
        step, steps = 0.2 * spacing, round(STEPS * (CYLINDER if dimension == 2 else BALL) / spacing)
        mass = RATIO * DENSITY * (math.pi * CYLINDER**2 if dimension == 2 else 4 / 3 * math.pi * BALL**3)
        pull = (mass + exact_mass(dimension)) * 2 * PATH * spacing / (steps * step) ** 2
        spring = f'<joint name="round" type="slide" axis="1 0 0" stiffness="1e-3" springref="{1e3 * pull:.9g}"/>'
        shape, size = ("cylinder", (CYLINDER, 0.5)) if dimension == 2 else ("sphere", (BALL,))
        text = models.body("round", (0, 0, 0), spring, shape, size, RATIO * DENSITY, along_y=dimension == 2)
        return _still_fluid(OUTER if dimension == 2 else SHELL, spacing, dimension, folder) | {
            "duration": steps * step,
            "bodies": models.write(folder, [text], gravity=0.0),
            "numerics": {
                "viscosity": "none",
                "artificial_viscosity": 0.0,
                "density_relaxation": 0.0,
                "fixed_time_step": step,
            },
        }

    return scene


def exact_mass(dimension: int) -> float:
    """Added mass of the released body [kg], per length in two dimensions [kg/m]."""
    return annulus_mass(CYLINDER, OUTER) if dimension == 2 else shell_mass(BALL, SHELL)


class Inertia(Measure):
    """Inertial part of the force on the forced cylinder after the ramp and a period."""

    def begin(self, sim) -> None:
        self.time, self.force = [], []

    def sample(self, sim) -> None:
        self.time.append(sim.time - 0.5 * sim.dt)
        self.force.append(models.force(sim)[0, 0])

    def errors(self) -> dict[str, float]:
        t, force = np.array(self.time), np.array(self.force)
        t, force = t[t > 2.0], force[t > 2.0]
        basis = np.stack([np.ones_like(t), np.sin(OMEGA * t), np.cos(OMEGA * t)], 1)
        _, inertial, resisting = np.linalg.lstsq(basis, force, rcond=None)[0]
        peak = annulus_mass(CYLINDER, OUTER) * SWAY * OMEGA**2
        return {"added_mass": inertial / peak - 1, "damping": -resisting / peak}


class Acceleration(Measure):
    """Acceleration of the released body under its constant force."""

    def begin(self, sim) -> None:
        self.time, self.speed = [], []
        self.exact = exact_mass(sim.scene.dimension)
        self.inertia = sim.bodies.inertia()[0, 0]

    def sample(self, sim) -> None:
        joints = sim.bodies.joints()
        self.pull = joints["joint_force"][0]
        self.time.append(sim.time)
        self.speed.append(joints["joint_velocity"][0])

    def errors(self) -> dict[str, float]:
        t, u = np.array(self.time), np.array(self.speed)
        late = t > t[-1] / 3
        acceleration = np.polyfit(t[late], u[late], 1)[0]
        return {"added_mass": (self.pull / acceleration - self.inertia) / self.exact - 1}


NAMES = ("added_mass_annulus", "added_mass_shaken", "added_mass_sphere")
CASES = {
    "added_mass_annulus": Case(
        "added_mass_annulus",
        "A cylinder of half the fluid's density is accelerated from rest in a cylinder of twice its radius a, 2D",
        "Exact: Lamb (1932), art. 68. a is 6, 10 and 20 spacings.",
        {"coarse": CYLINDER / 6, "medium": CYLINDER / 10, "paper": CYLINDER / 20},
        released_scene(2), Acceleration, {"added_mass": 0.05},
    ),
    "added_mass_shaken": Case(
        "added_mass_shaken",
        "The same cylinder is moved to and fro for four periods by less than a spacing, 2D",
        "Exact: Lamb (1932), art. 68. a is 10, 14 and 20 spacings.",
        {"coarse": CYLINDER / 10, "medium": CYLINDER / 14, "paper": CYLINDER / 20},
        annulus_scene, Inertia, {"added_mass": 0.05, "damping": 0.05},
    ),
    "added_mass_sphere": Case(
        "added_mass_sphere",
        "A sphere of half the fluid's density is accelerated from rest in a spherical shell of 3 times its radius a, 3D",
        "Exact: Lamb (1932), art. 93; 1.115 times half the displaced mass. a is 6, 10 and 15 spacings.",
        {"coarse": BALL / 6, "medium": BALL / 10, "paper": BALL / 15},
        released_scene(3), Acceleration, {"added_mass": 0.05},
        reasons="The radius is 6 spacings at the coarse level, and the mass 5.2 % low; at 10 it is 2.1 %.",
    ),
}  # fmt: skip
