"""Controllers act at their instants and hold in between, remember across resets and checkpoints, and see what MuJoCo's
`mj_forward` would show them."""

import mujoco
import numpy as np
import pytest

import fsi
from fsi.errors import RunError, SceneError
from fsi.simulation.loop import Simulation
from fsi.trust import trusting

FLOAT = """
<mujoco>
  <option timestep="0.002"/>
  <worldbody>
    <body name="box" pos="0 0 0.02">
      <joint name="heave" type="slide" axis="0 0 1"/>
      <geom name="box" type="box" size="0.15 0.15 0.1" density="500"/>
      <site name="mid"/>
    </body>
  </worldbody>
  <actuator><motor name="push" joint="heave" ctrlrange="-50 50"/></actuator>
  <sensor>
    <jointpos name="z" joint="heave"/><accelerometer name="felt" site="mid"/><actuatorfrc name="force" actuator="push"/>
  </sensor>
</mujoco>
"""
SCENE = """
spacing = 0.05
duration = 1.0
[tank]
min = [-1.0, -0.4]
max = [1.0, 0.3]
width = 0.3
[gauges.side]
x = 0.4
[bodies.box]
mjcf = "float.xml"
"""
FILE = '''
class Counter:
    """Pushes harder with every call."""

    def __init__(self, gain=1.0):
        self.gain, self.count, self.times = gain, 0, []

    def __call__(self, run):
        self.count += 1
        self.times.append(run.time)
        run.data.ctrl[0] = self.gain * self.count + run.data.sensordata[0]

    def state(self):
        return {"count": self.count, "times": self.times}

    def restore(self, state):
        self.count, self.times = state["count"], state["times"]


def function(run):
    run.data.ctrl[0] = -5.0


def broken(run):
    run.data.ctrl[0] = 1 / 0
'''


@pytest.fixture
def scene(tmp_path):
    (tmp_path / "float.xml").write_text(FLOAT)
    (tmp_path / "own.py").write_text(FILE)
    (tmp_path / "scene.toml").write_text(SCENE)
    return lambda *settings: fsi.load_scene(tmp_path / "scene.toml", settings)


def control(name, **keys):
    return [f"control.function=own.py:{name}", *(f"control.{key}={value}" for key, value in keys.items())]


def trajectory(sim, until):
    found = []
    while sim.time < until:
        sim.step()
        found.append((sim.time, *sim.data.sensordata, sim.data.ctrl[0], sim.gauges["side"]))
    return np.array(found)


def test_a_controller_acts_at_its_instants_and_its_state_is_kept(scene):
    with fsi.open(scene(*control("Counter", interval=0.03, settings="{gain = 2.0}")), threads=1, trust=True) as sim:
        first = trajectory(sim, 0.1)
        inner = sim.simulation.control.state()["controller"]
        assert inner["count"] == 4 and np.allclose(inner["times"], [0, 0.03, 0.06, 0.09], atol=1e-12)
        held = {round(float(z), 12) for z in first[:, -2]}
        assert len(held) == 4 and max(held) == pytest.approx(8.0, abs=0.1)
        kept = sim.state()
        rest = trajectory(sim, 0.15)
        sim.restore(kept)
        assert np.array_equal(trajectory(sim, 0.15), rest)
        sim.reset()
        assert sim.time == 0.0 and np.array_equal(trajectory(sim, 0.1), first)
        with trusting():
            other = Simulation(sim.scene, threads=1)
        other.restore(kept)
        other.run(0.13)
        assert other.control.state()["controller"]["count"] == 5


@pytest.mark.parametrize("scheme", ["added_mass", "fixed_point"])
def test_controls_hold_over_the_step_and_sensors_are_those_of_mj_forward(scene, scheme):
    with fsi.open(scene(f"coupler.scheme={scheme}", "numerics.solver=converged"), threads=1) as sim:
        speeds = []
        for push in (30.0, -30.0, 30.0):
            sim.data.ctrl[0] = push
            sim.step()
            speeds.append(sim.data.qvel[0])
            assert sim.data.ctrl[0] == push and sim.data.sensor("force").data[0] == pytest.approx(push)
            trial = mujoco.MjData(sim.model)
            trial.qpos[:], trial.qvel[:], trial.ctrl[:] = sim.data.qpos, sim.data.qvel, sim.data.ctrl
            trial.xfrc_applied[1] = sim.load[0]
            mujoco.mj_forward(sim.model, trial)
            assert np.allclose(sim.data.sensordata, trial.sensordata, rtol=1e-9, atol=1e-9)
            assert sim.data.qacc[0] == pytest.approx(trial.qacc[0])
            mean = (sim.load[0, 2] + push) / sim.model.body_mass[
                1
            ] - 9.81  # of the step, all passes with the same control
            assert (speeds[-1] - (speeds[-2] if len(speeds) > 1 else 0.0)) / sim.dt == pytest.approx(mean, rel=1e-4)


