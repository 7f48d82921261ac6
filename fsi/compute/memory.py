"""How much memory a process may still take."""

from __future__ import annotations

import math
import os
from pathlib import Path

UNLIMITED = 1 << 60  # bytes; what control groups without a limit say is larger


def free_memory() -> float:
    """Bytes that this process can take: what the machine has free, and what its control groups and limits leave."""
    return min([_of_machine(), *_of_groups(), *_of_limits()])


def _of_machine() -> float:
    for line in _lines(Path("/proc/meminfo")):
        if line.startswith("MemAvailable:"):
            return 1024.0 * int(line.split()[1])
    if not hasattr(os, "sysconf"):  # on Windows
        return math.inf
    return float(os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"))


def _of_groups() -> list[float]:
    """What is left of the limits of the process's control groups, all the way up (versions 1 and 2)."""
    left = []
    for line in _lines(Path("/proc/self/cgroup")):
        _, kinds, place = line.split(":", 2)
        if kinds and "memory" not in kinds.split(","):
            continue
        root = Path("/sys/fs/cgroup/memory" if kinds else "/sys/fs/cgroup")
        limit, used = ("memory.limit_in_bytes", "memory.usage_in_bytes") if kinds else ("memory.max", "memory.current")
        group = root / place.strip("/")
        for folder in {group, *group.parents, root} if ".." not in group.parts else {root}:
            most, now = _number(folder / limit), _number(folder / used)
            if most is not None and now is not None and most < UNLIMITED:
                left.append(max(0.0, most - now + _cache(folder)))
    return left


def _cache(folder: Path) -> float:
    """Bytes of files kept in memory, which a group gives up when it needs room."""
    rows = (line.split() for line in _lines(folder / "memory.stat"))
    return next((float(value) for name, value in rows if name in ("inactive_file", "total_inactive_file")), 0.0)


def _of_limits() -> list[float]:
    """What the limit of the process's address space leaves of it."""
    try:
        import resource
    except ImportError:  # not on Windows
        return []
    most, _ = resource.getrlimit(resource.RLIMIT_AS)
    pages = _lines(Path("/proc/self/statm"))
    if most == resource.RLIM_INFINITY or not pages:
        return []
    return [max(0.0, most - float(pages[0].split()[0]) * os.sysconf("SC_PAGE_SIZE"))]


def _number(file: Path) -> float | None:
    lines = _lines(file)
    return float(lines[0]) if lines and lines[0].strip().isdigit() else None


def _lines(file: Path) -> list[str]:
    try:
        return file.read_text().splitlines()
    except OSError:
        return []
