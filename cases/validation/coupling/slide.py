"""A triangular wedge slides down a ramp of 45 degrees into water 1 m deep, as in the experiments of Heinrich (1992), J.
Waterway Port Coastal Ocean Eng. 118, 249-266: 2000 kg/m3, legs of 0.5 m, top 1 cm under water at the start, no friction.

Two ways to hold it: contact of body and ramp alone, where no fluid is between them and the face has no pressure; and with
two layers of fluid glued to the face, at that distance from the ramp, which carry the pressure through the gap and move
with the slide. Without friction the way down is about the same for both.

Theory: a rigid body with added mass m(s) by Lagrange, (M + m) a + m' v^2 / 2 = (M - rho V) g sin 45 - rho C A v^2 / 2, drag
coefficient C = 2 of a flat plate on the height A across the ramp; glued fluid counts with M. m(s) comes from Laplace's
equation under a flat surface, by finite volumes, for each depth of the wedge. It holds until the wedge has drawn down the
surface behind it: `displacement` is the largest error over the first 0.15 m, as a share of that; `off_ramp_m` how far the
slide leaves the ramp.
"""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path

import numpy as np

from cases.validation.engine.case import Case, Measure

RHO, G, DENSITY, LEG, TOP, DEPTH = 1000.0, 9.81, 2000.0, 0.5, 0.01, 1.0
S = math.sqrt(0.5)
VOLUME, ACROSS, DRAG, WAY, LAYERS = LEG**2 / 2, LEG * S, 2.0, 0.15, 2
CELL, LENGTH = 0.01, 4.0  # of the finite volumes, and of the tank [m]

MODEL = """<mujoco model="slide">
  <custom><tuple name="wet">
    <element objtype="geom" objname="ramp"/><element objtype="geom" objname="slide"/>
  </tuple></custom>
  <option timestep="0.005" integrator="implicitfast"/>
  <asset><mesh name="wedge" vertex="{wedge}"/><mesh name="ramp" vertex="{ramp}"/></asset>
  <worldbody>
    <geom name="ramp" type="mesh" mesh="ramp" contype="0" conaffinity="0"/>
    <geom name="slope" type="plane" zaxis="1 0 1" size="5 1 1" condim="1"/>
    <body name="slide" pos="{x} 0 {z}">
      <freejoint/>
      <geom name="slide" type="mesh" mesh="wedge" density="{density}" condim="1"/>
    </body>
  </worldbody>
</mujoco>
"""


def _vertices(points) -> str:
    return " ".join(f"{x:.9g} {y} {z:.9g}" for x, z in points for y in (-0.5, 0.5))


def _scene(layers: int):
    def scene(spacing: float, folder: Path) -> dict:
        off = layers * spacing * S
        corners = [(TOP, -TOP), (TOP + LEG, -TOP), (TOP + LEG, -TOP - LEG)]
        x, z = np.mean(corners, axis=0)
        wedge = _vertices((a - x, b - z) for a, b in corners)
        ramp = _vertices([(-0.6, 0.6), (1.3, -1.3), (-0.6, -1.3)])
        text = MODEL.format(wedge=wedge, ramp=ramp, x=x + off, z=z + off, density=DENSITY)
        (folder / "slide.xml").write_text(text, encoding="utf-8")
        return {
            "duration": 0.45,
            "tank": {"min": [-0.4, -DEPTH], "max": [LENGTH, 0.6]},
            "bodies": {"slide": {"mjcf": str(folder / "slide.xml"), "glued_layers": layers}},
        }

    return scene


