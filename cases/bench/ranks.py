"""What it costs to share a step among ranks: `fsi bench --ranks 2`, or `python -m cases.bench.ranks SCENE` under mpiexec.

A run on so many ranks with one thread each is timed beside one in one process with as many threads, by the clock and by the
processor time that each takes without waiting: this one says what ranks cost also where others use the machine, or where
there are more ranks than processors. For that each rank steps the whole scene alone as well, by turns. Each rank says how
long it waited, what share of its work was the exchange of ghosts and of particles, and what it sent: bytes of a step by
purpose, and for each surface cell, a cube of a support around which ghosts stand.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import time as clock
from statistics import median

from fsi.errors import RunError, SceneError
from fsi.scene.file import load_scene

STEPS, WARM = 10, 3  # timed, and before
TANK = "tank_still"


def timed(scene: str, settings: list[str], steps: int, threads: int, member=None) -> dict:
    """Times of the steps of a scene on this rank, or in this process: `seconds` of a step, the median; and on ranks `busy`, the
    processor time of one without waiting; `alone`, that of a step of the whole scene; `waited`, the share of the time that
    it waited for others; `exchanged`, that of its work which the exchange took; `sent`, the bytes of a step by purpose;
    `own` and `ghosts`, its particles."""
    from fsi.simulation.loop import Simulation

    sim = Simulation(load_scene(scene, settings), threads=threads, ranks=member)
    whole = Simulation(load_scene(scene, settings), threads=1) if member else None
    marks, uses, alone, waited, sent, exchanged = [], [], [], 0.0, {}, 0.0
    for step in range(WARM + steps):
        if step == WARM and member:
            member.ranks.barrier()
            waited, sent, exchanged = member.ranks.waited, dict(member.ranks.sent), sim.fluid.halo.used
        begin, used = clock.perf_counter(), _used(member)
        sim.step()
        if step >= WARM:
            marks.append(clock.perf_counter() - begin)
            uses.append(_used(member) - used)
        if whole:
            used = clock.process_time()
            whole.step()
            alone += [clock.process_time() - used] if step >= WARM else []
    position = sim.fluid.particles.position
    facts = {"seconds": median(marks), "particles": sim.fluid.labels, "boundary": len(sim.fluid.owner)}
    if member:
        ranks, halo = member.ranks, sim.fluid.halo
        per_cell = (2 * sim.scene.smoothing_length / sim.scene.spacing) ** sim.fluid.dim
        own = {
            "busy": median(uses),
            "alone": median(alone),
            "exchanged": (halo.used - exchanged) / sum(uses),
            "waited": (ranks.waited - waited) / sum(marks),
            "sent": {purpose: (size - sent.get(purpose, 0)) / steps for purpose, size in ranks.sent.items()},
            "own": len(halo.own_key),
            "ghosts": halo.ghosts,
            "surface_cells": halo.ghosts / per_cell,
        }
        facts["ranks"] = ranks.comm.gather(own)
        facts["shape"] = list(halo.decomposition.shape)
        low, high = ranks.reduce(position.min(0), "min"), ranks.reduce(position.max(0), "max")
        facts["lengths"] = ((high - low) / sim.scene.spacing + 1).tolist()  # of the fluid, in spacings
    sim.close()
    return facts


def _used(member) -> float:
    """Processor time [s] of this process so far, without waiting for others."""
    return clock.process_time() - (member.ranks.spun if member else 0.0)


def cost_of_ranks(
    numbers: list[int], scene: str = TANK, settings: tuple[str, ...] = (), steps: int = STEPS
) -> list[dict]:
    """A row for each number of ranks: `ranks`, `seconds` of a step there and in one process with as many `threads`, the
    `speed` of the ranks over that of the threads, `busy` [s] of the busiest rank and a rank's part of the whole scene in one
    process, `work`, this over that on the busiest rank, bytes and waiting (`timed`). Raises RunError where a run fails."""
    rows = []
    for number in numbers:
        shared, alone = _child(number, scene, settings, steps), _child(1, scene, settings, steps, threads=number)
        each = shared.pop("ranks")
        total = sum(sum(rank["sent"].values()) for rank in each)
        rows.append(
            shared
            | {
                "ranks": number,
                "alone": alone["seconds"],
                "speed": alone["seconds"] / shared["seconds"],
                "busy": max(rank["busy"] for rank in each),
                "busy_mean": sum(rank["busy"] for rank in each) / number,
                "busy_alone": sum(rank["alone"] for rank in each) / number**2,
                "work": sum(rank["alone"] for rank in each) / number**2 / max(rank["busy"] for rank in each),
                "exchanged": max(rank["exchanged"] for rank in each),
                "waited": max(rank["waited"] for rank in each),
                "waited_mean": sum(rank["waited"] for rank in each) / number,
                "bytes_per_step": total,
                "bytes_per_surface_cell": total / max(1.0, sum(rank["surface_cells"] for rank in each)),
                "ghosts": sum(rank["ghosts"] for rank in each),
                "imbalance": max(rank["own"] for rank in each) * number / sum(rank["own"] for rank in each),
            }
        )
    return rows


def lines(rows: list[dict]) -> list[str]:
    """A table to print."""
    head = (
        "ranks  arrangement  ms/step, of threads  speed  busy ms, part of one  ratio  exchange  waited (most, mean)  MB/step  "
        "bytes/surface cell  ghosts"
    )
    table = [head]
    for row in rows:
        shape = "x".join(map(str, row["shape"]))
        table.append(
            f"{row['ranks']:5}  {shape:>11}  {1e3 * row['seconds']:7.1f}  {1e3 * row['alone']:10.1f}  {row['speed']:5.2f}  "
            f"{1e3 * row['busy']:7.1f}  {1e3 * row['busy_alone']:11.1f}  {row['work']:5.2f}  {100 * row['exchanged']:6.1f} %  "
            f"{100 * row['waited']:8.0f} %, {100 * row['waited_mean']:4.0f} %  {row['bytes_per_step'] / 1e6:7.3f}  "
            f"{row['bytes_per_surface_cell']:18.0f}  {row['ghosts']:6}"
        )
    return table


def _child(number: int, scene: str, settings: tuple[str, ...], steps: int, threads: int = 0) -> dict:
    """`timed` in processes of its own: on ranks, or alone with so many threads."""
    from fsi.ranks.start import from_wheel

    starter = [] if threads else [from_wheel("mpiexec") or "mpiexec", "-n", str(number)]
    options = ["--steps", str(steps), *(["--threads", str(threads)] if threads else [])]
    for setting in settings:
        options += ["--set", setting]
    command = [*starter, sys.executable, "-m", "cases.bench.ranks", scene, *options]
    try:
        done = subprocess.run(command, capture_output=True, text=True, env=os.environ)
    except FileNotFoundError:
        raise SceneError("no mpiexec", fix="install one with: pip install 'spindrift[mpi]'") from None
    if done.returncode:
        raise RunError(f"{' '.join(command)}: {done.stderr.strip()}")
    return json.loads(done.stdout.splitlines()[-1])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scene", nargs="?", default=TANK)
    parser.add_argument("--steps", type=int, default=STEPS)
    parser.add_argument("--threads", type=int, help="measure one process with so many threads, and no ranks")
    parser.add_argument("--set", action="append", default=[], metavar="A.B=VALUE")
    options = parser.parse_args()
    if options.threads:
        print(json.dumps(timed(options.scene, options.set, options.steps, options.threads)))
        return
    from fsi.runner import joined

    with joined() as member:
        found = timed(options.scene, options.set, options.steps, 1, member)
        if member is None or member.root:
            print(json.dumps(found))


if __name__ == "__main__":
    main()