def test_what_has_no_effect_is_refused(scene):
    with fsi.open(scene(), threads=1) as sim:
        sim.step()
        sim.data.qpos[0] += 0.1
        with pytest.raises(SceneError, match=r"qpos was set.*keyframe"):
            sim.step()
        sim.reset()
        sim.data.xfrc_applied[1, 2] = 1.0
        with pytest.raises(SceneError, match=r"xfrc_applied was set.*actuator"):
            sim.step()
        sim.reset()
        sim.data.ctrl[0] = np.nan
        with pytest.raises(RunError, match="finite"):
            sim.run(0.1)
        sim.reset()
        sim.data.qvel[0] = 0.2
        sim.step()
        assert sim.data.qvel[0] > 0.05


def test_a_controller_that_cannot_be_used_is_told(scene, tmp_path):
    with pytest.raises(SceneError, match=r"control.settings: own.py:function is a function"):
        fsi.open(scene(*control("function", settings="{gain = 1}")), trust=True)
    with pytest.raises(SceneError, match=r"control.settings: .*unexpected keyword argument 'lift'"):
        fsi.open(scene(*control("Counter", settings="{lift = 1}")), trust=True)
    with pytest.raises(SceneError, match=r"control.function: names code to run, own.py.*--trust"):
        fsi.run(scene(*control("function")), quiet=True, out=tmp_path / "run")
    assert "control: own.py:broken is not run by a check" in fsi.check(scene(*control("broken")))["notes"]
    with pytest.raises(SceneError, match=r"no function 'nothing'.*Counter"):
        fsi.check(scene(*control("nothing")))
    with (
        fsi.open(scene(*control("broken")), threads=1, trust=True) as sim,
        pytest.raises(RunError, match="broken at t = 0 s: Zero"),
    ):
        sim.step()
    with pytest.raises(SceneError, match="names a controller already"):
        fsi.open(scene(*control("function")), controller=print, trust=True)
    with pytest.raises(SceneError, match=r"control: there are no bodies"):
        fsi.load_scene("dam_break", [f"control.function={tmp_path}/own.py:function"])
    with pytest.raises(SceneError, match="no actuator"):
        fsi.open("floating_box_2d", overrides=["spacing=0.05"], controller=print)

    class Forgetful:
        def __call__(self, run): ...

    told = pytest.raises(SceneError, match=r"Forgetful may remember something.*state\(\)")
    with fsi.open(scene(), controller=Forgetful(), threads=1) as sim, told:
        sim.reset()


def test_a_run_with_a_controller_is_logged_and_resumed(scene, tmp_path):
    quiet, times = {"threads": 1, "quiet": True, "trust": True}, []
    settings = (*control("Counter", interval=0.02), "output.timeline=false")
    whole = scene(*settings)
    data = fsi.run(whole, out=tmp_path / "a", until=0.1, on_step=lambda run: times.append(run.time), **quiet).load()
    assert len(times) > 5 and times[-1] == pytest.approx(0.1)
    assert data.actuator.values.tolist() == ["push"]
    assert float(data.control[-1, 0]) == pytest.approx(5.0, abs=0.1)
    assert float(data.actuator_force[-1, 0]) == float(data.control[-1, 0])
    fsi.run(scene(*settings, "output.checkpoint=1e-6"), out=tmp_path / "b", until=0.05, **quiet)
    again = fsi.resume(tmp_path / "b", until=0.1, **quiet).load()
    assert np.array_equal(again.control.sel(time=slice(0.06, None)), data.control.sel(time=slice(0.06, None)))
    with (
        fsi.open(whole, out=tmp_path / "c", threads=1, trust=True) as sim,
        pytest.raises(SceneError, match="cannot go back"),
    ):
        sim.reset()


def test_a_seed_gives_other_waves(tmp_path):
    settings = (
        "waves.wave_height=",
        "waves.period=",
        "waves.kind=irregular",
        "waves.Hm0=0.15",
        "waves.peak_period=1.6",
    )
    small = (
        "spacing=0.07",
        "tank.max=[5.0, 0.49]",
        "damping[0].start=4.0",
        "damping[0].end=5.0",
        "probes=",
        "gauges.lee.x=3",
    )
    scene = fsi.load_scene("flap", [*settings, *small, "bodies=", "waves.ramp=0"])
    with fsi.open(scene, threads=1) as sim:
        runs = []
        for seed in (1, 2, 1):
            sim.reset(seed=seed)
            sim.run(0.1)
            runs.append((sim.rng.random(), sim.gauges["paddle"]))
    assert runs[0] == runs[2] and runs[0][1] != runs[1][1]


def test_without_a_display_the_viewer_says_so(scene, tmp_path, monkeypatch):
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr("sys.platform", "linux")
    with pytest.raises(SceneError, match=r"--viewer: MuJoCo's viewer needs a display.*fsi view"):
        fsi.run(scene(), out=tmp_path / "run", viewer="mujoco", quiet=True)
    assert not (tmp_path / "run" / "run.json").exists()
    with pytest.raises(SceneError, match="scene has none"):
        fsi.run("dam_break", out=tmp_path / "dam", viewer="mujoco", quiet=True)
