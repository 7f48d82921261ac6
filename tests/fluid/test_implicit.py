"""Implicit ISPH: kernel, walls by weights, tolerance, momentum, response to accelerations, what it refuses."""

from dataclasses import replace

import numpy as np
import pytest

from fsi.compute.team import Team
from fsi.errors import SceneError
from fsi.fluid.choice import make_fluid
from fsi.fluid.implicit import scalars
from fsi.fluid.weighted_walls import weights
from fsi.owners import PISTON
from fsi.particles.layout import build
from fsi.scene.check import check_scene
from fsi.scene.model import Scene
from fsi.sph.shapes import filling, plain, shape

DR = 0.05


def tank(*, walls=("x-", "x+", "z-"), waves=None, **numerics) -> Scene:
    values = {
        "spacing": DR,
        "duration": 1.0,
        "tank": {"min": [0, -0.4], "max": [1.2, 0.4], "walls": walls},
        "numerics": {"solver": "iisph"} | numerics,
    }
    return Scene.model_validate(values | ({"waves": waves} if waves else {}))


def stepped(fluid, dt: float, acceleration=None):
    """The fluid after all of a step but the corrector; wrench (owners, 6)."""
    still = np.zeros((fluid.owners, 6))
    fluid.begin(dt, np.zeros((fluid.owners, 3)), still)
    fluid.predict()
    return fluid.pressure(still if acceleration is None else acceleration)


@pytest.mark.parametrize("name", ["wendland", "cubic_spline"])
@pytest.mark.parametrize("dim", [2, 3])
def test_kernels_are_one_over_all_space_and_slopes_are_theirs(name, dim):
    form, r = shape(name, 0.5, dim), np.linspace(1e-4, 1.0, 20001)
    value, slope = plain(name, 1 - r)
    volume = 2 * np.pi * r if dim == 2 else 4 * np.pi * r**2
    assert np.trapezoid(form.alpha * value * volume, r) == pytest.approx(1, rel=1e-3)
    assert np.gradient(form.alpha * value, r)[1:-1] == pytest.approx(
        -form.factor * slope[1:-1] * r[1:-1], abs=2e-3 * form.alpha
    )


def test_a_layer_that_is_sampled_twice_as_densely_weighs_the_same():
    scene = tank(walls=("z-",))
    layout = build(scene)
    k = scalars(scene, layout, np.float32)
    once = weights(scene, layout, k, np.float32, Team(1))
    doubled = np.repeat(layout.boundary, 2, axis=0)
    doubled[1::2, 0] += 0.5 * DR
    denser = replace(layout, boundary=doubled, owner=np.repeat(layout.owner, 2))
    twice = weights(scene, denser, k, np.float32, Team(1))
    middle = len(once) // 2
    assert once[middle] == pytest.approx(filling("cubic_spline", DR, DR, 2).wall, rel=1e-6)
    assert twice[2 * middle] == pytest.approx(0.5 * once[middle], rel=0.1)


@pytest.mark.parametrize("share", [0.1, 1.0])
def test_still_water_stays_within_the_tolerance_and_keeps_momentum(share):
    scene = tank(density_relaxation=share)
    fluid = make_fluid(scene, build(scene), Team(1))
    dt, heads = 0.005, []
    for step in range(60):
        stepped(fluid, dt)
        before = float(fluid.k.mass) * fluid.velocity.sum(0)  # predicted, gravity included
        wrench = fluid.wrench(viscous=True, walls=True)[:, :3].sum(0)
        _, guarded = fluid.correct()
        after = float(fluid.k.mass) * fluid.velocity.sum(0)
        pushed = -dt * wrench[[0, 2]] - guarded[:, :3].sum(0)[[0, 2]]
        assert after - before == pytest.approx(pushed, abs=2e-5 * dt * 9810 * 0.48)
        assert fluid.solver.error < scene.numerics.density_tolerance and fluid.solver.sweeps >= 6 * (step + 1)
        heads.append(fluid.pressure_values.mean())
    assert fluid.lost == 0 and np.abs(fluid.velocity).max() < 0.2
    assert np.mean(heads[20:]) == pytest.approx(9810 * 0.2, rel=0.15)


