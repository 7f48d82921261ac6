"""Small fluids for the tests, and plain reference sums over all pairs."""

import numpy as np

from fsi.compute.team import Team
from fsi.fluid.fluid import Fluid
from fsi.particles.layout import Layout
from fsi.scene.model import Scene
from fsi.sph import kernel


def still_tank(dimension=2, spacing=0.02, depth=0.5, length=1.0, **parts) -> Scene:
    across = [0.0] * (dimension - 1)
    tank = {"min": [*across, -depth], "max": [*[length] * (dimension - 1), 8 * spacing]}
    return Scene.model_validate({"dimension": dimension, "spacing": spacing, "duration": 5.0, "tank": tank} | parts)


def random_fluid(
    dimension,
    precision="double",
    count=12,
    boundary=False,
    threads=1,
    seed=3,
    gravity=0.0,
    field=None,
    liquid=None,
    **numerics,
) -> Fluid:
    """A jittered block with random velocities and pressures after `begin` and `predict`; with `boundary`, the half
    with x > 0 belongs to an owner of its own, the wavemaker."""
    spacing = 0.1
    rng = np.random.default_rng(seed)
    grid = np.stack(np.meshgrid(*[np.arange(count)] * dimension, indexing="ij"), -1).reshape(-1, dimension)
    points = (grid + 0.5 - count / 2 + rng.uniform(-0.2, 0.2, grid.shape)) * spacing
    wet = points[:, 0] <= 0 if boundary else np.ones(len(points), bool)
    solid = points[~wet]
    scene = Scene.model_validate(
        {
            "dimension": dimension,
            "spacing": spacing,
            "duration": 1.0,
            "gravity": gravity,
            "tank": {"min": [-2.0] * dimension, "max": [2.0] * dimension, "walls": []},
            "fluid": {"acceleration_gradient": field} | (liquid or {"kinematic_viscosity": 0.1}),
            "numerics": {"precision": precision, "mach": 1.0, "density_relaxation": 1e-3} | numerics,
        }
    )
    layout = Layout(
        points[wet], rng.normal(size=(wet.sum(), dimension)), rng.normal(size=wet.sum()) * 1e3, solid,
        np.ones(len(solid), np.int32), np.array(scene.tank.min), np.array(scene.tank.max), 1.0, scene.spacing**dimension, (),
    )  # fmt: skip
    fluid = Fluid(scene, layout, Team(threads))
    fluid.boundary_velocity[:] = rng.normal(size=solid.shape)
    fluid.begin(1e-3, np.zeros((fluid.owners, 3)), np.zeros((fluid.owners, 6)))
    return fluid


def pairs(fluid):
    """x_ij (n, n + b, dim), r2, F and W of every fluid particle with every fluid and boundary particle, in float64."""
    b = fluid.solids.count
    everything = np.concatenate([fluid.position, fluid.solids.position[:b]])
    x = fluid.position[:, None] - everything[None]
    r2 = (x**2).sum(-1)
    h, dim = fluid.scene.smoothing_length, fluid.dim
    return x, r2, kernel.gradient_factor(np.sqrt(r2), h, dim), kernel.value(np.sqrt(r2), h, dim)
