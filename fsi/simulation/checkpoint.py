"""Checkpoints of a run: the whole state of a simulation in a file that is complete or is not there.

The file, NAME.checkpoint: 16 bytes of magic with the format's number, the SHA-256 of all that follows, the length of a
header, the header (JSON: facts, and the tree of the state), then the arrays of the state one after the other. Nothing in
it is code. It is written under another name, brought to the disk and renamed.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
import struct
import time as clock
from collections.abc import Callable, Iterator
from pathlib import Path
from queue import SimpleQueue
from threading import Thread

import numpy as np

from fsi.errors import SceneError
from fsi.record.manifest import versions
from fsi.scene.file import resolved_toml
from fsi.scene.model import Scene

MAGIC = b"spindrift-ckpt-2"
HEADER_LIMIT, LIMIT = 64 * 2**20, 2**40  # bytes of a header and of a file that are read
KEPT = 2  # checkpoints of a run
FOLDER, SUFFIX = "checkpoints", ".checkpoint"
PACKAGES = ("spindrift", "numpy", "numba", "mujoco")  # those that the bits of a result depend on
KINDS = "biuf"  # of numbers in arrays


def write(file: Path, facts: dict, state: dict) -> int:
    """Write a checkpoint in one go; the bytes it takes. OSError where that fails, and nothing is left then."""
    arrays: list[np.ndarray] = []
    header = json.dumps({"facts": facts, "state": _packed(state, arrays)}, allow_nan=False).encode()
    parts = [struct.pack("<Q", len(header)), header, *(memoryview(a.reshape(-1).view(np.uint8)) for a in arrays)]
    digest = hashlib.sha256()
    for part in parts:
        digest.update(part)
    new = file.with_suffix(".new")
    try:
        with new.open("wb") as stream:
            stream.writelines([MAGIC, digest.digest(), *parts])
            stream.flush()
            os.fsync(stream.fileno())
        os.replace(new, file)
        if os.name == "posix":
            folder = os.open(file.parent, os.O_RDONLY)
            os.fsync(folder)
            os.close(folder)
    except OSError:
        new.unlink(missing_ok=True)
        raise
    return len(MAGIC) + digest.digest_size + sum(len(part) for part in parts)


def read(file: Path) -> tuple[dict, dict]:
    """Facts and state of a checkpoint. Raises SceneError where it is damaged, or of another format."""
    fix = "resume from the other checkpoint, or run the scene again"
    try:
        if file.stat().st_size > LIMIT:
            raise SceneError(f"larger than {LIMIT / 2**30:.0f} GiB", file=file, fix=fix)
        data = file.read_bytes()
    except OSError as fault:
        raise SceneError(f"cannot be read: {fault.strerror}", file=file, fix=fix) from None
    if not data.startswith(MAGIC):
        raise SceneError("no checkpoint of this format", file=file, fix="use the version of Spindrift that wrote it")
    start = len(MAGIC) + 32
    if hashlib.sha256(memoryview(data)[start:]).digest() != data[len(MAGIC) : start]:
        raise SceneError("damaged: its checksum is another", file=file, fix=fix)
    (length,) = struct.unpack_from("<Q", data.ljust(start + 8, b"\xff"), start)
    if length > HEADER_LIMIT:
        raise SceneError("its header is too large", file=file, fix=fix)
    try:
        header = json.loads(data[start + 8 : start + 8 + length])
        return header["facts"], _unpacked(header["state"], _arrays(header["state"], data, start + 8 + length))
    except (ValueError, TypeError, LookupError, AttributeError, RecursionError) as fault:
        if isinstance(fault, SceneError):
            raise
        raise SceneError(f"cannot be understood: {fault}", file=file, fix=fix) from None


def _packed(value, arrays: list[np.ndarray]):
    """The tree with {"": [dtype, shape, number]} for each array and each number that JSON would change."""
    if isinstance(value, dict):
        return {key: _packed(item, arrays) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_packed(item, arrays) for item in value]
    if isinstance(value, np.ndarray | np.generic) or (isinstance(value, float) and not math.isfinite(value)):
        array = np.ascontiguousarray(value)
        if array.dtype.kind not in KINDS:
            raise TypeError(f"a state holds numbers, not {array.dtype}")
        arrays.append(array)
        kind = "" if isinstance(value, np.ndarray) else "number" if isinstance(value, np.generic) else "float"
        return {"": [array.dtype.str, list(np.shape(value)), len(arrays) - 1, kind]}
    return value


def _leaves(tree) -> Iterator[list]:
    if isinstance(tree, dict):
        if "" in tree:
            yield tree[""]
        else:
            for item in tree.values():
                yield from _leaves(item)
    elif isinstance(tree, list):
        for item in tree:
            yield from _leaves(item)


def _arrays(tree, data: bytes, at: int) -> dict[int, np.ndarray]:
    found = {}
    for dtype, shape, number, _ in sorted(_leaves(tree), key=lambda leaf: leaf[2]):
        kind = np.dtype(dtype)
        if kind.kind not in KINDS:
            raise SceneError(f"a checkpoint holds numbers, not {kind}", fix="run the scene again")
        if min(shape, default=0) < 0:
            raise ValueError(f"an array of shape {shape}")
        count = math.prod(shape)
        found[number] = np.frombuffer(data, kind, count, at).reshape(shape).copy()
        at += count * kind.itemsize
    return found


def _unpacked(tree, arrays: dict[int, np.ndarray]):
    if isinstance(tree, dict):
        if "" in tree:
            _, _, number, kind = tree[""]
            array = arrays[number]
            return float(array) if kind == "float" else array[()] if kind == "number" else array
        return {key: _unpacked(item, arrays) for key, item in tree.items()}
    return [_unpacked(item, arrays) for item in tree] if isinstance(tree, list) else tree


def circumstances(scene: Scene) -> dict:
    """What a state depends on besides itself: the scene, and the packages that compute."""
    found = {name: number for name, number in versions().items() if name in PACKAGES}
    return {"scene": resolved_toml(scene), "versions": found}


def files(folder: Path) -> list[Path]:
    """The checkpoints of a run folder, the newest first."""
    return sorted(Path(folder, FOLDER).glob(f"*{SUFFIX}"), reverse=True)


class Checkpoints:
    """Writes checkpoints of a simulation beside it, on a thread of its own: one every `every` seconds of wall time.

    `seconds` is the time that they took of the run so far; faults of the disk go to `say` and cost the checkpoint alone.
    """

    def __init__(self, sim, folder: Path, every: float, say: Callable[[str], None] = lambda line: None):
        self._sim, self._folder, self._every, self._say = sim, folder / FOLDER, every, say
        self._facts = circumstances(sim.scene)
        self._last, self.seconds, self.bytes = clock.monotonic(), 0.0, 0
        self._queue: SimpleQueue = SimpleQueue()
        self._thread = Thread(target=self._serve, name="checkpoint", daemon=True)
        self._thread.start()

    @property
    def due(self) -> bool:
        """Whether it is time for the next one."""
        return clock.monotonic() - self._last >= self._every

    def take(self) -> None:
        """Copy the state now; it is written when the recorders have come as far. Steps must not go on during the call."""
        begin = clock.perf_counter()
        sim = self._sim
        facts = self._facts | {"time": sim.time, "step": sim.step_count}
        try:
            state, positions = sim.state(), {}
        except TypeError as fault:  # a part from elsewhere: the run goes on without checkpoints
            self._every = math.inf
            self._say(f"no checkpoints: {fault}")
            return
        self._last = clock.monotonic()
        if sim.ranks and not sim.ranks.root:  # whose state is part of the root's
            return
        waiting = [recorder for recorder in sim.recorders if hasattr(recorder, "mark")]

        def arrived(position: dict) -> None:
            positions.update(position)
            self._queue.put((facts, state | {"log": positions}))

        for recorder in waiting[:1]:
            recorder.mark(arrived)
        if not waiting:
            arrived({})
        self.seconds += clock.perf_counter() - begin
        self._last = clock.monotonic()

    def close(self) -> None:
        """Wait for the last one. The recorders must have ended before."""
        self._queue.put(None)
        self._thread.join()

    def _serve(self) -> None:
        while (job := self._queue.get()) is not None:
            try:
                self._folder.mkdir(exist_ok=True)
                self.bytes = write(self._folder / f"{job[0]['step']:012d}{SUFFIX}", *job)
                for old in files(self._folder.parent)[KEPT:]:
                    old.unlink(missing_ok=True)
            except OSError as fault:
                self._say(f"no checkpoint at t = {job[0]['time']:.4g} s: {fault.strerror}")