def test_the_forces_of_all_pairs_of_fluid_cancel_without_walls():
    """Gravity alone moves a block that falls; its pressures, of random motion, change no momentum."""
    values = {"spacing": DR, "duration": 1.0, "tank": {"min": [-2, -2], "max": [2, 2]}, "numerics": {"solver": "iisph"}}
    scene = Scene.model_validate(values | {"fluid": {"blocks": [{"min": [-0.4, 0.0], "max": [0.4, 0.8]}]}})
    fluid = make_fluid(scene, build(scene), Team(1))
    fluid.velocity[:] = np.random.default_rng(1).normal(0.0, 0.5, fluid.velocity.shape)
    before = fluid.velocity.sum(0)
    for _ in range(5):
        stepped(fluid, 0.004)
        assert fluid.work.field[: fluid.count, 2].max() > 0
        fluid.correct()
    change = fluid.velocity.sum(0) - before - fluid.count * 5 * 0.004 * np.array([0.0, -9.81])
    assert change == pytest.approx([0.0, 0.0], abs=1e-6 * np.abs(fluid.velocity).sum())


def test_a_lattice_at_rest_on_a_layer_needs_the_hydrostatic_pressure():
    """The pressure of water released at rest, row by row, a spacing and more above the floor and under the surface."""
    scene = tank()
    fluid = make_fluid(scene, build(scene), Team(1))
    still = np.zeros((fluid.owners, 6))
    fluid.begin(0.005, np.zeros((fluid.owners, 3)), still)
    fluid.settle(still)
    middle = np.abs(fluid.position[:, 0] - 0.6) < 0.2
    z = fluid.position[middle, 1]
    error = fluid.pressure_values[middle] + 9810 * z
    assert np.abs(error[z < -2 * DR]).max() < 0.08 * 9810 * 0.4


def test_the_response_to_a_wall_is_what_its_acceleration_changes():
    scene = tank(waves={"kind": "regular", "wave_height": 0.05, "period": 1.0})
    fluid = make_fluid(scene, build(scene), Team(1))
    unit = np.zeros((1, fluid.owners, 6))
    unit[0, PISTON, 0] = 1.0
    still = np.zeros((fluid.owners, 6))
    fluid.begin(0.005, np.zeros((fluid.owners, 3)), still)
    fluid.predict()
    here, _, changes = fluid.respond(still, unit)
    there = fluid.pressure(unit[0])
    assert changes[0, PISTON, 0] < 0  # the water resists
    assert (there - here)[PISTON, 0] == pytest.approx(changes[0, PISTON, 0], rel=0.02)


@pytest.mark.parametrize(
    "change, key",
    [
        ({"numerics": {"solver": "iisph", "viscosity": "laminar"}}, "numerics.viscosity"),
        ({"numerics": {"solver": "iisph"}, "liquids": {"oil": {"blocks": [{"min": [0, -0.4], "max": [1, -0.3]}]}}}, "liquids"),
        ({"numerics": {"solver": "iisph"}, "fluid": {"still_water_level": 0.4}}, "numerics.solver"),
        ({"numerics": {"solver": "iisph", "shifting": 0.2}}, "numerics.shifting"),
        ({"numerics": {"solver": "iisph", "density_relaxation": 1.5}}, "numerics.density_relaxation"),
        ({"numerics": {"kernel": "cubic_spline"}}, "numerics.kernel"),
        ({"numerics": {"smoothing_ratio": 1.0}}, "numerics.smoothing_ratio"),
        ({"tank": {"min": [0, -0.4], "max": [1.2, 0.4], "boundary": "single_layer"}}, "tank.boundary"),
    ],
)  # fmt: skip
def test_what_does_not_go_together_is_refused_by_its_key(change, key):
    values = {"spacing": DR, "duration": 1.0, "tank": {"min": [0, -0.4], "max": [1.2, 0.4]}} | change
    with pytest.raises(SceneError, match=key):
        check_scene(Scene.model_validate(values))
