"""How boxes of ranks follow the water: `python -m cases.bench.decomposition SCENE --ranks 2x2x2 --times 0,0.25,0.5`.

A run in one process, as fine as is asked for, gives the places of the fluid; its boxes are then cut for the scene at the
`--like` level, in slices one spacing of that level thick, with its boundary particles, and each coarse particle for as many
fine ones as fill its volume. Nothing runs on several ranks. Printed are the largest over the mean number of particles, fluid
and boundary, in boxes of equal size, in those that were balanced at the start and in those that are balanced anew, by numbers
and by work (`fsi.ranks.balance`); `--out` draws the fluid coloured by rank.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fsi.particles.layout import build
from fsi.ranks.balance import near, planes_of
from fsi.ranks.decomposition import WEIGHTS, Decomposition, chosen_shape, imbalance
from fsi.scene.binding import bind
from fsi.scene.file import load_scene


@dataclass(frozen=True)
class Instant:
    """The fluid (n, dim) [m] at a time [s], its boxes as a run would cut them then, by work, and the imbalances by name."""

    time: float
    position: np.ndarray
    boxes: Decomposition
    imbalances: dict[str, float]


def study(scene: str, settings: list[str], like: str | None, arrangement: str, times: list[float]) -> Iterator[Instant]:
    """The instants of a run of the scene with these settings."""
    from fsi.simulation.loop import Simulation

    fine, coarse = load_scene(scene, [], like), load_scene(scene, settings)
    bodies, _, ground = bind(fine, fine.name)
    boundary = build(fine, bodies, ground).boundary
    size = int(np.prod([int(n) for n in arrangement.split("x")]))
    low, high = np.array(fine.tank.min, float), np.array(fine.tank.max, float)
    shape = chosen_shape(size, high - low, arrangement)
    equal = Decomposition.geometric(shape, low, high, np.full(len(low), fine.spacing))
    planes, each = planes_of(fine), (coarse.spacing / fine.spacing) ** fine.dimension
    sim, first = Simulation(coarse, threads=1), None
    for time in times:
        if time > sim.time:
            sim.run(time)
        fluid = sim.fluid.position.copy()
        everything = np.concatenate([fluid, boundary])
        wet = near(fluid, boundary, 2 * max(fine.smoothing_length, coarse.smoothing_length))
        number = np.concatenate([np.full(len(fluid), each), np.ones(len(boundary))])
        work = np.concatenate([np.full(len(fluid), each), np.where(wet, WEIGHTS["wet"], WEIGHTS["dry"])])

        def balanced(weight, everything=everything) -> Decomposition:
            def count(axis, planes):
                slices = np.searchsorted(planes, everything[:, axis], side="right")
                return np.bincount(slices, weight, len(planes) + 1)

            return equal.balanced(planes, count)

        def of(boxes, weight, everything=everything) -> float:
            return imbalance(np.bincount(boxes.rank_of(everything), weight, size))

        by_number, by_work = balanced(number), balanced(work)
        first = first or (by_number, by_work)
        found = {
            "equal boxes": of(equal, number), "numbers, boxes of the start": of(first[0], number),
            "numbers": of(by_number, number), "work, boxes of the start": of(first[1], work), "work": of(by_work, work),
        }  # fmt: skip
        yield Instant(sim.time, fluid, by_work, found)
    sim.close()


def draw(instants: list[Instant], title: str, file: Path) -> None:
    """The fluid from the side and from above, coloured by rank, a row for each instant."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    views = (
        ((0, 2, "x [m]", "z [m]"), (0, 1, "x [m]", "y [m]"))
        if instants[0].position.shape[1] == 3
        else ((0, 1, "x [m]", "z [m]"),)
    )
    figure = Figure((5.2 * len(views), 2.4 * len(instants) + 0.4), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(len(instants), len(views), squeeze=False, sharex=True)
    figure.suptitle(title)
    for row, instant in zip(axes, instants, strict=True):
        boxes = instant.boxes
        mixed = (boxes.rank_of(instant.position) * 7) % boxes.size  # so that neighbours differ
        for ax, (a, b, along, up) in zip(row, views, strict=True):
            order = np.argsort(-instant.position[:, 3 - a - b]) if len(views) > 1 else slice(None)
            ax.scatter(
                *instant.position[order][:, [a, b]].T,
                c=mixed[order],
                s=1.5,
                cmap="nipy_spectral",
                vmin=-1,
                vmax=boxes.size,
                lw=0,
            )
            for cut in boxes.cuts[a]:
                ax.axvline(cut, color="0.6", lw=0.5)
            for cut in boxes.cuts[b]:
                ax.axhline(cut, color="0.6", lw=0.5)
            ax.set(xlabel=along, ylabel=up, aspect="equal")
        row[0].set_title(f"{instant.time:.2f} s", loc="left", fontsize=9)
    figure.savefig(file, dpi=110)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scene")
    parser.add_argument("--ranks", required=True, metavar="NxNxN")
    parser.add_argument("--times", default="0", metavar="S,S,...", help="instants [s]")
    parser.add_argument("--like", help="the level whose spacing and boundary count")
    parser.add_argument(
        "--set", action="append", default=[], metavar="A.B=VALUE", help="of the run that gives the places"
    )
    parser.add_argument("--out", type=Path, help="a picture")
    options = parser.parse_args()
    instants = []
    for instant in study(
        options.scene, options.set, options.like, options.ranks, [float(t) for t in options.times.split(",")]
    ):
        told = "  ".join(f"{name} {value:.3f}" for name, value in instant.imbalances.items())
        print(f"{instant.time:6.2f} s  {told}", flush=True)
        instants.append(instant)
    if options.out:
        draw(instants, f"{options.scene} on {options.ranks} ranks", options.out)


if __name__ == "__main__":
    main()
