"""What each term costs: the plain flume, and the same with one term more. What is absent must cost nothing."""

from __future__ import annotations

from pathlib import Path
from statistics import median

from cases.bench.child import first_step
from cases.bench.flume import Flume, bare, flap, visit_in_turns
from fsi.scene import Scene

AGAIN = "plain, once more"  # what it differs by from the first row is the noise of the figures


def variants(spacing: float) -> dict[str, Scene]:
    """Scenes by the term that each adds to the plain flume."""
    whole = flap(spacing=spacing)
    body = {"bodies": whole.model_dump()["bodies"]}
    return {
        "plain": bare(spacing),
        "laminar viscosity": bare(spacing, numerics={"viscosity": "laminar"}),
        "artificial viscosity": bare(spacing, numerics={"artificial_viscosity": 0.02}),
        "wall guard": bare(spacing, numerics={"wall_guard": 0.8}),
        "sponge": bare(spacing, damping=whole.damping),
        "wavemaker": bare(spacing, waves=whole.waves),
        "body": bare(spacing, **body),
        "series log": bare(spacing, output={"series": 0.01, "mcap": True}),
        "timeline": bare(spacing, output={"series": 0.01, "particles": 0.1, "timeline": True}),
        "double precision": bare(spacing, numerics={"precision": "double"}),
        "all of the flap scene": whole,
        AGAIN: bare(spacing),
    }


def ablation(folder: Path, spacing: float, steps: int, rounds: int, cold: bool = True) -> list[dict]:
    """One row a variant, on one thread; `over_plain` compares visits of the same round. Time and memory come from runs
    side by side in this process, the time to compile and the imports from the first step in a process of its own with an
    empty numba cache (`cold`) and a second one."""
    scenes = variants(spacing)
    flumes = {name: Flume(scene, folder / f"flume-{i}") for i, (name, scene) in enumerate(scenes.items())}
    visit_in_turns(list(flumes.values()), steps, rounds)
    rows, plain = [], flumes["plain"]
    for name, flume in flumes.items():
        ns = 1e9 * median(flume.processor) / flume.particles
        over = median(own / other for own, other in zip(flume.processor, plain.processor, strict=True))
        size = flume.sim.memory_bytes / sum(flume.sim.counts.values())
        over *= plain.particles / flume.particles
        row = {"term": name, "ns_per_particle": ns, "over_plain": over, "bytes_per_particle": size}
        rows.append(row | (_compile(scenes[name], folder / f"cache-{len(rows)}") if cold and name != AGAIN else {}))
    return rows


def _compile(scene: Scene, cache: Path) -> dict:
    first, second = first_step(scene, cache), first_step(scene, cache)
    return {
        "compile_s": first["processor_s"] - second["processor_s"],
        "start_s": second["processor_s"],
        "packages": len(second["packages"]),
        "optional_packages": second["optional"],
    }
