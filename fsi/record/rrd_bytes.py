"""The messages of a recording, `.rrd`: a head, then messages, each after its kind and its length; it ends after any of them."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from pathlib import Path

HEAD = 12  # bytes before the first message
MESSAGE = struct.Struct("<QQ")  # before each: its kind and its length
END, STORE, DATA, LAYOUT = 0, 1, 2, 3  # kinds


def messages(data: bytes) -> Iterator[tuple[int, bytes]]:
    """Kind and content of the messages of a file, or of several one after the other, up to where one is cut off."""
    at = HEAD
    while at + MESSAGE.size <= len(data):
        kind, length = MESSAGE.unpack_from(data, at)
        at += MESSAGE.size
        if at + length > len(data):
            return
        yield kind, data[at : at + length]
        at += length
        if kind == END:  # after it stands a directory, and then perhaps another file
            at = data.find(data[:HEAD], at)
            if at < 0:
                return
            at += HEAD


def whole_bytes(file: Path) -> int:
    """Up to where a recording that may be cut off holds whole messages; all of one that was closed."""
    size = file.stat().st_size
    with file.open("rb") as stream:
        at = HEAD
        while at + MESSAGE.size <= size:
            stream.seek(at)
            kind, length = MESSAGE.unpack(stream.read(MESSAGE.size))
            if kind == END:
                return size
            if at + MESSAGE.size + length > size:
                break
            at += MESSAGE.size + length
    return at if size >= HEAD else 0


def packed(kind: int, body: bytes) -> bytes:
    """A message as it stands in a file."""
    return MESSAGE.pack(kind, len(body)) + body
