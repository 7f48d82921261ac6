"""The schemes on water: they agree where they are stable, and a run that fails says what to change."""

import json

import numpy as np
import pytest

import fsi
from bodies import load
from couplers import make
from fsi.errors import RunError
from fsi.simulation.loop import Simulation
from fsi.simulation.stability import Ringing

MOVING = """<mujoco><option timestep="0.01"/><worldbody><body name="ball" pos="0 0 {z}"><joint type="slide" axis="1 0 0"/>
  <geom type="cylinder" size="0.1 0.5" euler="90 0 0" density="1000"/></body></worldbody>
  <keyframe><key name="start" qpos="0" qvel="{speed}"/></keyframe></mujoco>"""

BOX = """<mujoco><option timestep="0.01" integrator="implicitfast"/><worldbody>
  <body name="box" pos="0 0 {z}"><freejoint/>
    <geom name="hull" type="box" size="0.2 0.5 0.1" density="{density}"/></body>
</worldbody></mujoco>"""


def scene(folder, density, scheme, duration, lift=0.03, **more):
    (folder / "box.xml").write_text(BOX.format(z=0.1 - 0.2 * density / 1000 + lift, density=density))
    data = {
        "name": scheme,
        "spacing": 0.04,
        "duration": duration,
        "tank": {"min": (-0.8, -0.4), "max": (0.8, 0.4)},
        "bodies": {"box": {"mjcf": folder / "box.xml"}},
        "coupler": {"scheme": scheme},
        "output": {"timeline": False},
    }
    return fsi.Scene.model_validate(data | more)


def simulate(scene):
    bodies = load(scene)
    return Simulation(scene, bodies=bodies, coupler=make(scene.coupler, bodies), threads=1)


def test_the_same_acceleration_gives_the_same_pressure(tmp_path):
    """What an iterating scheme relies on: a pressure update starts from the last step's, whatever came between."""
    sim = simulate(scene(tmp_path, 200, "added_mass", 1.0))
    for _ in range(5):
        sim.step()
    motion = sim.movers.place(sim.time, sim.dt)
    sim.fluid.begin(sim.dt, motion.centre, motion.twist)
    sim.fluid.predict()
    found = []
    for heave in (0.0, 4.0, -7.0, 0.0):
        acceleration = np.zeros((sim.fluid.owners, 6))
        acceleration[2, 2] = heave
        wrench = sim.fluid.pressure(acceleration)
        found.append(np.concatenate([wrench.ravel(), sim.fluid.work.field[: sim.fluid.count, 2]]))
    assert (found[0] == found[3]).all() and not np.allclose(found[0], found[1])


@pytest.mark.parametrize("precision", ["single", "double"])
def test_a_response_is_the_difference_of_two_pressures(tmp_path, precision):
    """Also for the layer of boundary particles on the edge of the region that takes part."""
    sim = simulate(scene(tmp_path, 100, "added_mass", 1.0, numerics={"precision": precision}))
    sim.step()
    motion = sim.movers.place(sim.time, sim.dt)
    sim.fluid.begin(sim.dt, motion.centre, motion.twist)
    sim.fluid.predict()
    unit, still = np.zeros((3, sim.fluid.owners, 6)), np.zeros((sim.fluid.owners, 6))
    unit[[0, 1, 2], 2, [0, 2, 4]] = 1.0
    before, _, changes = sim.fluid.respond(still, unit)
    before, changes = before[2], changes[:, 2]
    for acceleration, change in zip(unit, changes, strict=True):
        moved = sim.fluid.pressure(10 * acceleration)[2]
        assert (moved - before) / 10 == pytest.approx(change, abs=2e-4 * np.abs(changes).max())


def test_the_default_is_the_fixed_point_without_its_passes(tmp_path):
    """A light free box in three degrees of freedom: the same path, at a fraction of the pressure updates."""
    height, passes = {}, {}
    for scheme in ("added_mass", "fixed_point"):
        run = fsi.run(scene_of(tmp_path / scheme, scheme), out=tmp_path / scheme / "run", quiet=True)
        height[scheme] = run.load().body_position.sel(body="box", axis="z").values
        passes[scheme] = json.loads((run.folder / "run.json").read_text())["coupling"]
    assert height["fixed_point"] == pytest.approx(height["added_mass"], abs=1e-5)
    assert passes["added_mass"]["pressure_updates"] == 1 and passes["added_mass"]["linear_responses"] == 3
    assert 1 < passes["fixed_point"]["pressure_updates"] < 5
    assert all(found["added_mass_ratio"]["box"] > 3 for found in passes.values())


