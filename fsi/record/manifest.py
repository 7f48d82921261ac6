"""`run.json`: what is known of a run beside its logs, and whether it still goes on."""

from __future__ import annotations

import os
import platform
import socket
from contextlib import suppress
from datetime import UTC, datetime
from functools import cache
from pathlib import Path

from fsi.errors import SceneError, short
from fsi.extras import version_of
from fsi.strict_json import dumps, loads

MANIFEST = "run.json"
SILENT = 60.0  # wall time [s] without a sign of life, after which a run on another machine counts as killed
PACKAGES = ("spindrift", "numpy", "numba", "mcap", "mujoco", "rerun-sdk")


def read_manifest(path: str | Path) -> dict:
    """The contents of `run.json`. Raises SceneError where the folder holds no run."""
    try:
        found = loads(Path(path, MANIFEST).read_text(encoding="utf-8"))
        if not isinstance(found, dict):
            raise ValueError
        return {"status": "", "reason": "", "versions": {}} | found
    except FileNotFoundError:
        raise SceneError(f"{short(path)} holds no run", fix="give the folder that `fsi run` named") from None
    except (OSError, ValueError) as fault:
        why = getattr(fault, "strerror", None) or "run.json is damaged"
        raise SceneError(f"{short(path)} holds no run: {why}", fix="give the folder that `fsi run` named") from None


def process() -> dict:
    """Who writes a run: for `liveness`."""
    return {"pid": os.getpid(), "host": socket.gethostname(), "heartbeat": now()}


def liveness(manifest: dict, claimed: bool = False) -> str:
    """The status of a run, with `killed` for one that was running and whose process is no more; `claimed`: the lock of its
    folder is ours, so that on this machine no other process can have it."""
    if manifest.get("status") != "running" or not {"pid", "host", "heartbeat"} <= manifest.keys():
        return manifest.get("status", "")
    if manifest["host"] == socket.gethostname() and (claimed or not _alive(int(manifest["pid"]))):
        return "killed"
    quiet = datetime.now(UTC) - datetime.fromisoformat(manifest["heartbeat"])
    return "killed" if quiet.total_seconds() > SILENT else "running"


def _alive(pid: int) -> bool:
    """Whether there is such a process; True where the system cannot be asked (on Windows a signal 0 would be Ctrl-C)."""
    if os.name != "posix":
        return True
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except (PermissionError, OverflowError):
        pass
    return True


def place_of(manifest: dict) -> str:
    return f" (process {manifest['pid']} on {manifest['host']})" if {"pid", "host"} <= manifest.keys() else ""


def now() -> str:
    return datetime.now(UTC).isoformat(timespec="seconds")


def overwrite(file: Path, before: dict, facts: dict) -> None:
    """Put status and reason into the manifest that is there, in the bytes that it takes already, if they fit."""
    ended = {key: facts[key] for key in ("status", "reason") if key in facts}
    if ended.get("status") == "done":
        ended = {"status": "failed", "reason": "the disk is full: run.json could not be written"}
    text = dumps(before | ended, separators=(",", ":")).encode()
    with suppress(OSError), file.open("r+b") as stream:
        if len(text) <= (room := len(stream.read())):
            stream.seek(0)
            stream.write(text.ljust(room))


@cache
def versions() -> dict[str, str]:
    """Of the packages that a run and its logs depend on."""
    found = {"python": platform.python_version()}
    return found | {package: number for package in PACKAGES if (number := version_of(package))}


def circumstances() -> dict:
    """When, where and with what a run is computed."""
    machine = {
        "system": platform.platform(),
        "processor": _processor(),
        "cores": os.cpu_count(),
        **(
            {"memory_bytes": os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")} if hasattr(os, "sysconf") else {}
        ),
    }
    return {"started": datetime.now(UTC).isoformat(), "versions": versions(), "machine": machine}


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor()
    return next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), platform.machine())