@cache
def added_mass(steps_down: int) -> float:
    """Added mass along the ramp [kg/m] of the wedge, `steps_down` cells lower than at the start: the potential by finite
    volumes on squares, which the ramp cuts along their diagonals, p = 0 on the surface."""
    from scipy.sparse import lil_matrix
    from scipy.sparse.linalg import spsolve

    columns, rows = round(LENGTH / CELL), round(DEPTH / CELL)
    left = top = round(TOP / CELL) + steps_down  # of the wedge, in cells; z = -x on the ramp
    legs = round(LEG / CELL)
    i, j = np.meshgrid(np.arange(columns), np.arange(rows), indexing="ij")  # j counts down from the surface
    wet = j <= i  # the cell j = i is cut in half: its left and its lower face are the ramp's side
    wet &= ~((i >= left) & (i < left + legs) & (j >= top) & (j - top <= i - left))
    number = np.full(wet.shape, -1)
    number[wet] = np.arange(wet.sum())
    matrix, flux = lil_matrix((wet.sum(), wet.sum())), np.zeros(wet.sum())
    for a, b in zip(*np.nonzero(wet), strict=True):
        n = number[a, b]
        for da, db in ((1, 0), (-1, 0), (0, 1), (0, -1)):
            c, d = a + da, b + db
            if d < 0:
                matrix[n, n] -= 2
            elif 0 <= c < columns and d < rows and wet[c, d] and not (a == b and (da, db) in ((-1, 0), (0, 1))):
                matrix[n, n] -= 1
                matrix[n, number[c, d]] += 1
        if b == top - 1 and left <= a < left + legs:  # above the flat top, which goes down
            flux[n] += -S * CELL
        if a == left + legs and top <= b < top + legs:  # before the upright front
            flux[n] -= S * CELL
    potential = spsolve(matrix.tocsr(), flux)
    return float(-RHO * (potential * flux).sum())


def way_of(t: np.ndarray, glued: float = 0.0) -> np.ndarray:
    """The way down the ramp (n,) by theory at times (n,) [m], with a mass of `glued` fluid [kg/m]."""
    ways = np.arange(0, 5) * 4 * CELL / S
    masses = np.array([added_mass(4 * n) for n in range(5)])
    pull, own = (DENSITY - RHO) * VOLUME * G * S, DENSITY * VOLUME + glued
    s, v, now, out = 0.0, 0.0, 0.0, []
    for end in t:
        while now < end - 1e-12:
            dt = min(1e-4, end - now)
            m, slope = np.interp(s, ways, masses), np.interp(s, ways, np.gradient(masses, ways))
            v += dt * (pull - RHO * DRAG * ACROSS * v * abs(v) / 2 - slope * v * v / 2) / (own + m)
            s, now = s + dt * v, now + dt
        out.append(s)
    return np.array(out)


class Way(Measure):
    """The way down the ramp."""

    def begin(self, sim) -> None:
        self.start = sim.bodies.motion().position[0]
        self.time, self.way, self.off = [], [], 0.0
        self.glued = sim.glue.mass if sim.glue else 0.0

    def sample(self, sim) -> None:
        moved = sim.bodies.motion().position[0] - self.start
        self.time.append(sim.time)
        self.way.append(S * (moved[0] - moved[2]))
        self.off = max(self.off, abs(S * (moved[0] + moved[2])))

    def errors(self) -> dict[str, float]:
        t, way = np.array(self.time), np.array(self.way)
        early = way <= WAY
        t, way = t[early], way[early]
        return {"displacement": np.abs(way - way_of(t, self.glued)).max() / WAY, "off_ramp_m": self.off}


def _case(name: str, title: str, layers: int) -> Case:
    return Case(
        name,
        f"A wedge slides down a ramp of 45 degrees under water: {title}",
        "Theory: rigid body with added mass (potential flow) and drag, over the first 0.15 m; the geometry is that of"
        " Heinrich (1992).",
        {"coarse": 0.05, "medium": 0.025, "paper": 0.0125},
        _scene(layers),
        Way,
        {"displacement": 0.1, "off_ramp_m": 0.002},
        "The glued layer is as thick as a spacing: with it the slide is 10.5 % off at 50 mm, 3.1 % at 25 mm and 5.5 % at"
        " 12.5 mm.",
    )


NAMES = ("slide_contact", "slide_glued")
CASES = {
    "slide_contact": _case("slide_contact", "contact of body and ramp", 0),
    "slide_glued": _case("slide_glued", "two layers of fluid glued to its face", LAYERS),
}
