"""Body files that the cases write, and how they are read from a run."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from fsi.owners import FIRST_BODY

FILE = """<mujoco>
  <option timestep="0.02" integrator="implicitfast" gravity="0 0 {gravity}"/>{assets}
  <worldbody>
{bodies}
  </worldbody>
</mujoco>
"""
BODY = '    <body name="{name}" pos="{x} {y} {z}">{joint}<geom name="{name}" type="{shape}" {size} density="{density}"/></body>'
HEAVE = '<joint name="{name}" type="slide" axis="0 0 1"/>'
PITCH = '<joint name="{name}" type="hinge" axis="0 1 0"/>'


def body(
    name: str, place: Sequence[float], joint: str, shape: str, size: Sequence[float], density: float, **more
) -> str:
    """MJCF of a body of one geom centred at `place` (x, y, z) [m]; `size` as MuJoCo has it for this shape, or `geom`
    attributes of a cylinder that lies along y."""
    x, y, z = (f"{value:.9g}" for value in place)
    attributes = f'size="{" ".join(f"{value:.9g}" for value in size)}"'
    if more.get("along_y"):
        attributes += ' euler="90 0 0"'
    joint = joint.format(name=name)
    return BODY.format(name=name, x=x, y=y, z=z, joint=joint, shape=shape, size=attributes, density=f"{density:.9g}")


def write(folder: Path, bodies: Sequence[str], gravity: float = 9.81, assets: str = "") -> dict:
    """Write a body file, with what stands before its world; the `bodies` of a scene that holds it."""
    file = Path(folder, "bodies.xml")
    file.write_text(FILE.format(gravity=-gravity, assets=assets, bodies="\n".join(bodies)), encoding="utf-8")
    return {"set": {"mjcf": str(file)}}


def force(sim) -> float:
    """Force (b, 3) of the fluid on the bodies over the last step [N]."""
    return sim.balance.wrench[FIRST_BODY:, :3]
