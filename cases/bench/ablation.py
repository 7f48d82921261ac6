"""What each term costs: the plain flume, and the same with one term more. What is absent must cost nothing."""

from __future__ import annotations

import shutil
from pathlib import Path
from statistics import median

from cases.bench.child import first_step
from cases.bench.flume import Flume, bare, flap, visit_in_turns
from fsi.scene.model import Scene

AGAIN = "plain, once more"  # what it differs by from the first row is the noise of the figures
TWO = "plain, two threads"


def variants(spacing: float) -> dict[str, Scene]:
    """Scenes by the term that each adds to the plain flume."""
    whole = flap(spacing=spacing)
    body, waves = {"bodies": whole.model_dump()["bodies"]}, whole.waves.model_dump()
    bottom, top, middle = (
        whole.tank.min[-1],
        whole.fluid.still_water_level,
        0.5 * (whole.tank.min[0] + whole.tank.max[0]),
    )
    layer = {"min": whole.tank.min, "max": (whole.tank.max[0], 0.5 * (bottom + top))}
    laminar, forced = {"viscosity": "laminar"}, {"hinge": {"amplitude": 0.1, "omega": 3.0}}
    level = {"still_water_level": top}
    plastic = {"rheology": {"mu_inf": 0.1, "yield_stress": 1.0}}
    scheme = lambda name, **more: body | {"coupler": {"scheme": name} | more}  # noqa: E731
    ends = {"periodic": ("x",), "min": (middle - 5.0, bottom), "max": (middle + 5.0, whole.tank.max[-1])}
    return {
        "plain": bare(spacing),
        "laminar viscosity": bare(spacing, numerics=laminar),
        "artificial viscosity": bare(spacing, numerics={"artificial_viscosity": 0.05}),
        "eddy viscosity (Smagorinsky)": bare(spacing, numerics=laminar | {"turbulence": "smagorinsky"}),
        "yield stress": bare(spacing, numerics=laminar, fluid=level | plastic),
        "implicit viscosity": bare(
            spacing, numerics=laminar | {"viscous_step": "implicit"}, fluid=level | {"kinematic_viscosity": 1e-2}
        ),
        "second liquid": bare(spacing, liquids={"brine": {"density": 1200.0, "blocks": (layer,)}}),
        "shifting": bare(spacing, numerics={"shifting": 0.5}),
        "periodic": bare(spacing, tank=whole.tank.model_dump() | ends),
        "wall guard": bare(spacing, numerics={"wall_guard": 0.7}),
        "sponge": bare(spacing, damping=whole.damping),
        "wavemaker": bare(spacing, waves=whole.waves),
        "wavemaker that absorbs": bare(spacing, waves=waves | {"absorb": True}),
        "body, added mass": bare(spacing, **body),
        "body, fixed point": bare(spacing, **scheme("fixed_point")),
        "body, prescribed": bare(spacing, **scheme("prescribed", motion=forced)),
        "series log and audit": bare(spacing, output={"series": 0.01, "mcap": True}),
        "timeline": bare(spacing, output={"series": 0.01, "particles": 0.1, "timeline": True}),
        "double precision": bare(spacing, numerics={"precision": "double"}),
        "all of the flap scene": whole,
        AGAIN: bare(spacing),
        TWO: bare(spacing),
    }


def ablation(folder: Path, spacing: float, steps: int, rounds: int, cold: bool = True) -> list[dict]:
    """One row a variant, on one thread; `over_plain` compares visits of the same round. Time and memory come from runs
    side by side in this process, the time to compile and the imports from the first step in a process of its own (`cold`):
    the plain one with an empty numba cache, the others with what that has left, and each once more."""
    scenes = variants(spacing)
    flumes = {
        name: Flume(scene, folder / f"flume-{i}", 2 if name == TWO else 1)
        for i, (name, scene) in enumerate(scenes.items())
    }
    visit_in_turns(list(flumes.values()), steps, rounds)
    rows, plain = [], flumes["plain"]
    for name, flume in flumes.items():
        ns = 1e9 * median(flume.processor) / flume.particles
        over = median(own / other for own, other in zip(flume.processor, plain.processor, strict=True))
        size = flume.sim.memory_bytes / sum(flume.sim.counts.values())
        over *= plain.particles / flume.particles
        row = {"term": name, "ns_per_particle": ns, "over_plain": over, "bytes_per_particle": size}
        measured = cold and name not in (AGAIN, TWO)
        rows.append(row | (_compile(scenes[name], folder / "plain", folder / f"cache-{len(rows)}") if measured else {}))
    return rows


def _compile(scene: Scene, plain: Path, cache: Path) -> dict:
    """Facts of first steps with the numba cache of the plain scene, which the first call makes."""
    if plain.is_dir():
        shutil.copytree(plain, cache)
    else:
        cache = plain
    first, second = first_step(scene, cache), first_step(scene, cache)
    return {
        "compile_s": first["processor_s"] - second["processor_s"],
        "start_s": second["processor_s"],
        "packages": len(second["packages"]),
        "optional_packages": second["optional"],
    }
