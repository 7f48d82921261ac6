"""A simulation that takes over a state goes on bit for bit as the one that was never stopped."""

import sys
from pathlib import Path

import numpy as np
import pytest

import fsi
from fsi.errors import SceneError
from fsi.simulation.loop import Simulation

sys.path.insert(0, str(Path(__file__).parent))
from small_scenes import SCENES, load

WALL = {"wall_time", "phases"}  # of the clock on the wall


class Kept:
    """A recorder that keeps copies of all it sees."""

    def __init__(self):
        self.frames, self.events = [], []

    def begin(self, scene, bodies): ...

    def series(self, frame):
        self.frames.append((frame.time, frame.step, {k: np.array(v) for k, v in frame.series.items()}))

    def particles(self, frame):
        arrays = {"x": frame.position, "u": frame.velocity, "p": frame.pressure, "label": frame.label, **frame.fields}
        self.frames.append((frame.time, frame.step, {k: np.array(v) for k, v in arrays.items()}))

    def event(self, event):
        self.events.append((event.moment.time, event.level, event.text))

    def end(self): ...


def differences(a, b, path=""):
    """Paths of what is not the same in two states, bit for bit."""
    if isinstance(a, dict) and isinstance(b, dict):
        names = (set(a) | set(b)) - WALL
        return [d for k in sorted(names, key=str) for d in differences(a.get(k), b.get(k), f"{path}/{k}")]
    if isinstance(a, np.ndarray):
        same = isinstance(b, np.ndarray) and a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes()
        return [] if same else [path]
    if isinstance(a, list | tuple):
        if len(a) != len(b):
            return [path]
        return [d for n, (x, y) in enumerate(zip(a, b, strict=True)) for d in differences(x, y, f"{path}[{n}]")]
    return [] if a == b or (a != a and b != b) else [f"{path}: {a!r} {b!r}"]


def steps(sim, count):
    for _ in range(count):
        sim.step()


@pytest.mark.parametrize("name", [pytest.param(n, marks=[pytest.mark.slow] * (n == "slide_glued")) for n in SCENES])
def test_a_restored_simulation_goes_on_bit_for_bit(name, tmp_path):
    scene = load(name, tmp_path, "output.particles=1e-6")
    first, second = Kept(), Kept()
    through = Simulation(scene, recorders=[first], threads=1)
    steps(through, 9)
    state = through.state()
    seen, told = len(first.frames), len(first.events)
    steps(through, 7)
    resumed = Simulation(scene, recorders=[second], threads=2)
    resumed.restore(state)
    assert differences(resumed.state(), state) == []
    steps(resumed, 7)
    assert second.frames and differences(first.frames[seen:], second.frames) == []
    assert first.events[told:] == second.events
    ends = [
        {k: [e[:2] + e[3:] for e in v] if k == "events" else v for k, v in sim.state().pop("told").items()}
        for sim in (through, resumed)
    ]
    assert differences(*ends) == []
    assert differences(*({k: v for k, v in sim.state().items() if k != "told"} for sim in (through, resumed))) == []
    assert through.audit() == resumed.audit() and through.warnings == resumed.warnings
    assert differences(through.coupling(), resumed.coupling()) == []


def test_a_state_is_refused_where_it_does_not_belong(tmp_path):
    state = Simulation(load("layers", tmp_path), threads=1).state()
    with pytest.raises(ValueError, match="other boundary particles"):
        Simulation(load("channel", tmp_path), threads=1).restore(state)
    moving = Simulation(load("floating_box_2d", tmp_path), threads=1)
    with pytest.raises(ValueError, match="other boundary particles"):
        moving.restore(state)
    moving.step()
    with pytest.raises(ValueError, match="no step"):
        moving.restore(moving.state())


def test_a_simulation_builds_what_its_scene_says(tmp_path):
    sim = Simulation(load("floating_box_2d", tmp_path), threads=1)
    assert sim.bodies.names == ("box",) and sim.coupler is not None
    with pytest.raises(SceneError, match="come together"):
        Simulation(sim.scene, bodies=sim.bodies)


def test_open_steps_bodies_with_the_users_data(tmp_path):
    scene = load("floating_box_2d", tmp_path)
    with fsi.open(scene, threads=1) as sim:
        height = float(sim.data.qpos[2])
        assert sim.step() == sim.time == sim.dt > 0
        assert sim.run(0.02) == pytest.approx(0.02, abs=1e-15)
        assert float(sim.data.qpos[2]) != height and sim.model.nq == 7
    with pytest.raises(SceneError, match="closed"):
        sim.step()
    with fsi.open("dam_break", overrides=["spacing=0.1"]) as sim, pytest.raises(SceneError, match="body file"):
        _ = sim.data


def test_open_records_like_a_run(tmp_path):
    scene = load("floating_box_2d", tmp_path, "output.series=0.01", "output.timeline=false")
    sim = fsi.open(scene, out=tmp_path / "run", threads=1)
    sim.run(0.03)
    sim.close()
    sim.close()
    data = fsi.load_run(tmp_path / "run")
    assert data.attrs["status"] == "done" and data.sizes["time"] == 3