def scene_of(folder, scheme):
    folder.mkdir()
    return scene(folder, 100, scheme, 0.3)


@pytest.mark.parametrize("density", [20, 200])
def test_an_unstable_body_stops_the_run_and_says_what_to_change(tmp_path, density):
    """Also one that would be thrown out of the water, and fall back, for ever."""
    with pytest.raises(RunError) as error:
        fsi.run(scene(tmp_path, density, "lagged", 2.0), out=tmp_path / "run", quiet=True)
    text = str(error.value)
    for part in ("body 'box' is unstable at t = ", "(step ", "the added inertia of the fluid is ", "times its own",
                 'set coupler.scheme = "added_mass"', "the log holds the run up to t = "):  # fmt: skip
        assert part in text
    manifest = json.loads((tmp_path / "run" / "run.json").read_text())
    assert manifest["status"] == "failed" and manifest["reason"] == text
    assert manifest["coupling"]["scheme"] == "lagged" and manifest["coupling"]["added_mass_ratio"]["box"] > 1
    data = fsi.load_run(tmp_path / "run")
    assert len(data.time) > 0 and np.isfinite(data.body_position.values).all()
    assert float(np.abs(data.body_velocity).max()) < 5


def test_hits_and_end_stops_are_not_taken_for_an_instability():
    ringing = Ringing(1, spacing=0.02)
    falls, hit, chatter = [-0.05] * 5, [4.0], [1.0, -1.2, 1.1, -1.3, 1.2, -1.3]
    for speed in (*falls, *hit, *falls, *chatter, *falls):
        assert not ringing(np.array([[0.0, 0, speed, 0, 0, 0]]), 0.01)
    ring = [ringing(np.array([[0.0, 0, 0.1 * (-1.5) ** n, 0, 0, 0]]), 0.01)[0] for n in range(8)]
    assert not any(ring[:5]) and ring[-1]


def thrown(folder, speed, z, **more):
    (folder / "ball.xml").write_text(MOVING.format(speed=speed, z=z))
    return simulate(scene(folder, 500, "added_mass", 1.0, bodies={"ball": {"mjcf": folder / "ball.xml"}}, **more))


@pytest.mark.parametrize("start", ["hydrostatic", "converged"])
def test_a_body_that_starts_moving_shares_its_momentum_with_the_water(tmp_path, start):
    """As dense as water it keeps half its speed, once the pressure has gone round it; no energy comes of it. The pressure at
    the start is that of rest, or it would throw the water about."""
    sim = thrown(tmp_path, 1.0, -0.2, spacing=0.02, fluid={"start": start})
    speed, energy = [], []

    def note(sim):
        speed.append(sim.bodies.motion().velocity[0, 0])
        energy.append(sim.balance.kinetic + sim.balance.potential + sim.bodies.energy())

    sim.run(until=0.1, on_step=note)
    assert max(energy[1:]) < energy[0]
    assert 0.3 < np.mean(speed[len(speed) // 2 :]) < 0.6


def test_the_first_step_is_short_enough_for_a_fast_body(tmp_path):
    sim = thrown(tmp_path, 15.0, -0.2)
    sim.step()
    numerics = sim.scene.numerics
    assert sim.dt == pytest.approx(numerics.courant * sim.scene.smoothing_length / 15.0)


def test_a_body_that_leaves_the_tank_stops_the_run(tmp_path):
    """It is told when it stands in the wall, and is an error when all of it is outside."""
    sim = thrown(tmp_path, 4.0, 0.25, output={"timeline": False})
    with pytest.raises(RunError, match=r"body 'ball' has left the tank through its x\+ wall at t = 0\.22.*add a geom"):
        sim.run()
    assert any(event.text == "body 'ball' in the tank's x+ wall, which does not hold it" for event in sim.events)
    assert any("body 'ball' went through the tank's x+ wall" in note for note in sim.warnings)
