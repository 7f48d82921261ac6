"""Alarms: lost particles from the first on, energy from nowhere, and what their texts name as the cause."""

import json

import numpy as np
import pytest

from fsi import runner
from fsi.errors import RunError, SceneError
from fsi.scene.model import Scene
from fsi.simulation.loop import Simulation

DR = 0.02


def tank(walls=("x-", "x+", "z-"), length=0.4, **parts) -> Scene:
    box = {"min": (0.0, -0.2), "max": (length, 0.2), "walls": walls}
    quiet = {"timeline": False, "mcap": False}
    values = {"spacing": DR, "duration": 1.0, "tank": box, "output": quiet} | parts
    return Scene.model_validate(values)


def throw(sim, count):
    """Put so many particles beyond the x+ end of the tank."""
    sim.fluid.position[:count, 0] = sim.scene.tank.max[0] + 1.0
    sim.fluid.velocity[:count] = 0.0


def test_the_first_lost_particle_is_told_with_time_place_and_cause():
    sim = Simulation(tank(), threads=1)
    sim.step()
    sim.fluid.position[7] = [0.2, 0.9]
    sim.step()
    [event] = [event for event in sim.events if event.level == "warning" and "a particle has left" in event.text]
    assert event.moment.step == 2
    assert "last seen at x = 0.2, z = 0.9 m" in event.text and 'add "z+" to tank.walls' in event.text
    sim.step()
    sim.finish("info", "done")
    assert sum("a particle has left" in event.text for event in sim.events) == 1
    assert sim.audit()["lost_particles"] == 1 and sim.audit()["lost_share"] == pytest.approx(1 / 200)


def test_loss_warns_at_a_tenth_of_the_limit_and_fails_at_it():
    scene = tank(alarms={"lost_particles": 0.1})
    sim = Simulation(scene, threads=1)
    sim.step()
    throw(sim, 2)
    sim.step()
    assert any("(1 %)" in note for note in sim.warnings)
    throw(sim, 18)
    with pytest.raises(RunError, match=r"20 of 200 particles \(10 %\).*the first at t = .*alarms.lost_particles = 0.1"):
        sim.step()


def test_a_wall_that_is_passed_is_named_and_the_step_blamed():
    sim = Simulation(tank(), threads=1)
    sim.step()
    throw(sim, 1)
    sim.step()
    assert any("through the wall x+" in note and "courant" in note for note in sim.warnings)


def test_what_lost_particles_carry_away_is_booked():
    """Neither momentum nor energy is missing after three fast particles have left."""
    sim = Simulation(tank(alarms={"lost_particles": 1.0}, output={"series": 1e-9, "mcap": False}), threads=1)
    sim.recorders = [Nobody()]
    sim.step()
    sim.fluid.velocity[:3] = [9.0, 2.0]
    sim.fluid.position[:3] = [0.2, 0.5]
    sim.balance.open()
    before = sim.balance.dissipated
    sim.fluid.position[:3] += [0.5, 0.0]
    sim.step()
    assert sim.fluid.lost == 3
    assert sim.balance.carried_away == pytest.approx(3 * 0.4 * (0.5 * 85 + 9.81 * 0.5), rel=1e-6)
    assert sim.balance.dissipated - before == pytest.approx(0.0, abs=1e-3 * sim.balance.carried_away)
    assert sim.balance.momentum_residual < 1e-5


class Nobody:
    """A recorder that keeps nothing."""

    def begin(self, scene, bodies):
        pass

    def series(self, frame):
        pass

    particles = event = series


def test_energy_from_nowhere_warns_and_fails():
    sim = Simulation(tank(), threads=1)
    sim.step()
    scale = sim.balance.energy_scale
    mass = sim.fluid.count * sim.balance.mass
    sim.fluid.velocity[:] = [0.0, np.sqrt(2 * 0.05 * scale / mass)]
    sim.step()
    assert any("energy have come from nowhere" in note for note in sim.warnings)
    sim.fluid.velocity[:] = [0.0, np.sqrt(2 * 1.5 * scale / mass)]
    with pytest.raises(RunError, match=r"from nowhere.*likeliest cause: the fastest particle is at.*alarms.energy = 1"):
        sim.step()


def test_velocities_set_before_the_first_step_are_no_energy_from_nowhere():
    sim = Simulation(tank(), threads=1)
    sim.fluid.velocity[:] = [0.3, 0.0]
    sim.step()
    assert sim.balance.energy_at_start == pytest.approx(0.5 * 80 * 0.09 - 80 * 9.81 * 0.1, rel=1e-6)
    assert sim.warnings == []


def test_a_driven_channel_gets_its_energy_from_the_force():
    box = {"min": (0.0, 0.0), "max": (0.8, 0.2), "walls": ("z-", "z+"), "periodic": ("x",)}
    fluid = {"still_water_level": 0.2, "acceleration": (0.5, 0.0), "kinematic_viscosity": 1e-3}
    sim = Simulation(tank(tank=box, gravity=0.0, fluid=fluid), threads=1)
    sim.run(0.2)
    assert sim.balance.force_work > 0.2
    assert 0 < sim.balance.dissipated < 0.5 * sim.balance.force_work
    assert sim.warnings == []


def test_doubled_walls_are_found_by_name():
    sim = Simulation(tank(), threads=1)
    assert sim.alarms.doubled_walls == ""
    del sim.alarms.doubled_walls
    sim.fluid.boundary[1] = sim.fluid.boundary[0] + [0.3 * DR, 0.0]
    assert "doubled: 2 of their particles" in sim.alarms.doubled_walls


def test_the_loss_is_in_the_manifest_and_on_the_exit_line(tmp_path):
    blocks = [{"min": (0.0, -0.2), "max": (0.4, 0.0)}, {"min": (0.2, 0.1), "max": (0.24, 0.12), "velocity": (0.0, 9.0)}]
    scene = tank(fluid={"blocks": blocks}, duration=0.1, alarms={"lost_particles": 0.5})
    done = runner.run(scene, out=tmp_path / "run", threads=1, quiet=True)
    facts = json.loads((tmp_path / "run" / "run.json").read_text())
    assert done.lost_particles == facts["audit"]["lost_particles"] == 2
    assert "first at t =" in facts["audit"]["first_lost"]
    assert any(event["level"] == "warning" and "z+" in event["text"] for event in facts["events"])


@pytest.mark.parametrize(("key", "value"), [("lost_particles", 0.0), ("lost_particles", 2.0), ("energy", -1.0)])
def test_limits_are_shares(tmp_path, key, value):
    file = tmp_path / "a.toml"
    file.write_text(
        f"spacing = 0.02\nduration = 1.0\n[tank]\nmin = [0, -0.2]\nmax = [1, 0.2]\n[alarms]\n{key} = {value}\n"
    )
    with pytest.raises(SceneError, match=f"alarms.{key}"):
        runner.check(file)


def test_a_fault_of_a_users_function_is_told_by_its_own_name():
    from fsi.simulation.stability import Stability

    watch = Stability.__new__(Stability)
    watch._free, watch.logged = True, 0.1
    watch._sim = type("Sim", (), {"time": 0.1, "step_count": 7})
    text = str(watch.failed(RunError("laws.py:brake(0.1, 0, 0) returned nan; it must return a finite force")))
    assert text.startswith("laws.py:brake(0.1, 0, 0) returned nan; it must return a finite force, at t = 0.1")
    assert "unstable" not in text and "mach" not in text
