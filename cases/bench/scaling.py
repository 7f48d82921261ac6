"""How a run on ranks scales beyond this machine: `python -m cases.bench.scaling [--measured FILE]`.

A step of a box of N fluid particles on P ranks takes

    T(P) = I N t / P + G g + R (n L + G b / B) + C L log2 P + S + W

t: seconds of a fluid particle with its sweeps, its share of the boundary included; I: imbalance, of whole slices; G: ghosts of
a rank, those in a layer of a support around its box and of another one near walls, at g seconds each to take in and to sort;
R: refreshes of ghosts in a step, b bytes each, over a network of latency L [s] and B [bytes/s] to n neighbours; C: reductions
over all ranks; S: serial time of a step (Python, MuJoCo in lockstep); W: the logged frames, which the root gathers. Exchange
and sweeps overlap in a run, and add up here.

The measured inputs are those of `fsi bench --ranks N --json`, see `measured`. What the source reports is printed beside the
prediction: scaling of an explicit ISPH code with boxes of cells on Compute Canada's Guillimin (JOEME 2017, doi
10.1007/s40722-016-0070-6). Its machine and its numerics are not ours, its minima of ranks are not given: the trend compares,
the figures need not.
"""

from __future__ import annotations

import argparse
import json
import math
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path

from fsi.particles.cells import EMPTY


@dataclass(frozen=True)
class Machine:
    """What a prediction rests on, in seconds and bytes; `threads` of a rank are within `particle`. The defaults: one core with
    AVX2 at 0.8 million particle-steps/s with six sweeps, and a network of InfiniBand's class."""

    particle: float = 1.25e-6  # of a fluid particle and step
    ghost: float = 1.5e-7  # of a ghost and step: append, sort, gather and scatter
    width: float = 4.1  # spacings that ghosts reach away from walls, a support at h = 2 dr
    walls: float = 4.1  # and how much farther near them
    refreshes: int = 9  # of ghosts in a step: trial velocities, the sweeps, the counts
    bytes_ghost: float = 10.0  # of a ghost in a refresh, the exchange at the start of a step spread over them
    latency: float = 2e-6
    bandwidth: float = 3e9  # of a rank
    reductions: int = 6  # over all ranks in a step
    serial: float = 1.5e-3
    logged: float = 0.0  # bytes of the frames that the root gathers, over all steps, of a particle and step


@dataclass(frozen=True)
class Case:
    """A box of fluid, `sides` long, of so many `millions` of particles, and on how many ranks which efficiency was reported."""

    name: str
    sides: tuple[float, float, float]
    millions: float
    ranks: tuple[int, ...]
    reported: dict[int, float]


STILL = (2.0, 2.0, 1.0)
BOX = (1.23, 1.0, 0.55)
CASES = (
    *(Case("still tank", STILL, m, (1, 8, 64, 256, 512), {512: 0.83} if m == 265 else {}) for m in (4.6, 10.5, 66.5, 265.0)),
    Case("short box", BOX, 0.75, (1, 16, 64, 256), {}),
    Case("short box", BOX, 1.9, (1, 16, 64, 256), {64: 0.35}),
    Case("short box", BOX, 10.5, (1, 16, 64, 256), {256: 0.60}),
    Case("short box", BOX, 40.0, (1, 16, 64, 256), {256: 0.90}),
    Case("still tank", STILL, 1000.0, (512, 4096), {}),
)  # fmt: skip


@dataclass(frozen=True)
class Prediction:
    """Of a case on so many ranks: seconds of a step by part, and the arrangement."""

    shape: tuple[int, int, int]
    compute: float
    unbalanced: float
    ghosts: float
    messages: float
    reductions: float
    serial: float

    @property
    def seconds(self) -> float:
        return self.compute + self.unbalanced + self.ghosts + self.messages + self.reductions + self.serial

    @property
    def largest_loss(self) -> str:
        """What costs most besides the computation itself."""
        parts = ("unbalanced", "ghosts", "messages", "reductions", "serial")
        return max(parts, key=lambda part: getattr(self, part))


