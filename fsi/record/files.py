"""Files that are whole or not there, and folders that one process at a time writes to."""

from __future__ import annotations

import errno
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

FULL = (
    errno.ENOSPC,
    errno.EDQUOT,
    errno.EFBIG,
)  # faults of a disk that is full, of a quota, of a limit to a file's size


@contextmanager
def new_file(file: Path) -> Iterator[Path]:
    """A path to write to, whose file takes the place of `file` when all has gone well; else nothing of it is left."""
    new = file.with_name(f"{file.name}.{os.getpid()}.new")
    try:
        yield new
        os.replace(new, file)
    except BaseException:
        with suppress(OSError):
            new.unlink(missing_ok=True)
        raise


def write_text(file: Path, text: str) -> None:
    """Write a text file in one go."""
    with new_file(file) as new:
        new.write_text(text, encoding="utf-8")


def write_all(file: BinaryIO, data: bytes) -> None:
    """Append to a file that has no buffer. OSError where that fails, and the file is then as it was."""
    start, rest = file.tell(), memoryview(data)
    try:
        while rest:
            rest = rest[file.write(rest) :]
    except OSError:
        with suppress(OSError):
            file.truncate(start)
            file.seek(start)
        raise


def same_place(path: Path, written: os.stat_result) -> None:
    """OSError where `path` is no longer the file that is written to."""
    try:
        here = path.stat()
    except FileNotFoundError:
        raise OSError(errno.ENOENT, "the file was removed while the run went on", str(path)) from None
    if not os.path.samestat(here, written):
        raise OSError(errno.ESTALE, "the file was replaced while the run went on", str(path))


class Claim:
    """A lock on a file, held by one process until it lets go or dies, however it dies. The file is not there after `drop`,
    and is of no account where a kill has left it."""

    def __init__(self, file: Path):
        self.file = file
        self._lock = None

    def take(self, wait: bool = False) -> bool:
        """Whether it is ours now; with `wait`, after whoever has it. OSError where the file cannot be written."""
        from filelock import FileLock, Timeout  # only where something is written

        lock = FileLock(str(self.file), timeout=-1 if wait else 0, thread_local=False)
        while self._lock is None:
            try:
                lock.acquire()
            except Timeout:
                return False
            if self.file.exists():
                self._lock = lock
            else:  # its last holder has removed it since it was opened
                lock.release()
        return True

    def drop(self) -> None:
        """Let go; a second call does nothing."""
        lock, self._lock = self._lock, None
        if lock:
            if os.name == "posix":  # while nobody else can hold it
                with suppress(OSError):
                    self.file.unlink()
            lock.release()
            with suppress(OSError):
                if os.name != "posix":
                    self.file.unlink()

    @property
    def held(self) -> bool:
        return self._lock is not None


@contextmanager
def claimed(file: Path, wait: bool = False) -> Iterator[bool]:
    """Hold the lock of a file inside; whether it could be had."""
    claim = Claim(file)
    try:
        yield claim.take(wait)
    finally:
        claim.drop()
