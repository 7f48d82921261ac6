"""A floating box comes to rest at Archimedes' draft, and what it gets from the fluid is what the fluid gives."""

import json

import numpy as np
import pytest

import fsi
from bodies import load
from couplers import make
from fsi.simulation.loop import Simulation

BOX = """<mujoco><option timestep="0.01" integrator="implicitfast"/><worldbody>
  <body name="box" pos="0 0 {z}"><freejoint/>
    <geom name="hull" type="box" size="{x} {y} {h}" density="{density}"/></body>
</worldbody></mujoco>"""
WIDE, HIGH = 0.48, 0.24  # m


def float_box(tmp_path, dimension, spacing, density, lift, until, tank, **more):
    """Run a box let go `lift` above its draft in a tank with beaches; returns the data, spacing and exact height."""
    exact = HIGH / 2 - density / 1000 * HIGH
    across = WIDE / 2 if dimension == 3 else 0.5
    text = BOX.format(z=exact + lift, x=WIDE / 2, y=across, h=HIGH / 2, density=density)
    (tmp_path / "box.xml").write_text(text)
    end, shore = tank["max"][0], 0.55 * tank["max"][0]
    axes = "x" if dimension == 2 else "xy"
    beaches = [{"axis": a, "start": s * shore, "end": s * end, "rate": 20} for s in (1, -1) for a in axes]
    scene = fsi.Scene.model_validate(
        {
            "name": "box",
            "dimension": dimension,
            "spacing": spacing,
            "duration": until,
            "tank": tank,
            "damping": beaches,
            "bodies": {"box": {"mjcf": tmp_path / "box.xml"}},
            "gauges": {"side": {"x": 0.4 * (WIDE + end)}},
            "output": {"timeline": False},
        }
        | more
    )
    run = fsi.run(scene, out=tmp_path / "run", quiet=True)
    data = run.load()
    level = float(data.elevation[len(data.time) * 3 // 4 :, 0].mean())
    return data, exact + level, run


@pytest.mark.parametrize("density", [900.0, 500.0, 100.0, 20.0])
def test_box_floats_at_its_draft_in_two_dimensions(tmp_path, density):
    tank = {"min": (-1.6, -0.48), "max": (1.6, 0.4)}
    data, exact, _ = float_box(tmp_path, 2, 0.02, density, 0.05, 5.0, tank)
    height = data.body_position.sel(body="box", axis="z")
    last = height[len(height) * 3 // 4 :]
    assert float(height[0]) == pytest.approx(exact + 0.05, abs=0.01)
    assert abs(float(last.mean()) - exact) < 0.5 * 0.02
    assert float(last.max() - last.min()) < 0.5 * 0.02
    weight = density * WIDE * HIGH * 9.81
    assert float(data.body_force.sel(axis="z")[len(height) // 2 :].mean()) == pytest.approx(weight, rel=0.02)


@pytest.mark.slow
def test_box_floats_at_its_draft_in_three_dimensions(tmp_path):
    tank = {"min": (-0.8, -0.8, -0.48), "max": (0.8, 0.8, 0.4)}
    data, exact, _ = float_box(tmp_path, 3, 0.04, 500.0, 0.05, 5.0, tank)
    height = data.body_position.sel(body="box", axis="z")
    assert abs(float(height[len(height) * 3 // 4 :].mean()) - exact) < 0.5 * 0.04


def test_momentum_is_exchanged_to_round_off(tmp_path):
    tank = {"min": (-1.6, -0.48), "max": (1.6, 0.4)}
    for precision, bound in (("double", 1e-13), ("single", 1e-6)):
        (tmp_path / precision).mkdir()
        numerics = {"precision": precision}
        _, _, run = float_box(tmp_path / precision, 2, 0.04, 500.0, 0.1, 0.5, tank, numerics=numerics)
        audit = json.loads((run.folder / "run.json").read_text())["audit"]
        assert audit["momentum_audits"] > 20
        assert audit["momentum_residual"] < bound
        assert audit["body_impulse_residual"] < 10 * bound


def test_results_do_not_depend_on_the_number_of_threads(tmp_path):
    tank = {"min": (-1.6, -0.48), "max": (1.6, 0.4)}
    data = []
    for threads in ("1", "2"):
        (tmp_path / threads).mkdir()
        (tmp_path / "box.xml").write_text(BOX.format(z=0.1, x=0.24, y=0.5, h=0.12, density=500))
        scene = fsi.Scene.model_validate(
            {"spacing": 0.02, "duration": 0.1, "tank": tank, "bodies": {"box": {"mjcf": tmp_path / "box.xml"}}}
        )
        bodies = load(scene)
        sim = Simulation(scene, bodies=bodies, coupler=make(scene.coupler, bodies), threads=int(threads))
        sim.run()
        data.append(np.concatenate([sim.fluid.position.ravel(), bodies.state()["mujoco"]]))
    assert (data[0] == data[1]).all()


def test_what_the_fluid_loses_is_what_it_does_on_the_body_and_in_the_sponge(tmp_path):
    """A box is let go high: the exchange in its first swings, and what the beaches take."""
    tank = {"min": (-1.6, -0.48), "max": (1.6, 0.4)}
    residual = []
    for spacing in (0.08, 0.04):
        (tmp_path / str(spacing)).mkdir()
        _, _, run = float_box(tmp_path / str(spacing), 2, spacing, 500.0, 0.12, 2.0, tank)
        audit = json.loads((run.folder / "run.json").read_text())["audit"]
        assert audit["sponge_loss"] > 0
        loss = audit["energy_at_start"] - audit["kinetic_energy"] - audit["potential_energy"] - audit["body_work"]
        assert audit["dissipated_energy"] == pytest.approx(loss)
        assert audit["work_residual"] == pytest.approx((loss - audit["sponge_loss"]) / audit["exchanged_work"])
        residual.append(audit["work_residual"])
    assert 0 < residual[1] < residual[0] / 2 and residual[1] < 0.12