def predict(sides: tuple[float, ...], particles: float, ranks: int, machine: Machine) -> Prediction:
    """A step of a box full of fluid on the arrangement of ranks that takes the least time."""
    spacing = (math.prod(sides) / particles) ** (1 / 3)
    lengths = [side / spacing for side in sides]  # in particles
    divisors = [n for n in range(1, ranks + 1) if ranks % n == 0]
    shapes = (s for s in product(divisors, repeat=3) if math.prod(s) == ranks)
    return min((_step(lengths, particles, shape, machine) for shape in shapes), key=lambda p: p.seconds)


def _step(lengths: list[float], particles: float, shape: tuple[int, int, int], m: Machine) -> Prediction:
    ranks, own = math.prod(shape), [length / n for length, n in zip(lengths, shape, strict=True)]
    largest = math.prod(math.ceil(length) / length if n > 1 else 1.0 for length, n in zip(own, shape, strict=True))
    around = [length + m.width * min(2, n - 1) for length, n in zip(own, shape, strict=True)]
    ghosts = math.prod(around) - math.prod(own) + _beyond(lengths, own, shape, m)
    neighbours = math.prod(min(3, n) for n in shape) - 1
    compute = particles / ranks * m.particle
    return Prediction(
        shape,
        compute,
        (largest - 1) * compute,
        ghosts * m.ghost,
        m.refreshes * (neighbours * m.latency + ghosts * m.bytes_ghost / m.bandwidth) if ranks > 1 else 0.0,
        m.reductions * m.latency * math.log2(ranks) if ranks > 1 else 0.0,
        m.serial + m.logged * particles / m.bandwidth,
    )


def _beyond(lengths: list[float], own: list[float], shape: tuple[int, int, int], m: Machine) -> float:
    """Ghosts of a rank in the second support, where they are within one of the floor or of a wall; there is none on top."""
    total = 0.0
    for d in range(3):
        first, second = (e for e in range(3) if e != d)
        open_area = 1.0
        for e in (first, second):
            near = m.width * (1 if e == 2 else 2) / lengths[e]  # share of the tank's side, on a rank as on the mean
            open_area *= max(0.0, 1 - near)
        total += min(2, shape[d] - 1) * m.walls * own[first] * own[second] * (1 - open_area)
    return total


def validation(rows: list[dict], machine: Machine) -> list[str]:
    """What the model says of measured rows, with the inputs of the row of the fewest ranks alone, line by line."""
    machine = measured(rows, machine)
    table = ["ranks  arrangement  ms busy, predicted  kB/step, predicted  ghosts, predicted"]
    for row in rows:
        found = _step(row["lengths"], row["particles"], tuple(row["shape"]), machine)
        number, ghosts = row["ranks"], found.ghosts / machine.ghost if machine.ghost else 0.0
        busy = found.compute + found.ghosts
        sent = number * ghosts * machine.bytes_ghost * machine.refreshes
        table.append(
            f"{number:5}  {'x'.join(map(str, row['shape'])):>11}  {1e3 * row['busy_mean']:7.2f}  {1e3 * busy:9.2f}  "
            f"{1e-3 * row['bytes_per_step']:7.0f}  {1e-3 * sent:9.0f}  {row['ghosts']:6}  {number * ghosts:9.0f}"
        )
    return table


def efficiency(case: Case, ranks: int, machine: Machine) -> float:
    """Speed on so many ranks over that of the fewest of the case, for each rank."""
    first = case.ranks[0]
    sizes = case.sides, 1e6 * case.millions
    return predict(*sizes, first, machine).seconds * first / (predict(*sizes, ranks, machine).seconds * ranks)


