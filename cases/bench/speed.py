"""Speed of the plain fluid: particle-steps and pairs a second, the share of each phase, and flatness over sizes."""

from __future__ import annotations

import resource
from collections.abc import Sequence

from cases.bench.block import PHASES, Block, measure
from cases.bench.pairs import pair_counts
from cases.bench.roofline import machine_peak, roofline

PASSES = {"predictor": 1, "first sweep": 1, "corrector": 1}  # of a step over all pairs, besides the further sweeps
LARGE = 2_000_000  # particles, from which on two rounds have to do


def speeds(sizes: dict[str, tuple[int, int]], threads: int, rounds: int, visit: float) -> tuple[list[dict], list[dict]]:
    """Rows of speed and of phases for each size, name -> (dimension, particles): one and all threads, one and four
    pressure sweeps, single and double precision."""
    rows, phases = [], []
    kinds = [(p, k, t) for p in ("single", "double") for k in (1, 4) for t in sorted({1, threads})]
    for name, (dimension, particles) in sizes.items():
        blocks = [Block(dimension, particles, precision=p, sweeps=k, threads=t) for p, k, t in kinds]
        measure(blocks, rounds, visit)
        counts = {p: pair_counts(next(b for b in blocks if b.precision == p).fluid) for p in ("single", "double")}
        for block in blocks:
            rows.append({"case": name} | speed(block, counts[block.precision]))
            phases.append({"case": name} | phase_shares(block))
    return rows, phases


def speed(block: Block, counts: dict[str, float]) -> dict:
    """A row of a block that was measured. Pairs: particles inside the support, and pairs that the lanes process, over all
    passes of a step."""
    step, n, passes = block.median(), block.fluid.count, sum(PASSES.values()) + block.sweeps - 1
    return {
        "dimension": block.fluid.dim,
        "particles": n,
        "precision": block.precision,
        "sweeps": block.sweeps,
        "threads": block.threads,
        "samples": len(block.samples),
        "step_s": step,
        "wall_s": block.median("wall"),
        "processor_s": block.median("processor"),
        "particle_steps_per_s": n / step,
        "ns_per_particle": block.nanoseconds(),
        "bytes_per_particle": block.fluid.nbytes / n,
        "lanes": block.fluid.lanes,
        **counts,
        "pairs_per_s": n * counts["neighbours"] * passes / step,
        "processed_pairs_per_s": n * counts["entries"] * block.fluid.lanes * passes / step,
    }


def phase_shares(block: Block) -> dict:
    """Nanoseconds per particle of each phase; "rest" is what is left of the step."""
    parts = {phase: block.nanoseconds(phase) for phase in PHASES}
    rest = max(0.0, block.nanoseconds() - sum(parts.values()))
    facts = {"precision": block.precision, "sweeps": block.sweeps, "threads": block.threads}
    return facts | {"ns": parts | {"rest": rest}}


def find(rows: list[dict], **facts) -> dict | None:
    """The row with these facts, if it was measured."""
    return next((row for row in rows if all(row.get(name) == value for name, value in facts.items())), None)


def ratios(rows: list[dict], phases: list[dict]) -> list[dict]:
    """All threads against one, and the cost of each further sweep [ns per particle] from the phases of one thread."""
    out = []
    for one in (row for row in rows if row["threads"] == 1):
        facts = {name: one[name] for name in ("case", "precision", "sweeps")}
        for row in rows:
            if row["threads"] > 1 and facts.items() <= row.items():
                speedup, effort = one["wall_s"] / row["wall_s"], row["processor_s"] / one["processor_s"]
                out.append(facts | {"threads": row["threads"], "speedup": speedup, "processor_ratio": effort})
        if one["sweeps"] > 1:
            further = find(phases, **facts, threads=1)["ns"]["further sweeps"] / (one["sweeps"] - 1)
            out.append(facts | {"threads": 1, "further_sweep_ns": further})
    return out


def rooflines(rows: list[dict], phases: list[dict], limits: dict) -> list[dict]:
    """Rooflines of every size on one thread with four pressure sweeps."""
    out = []
    for row in rows:
        if row["threads"] == 1 and row["sweeps"] == 4:
            facts = {name: row[name] for name in ("case", "precision")}
            shares = find(phases, **facts, sweeps=4, threads=1)["ns"]
            passes = PASSES | {"further sweeps": row["sweeps"] - 1}
            fluid = row | {"number_bytes": 4 if row["precision"] == "single" else 8}
            found = roofline(shares, passes, machine_peak(limits, row["precision"]), fluid)
            out += [facts | one for one in found]
    return out


def flatness(dimension: int, groups: Sequence[Sequence[int]], rounds: int, visit: float) -> list[dict]:
    """Time per particle-step over the size, in single precision on one thread, and the most memory that the process had
    in use so far; the sizes of a group are measured in turns."""
    rows = []
    for sizes in groups:
        blocks = [Block(dimension, particles) for particles in sizes]
        measure(blocks, rounds if max(sizes) < LARGE else min(rounds, 2), visit)
        for block in blocks:
            row = {"dimension": dimension, "particles": block.fluid.count, "ns_per_particle": block.nanoseconds()}
            row["bytes_per_particle"] = block.fluid.nbytes / block.fluid.count
            rows.append(row | {"peak_memory_gib": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20})
        del blocks, block  # before the next size takes its place
    return rows
