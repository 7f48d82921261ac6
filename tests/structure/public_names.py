"""Every public name of `fsi` with its type, as a type checker sees it: `mypy --strict tests/structure/public_names.py`."""

from pathlib import Path

import fsi

version: str = fsi.__version__
scene: fsi.Scene = fsi.load_scene("flap", ["waves.period=2.0"], level=None)
step: float = scene.spacing
ended: fsi.Run = fsi.run(scene, out=Path("runs") / "flap", until=0.1, threads=1, quiet=True)
seconds: float = ended.wall_seconds
facts: dict[str, object] = fsi.check(scene, measure=2)
simulation = fsi.Simulation(scene, threads=1)
simulation.run(until=0.1, on_step=lambda sim: print(sim.time))
simulation.step()
warnings: list[str] = simulation.warnings
with fsi.open(scene) as session:
    now: float = session.step()
opened: fsi.Session = session
world = fsi.Environment(scene, reward=lambda run: -run.time, interval=0.1)
driven: fsi.Run = fsi.run(scene, on_step=lambda run: print(run.gauges), controller=lambda run: None)
heights: list[float] = fsi.load_run(ended.folder).elevation.values.tolist()
again: fsi.Run = fsi.resume(ended.folder, until=0.2)
page: Path = fsi.report(ended.folder)
study = fsi.sweep("study.toml", threads=1)
rows = fsi.validate(["still_*"], levels=["coarse"])
speed = fsi.bench(quick=True)
try:
    fsi.load_scene("nothing")
except fsi.SceneError as fault:
    said: str = fault.fix
except fsi.RunError:
    raise