def measured(rows: list[dict], machine: Machine | None = None) -> Machine:
    """The machine of rows of `cases.bench.ranks.cost_of_ranks`, of that of the fewest ranks: the time of a particle from the
    run in one process, that of a ghost from what the ranks take beyond it and do not wait for."""
    machine, row = machine or Machine(), min(rows, key=lambda r: r["ranks"])
    particle = row["busy_alone"] * row["ranks"] / row["particles"]
    busy = row["busy_mean"] - row["particles"] / row["ranks"] * particle
    ghosts = row["ghosts"] / row["ranks"]
    bytes_ghost = row["bytes_per_step"] / row["ghosts"] / machine.refreshes
    return replace(machine, particle=particle, ghost=max(0.0, busy / ghosts), bytes_ghost=bytes_ghost)


LIMITS_RANK = 4e9  # bytes of memory of a rank: 256 GB for 64 cores


def limits(sides: tuple[float, ...], particles: float, ranks: int, steps_frame: int = 10) -> list[tuple[float, str]]:
    """(how often over its limit, what) of everything that does not shrink with the number of ranks, the worst first."""
    spacing = (math.prod(sides) / particles) ** (1 / 3)
    cells = math.prod(side / (f * spacing) + 8 for side, f in zip(sides, (1.0, 1.75, 1.75), strict=True))
    surface = 2 * (sides[0] * sides[1] + sides[1] * sides[2] + sides[0] * sides[2]) / spacing**2 * 4
    grid = min(cells, EMPTY * particles / ranks)
    whole = 100 * (particles + surface)
    found = [
        (whole / LIMITS_RANK, f"every rank builds the whole scene: {whole / 1e9:.3g} GB before it keeps its part"),
        (
            12 * grid / LIMITS_RANK,
            f"a rank's grid of the whole tank, kept up to {EMPTY} cells a particle of the rank: {12 * grid / 1e9:.3g} GB",
        ),
        (
            60 * particles / (8 * LIMITS_RANK),
            f"a checkpoint and a frame of particles are gathered: {60 * particles / 1e9:.3g} GB",
        ),
        (particles / 2**31, f"labels are 32 bits wide: {particles / 2**31:.2g} of them are used"),
        (cells / 2**31, f"places in the order of cells are 32 bits wide: {cells / 2**31:.2g} of them are used"),
        (cells / 2**40, f"keys have 40 bits for a cell: {cells / 2**40:.2g} of them are used"),
        (
            ranks * 16 / 1e6,
            f"each rank tells each other how much it sends, twice a step: {ranks * 16 / 1e3:.3g} kB of {ranks} messages",
        ),
        (
            max(sides) / spacing / 2**20,
            f"positions in single precision: {max(sides) / spacing * 2**-23:.2g} spacings are the last bit",
        ),
    ]
    return sorted(found, reverse=True)


def report(machine: Machine) -> list[str]:
    """The tables, line by line."""
    table = ["case        million  ranks  arrangement  s/step    efficiency  reported  largest loss"]
    for case in CASES:
        for ranks in case.ranks:
            found = predict(case.sides, 1e6 * case.millions, ranks, machine)
            told = f"{100 * case.reported[ranks]:.0f} %" if ranks in case.reported else ""
            shape = "x".join(map(str, found.shape))
            table.append(
                f"{case.name:10}  {case.millions:7.4g}  {ranks:5}  {shape:>11}  {found.seconds:8.3g}  "
                f"{100 * efficiency(case, ranks, machine):8.0f} %  {told:>8}  {found.largest_loss if ranks > 1 else ''}"
            )
    table += ["", "a billion particles on 4,096 ranks; share of the limit, the worst first:"]
    return table + [f"{share:9.3g}  {what}" for share, what in limits(STILL, 1e9, 4096)]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--measured", type=Path, help="the JSON of `fsi bench --ranks N --json`")
    parser.add_argument("--latency", type=float, default=Machine.latency, help="seconds of a message")
    parser.add_argument("--bandwidth", type=float, default=Machine.bandwidth, help="bytes a second of a rank")
    options = parser.parse_args()
    machine = Machine(latency=options.latency, bandwidth=options.bandwidth)
    if options.measured:
        rows = json.loads(options.measured.read_text())
        print("\n".join([*validation(rows, machine), ""]))
        machine = measured(rows, machine)
    print("\n".join(report(machine)))


if __name__ == "__main__":
    main()
