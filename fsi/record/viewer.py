"""The rerun viewer: in a window, or as a page in the browser that is served to this machine only."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import time
import webbrowser
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path

from fsi.errors import RunError, SceneError
from fsi.extras import require
from fsi.record.bound import bound

LOOPBACK = "127.0.0.1"
PATIENCE = 30.0  # [s] that the viewer may take to answer


def open_window(recording: Path) -> int:
    """Open a recording in a window and wait until it is closed; the viewer's exit status."""
    return subprocess.call(bound([*_command(), *_with_layers(recording), "--bind", LOOPBACK]))


class WebViewer:
    """A viewer in the browser, as a context: `page` is the address to open, `sink` the one that recorders send to.

    Both answer to this machine alone. With a recording it shows that, else what is sent. Raises RunError where it does
    not start."""

    def __init__(self, recording: Path | None = None):
        self._ports = data, page = _free_ports(2)
        self.sink = f"rerun+http://{LOOPBACK}:{data}/proxy"
        self.page = f"http://{LOOPBACK}:{page}/?url={self.sink.replace('+', '%2B')}"
        shown = _with_layers(recording) if recording else []
        served = ["--serve-web", "--bind", LOOPBACK, "--port", str(data), "--web-viewer-port", str(page)]
        self._command = [*_command(), *shown, *served]

    def __enter__(self) -> WebViewer:
        quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        # In a session of its own: Ctrl-C is for the run, and the viewer may be a child of the process that is started here.
        self._process = subprocess.Popen(bound(self._command), start_new_session=True, **quiet)
        end = time.monotonic() + PATIENCE
        while not all(map(_answers, self._ports)):
            if time.monotonic() > end or self._process.poll() is not None:
                self.__exit__()
                raise RunError("the viewer did not start; run without --web or --live, and look with `fsi view` later")
            time.sleep(0.05)
        return self

    def __exit__(self, *_) -> None:
        """End it, and the process that it has started in its turn."""
        for name in ("terminate", "kill"):
            with suppress(ProcessLookupError):
                if hasattr(os, "killpg"):
                    os.killpg(self._process.pid, signal.SIGTERM if name == "terminate" else signal.SIGKILL)
                else:  # Windows has no groups of processes
                    getattr(self._process, name)()
            end = time.monotonic() + 3.0
            while any(map(_answers, self._ports)) and time.monotonic() < end:
                time.sleep(0.02)
        self._process.wait()

    def wait(self) -> None:
        """Until the viewer ends by itself or Ctrl-C is pressed."""
        try:
            self._process.wait()
        except KeyboardInterrupt:
            return


def open_browser(page: str) -> None:
    """Open a page in the user's browser, where there is a screen to open it on."""
    if sys.platform != "linux" or os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"):
        webbrowser.open(page)


def recording_of(directory: Path) -> Path:
    """The recording of a run. Raises SceneError where it has none."""
    from fsi.record.mcap_reader import has_frames

    recording = directory / "run.rrd"
    if not recording.is_file():
        from fsi.record.manifest import read_manifest

        read_manifest(directory)
        fix = "run the scene with output.timeline = true, and with rerun installed: pip install 'spindrift[viewer]'"
        raise SceneError(f"{directory} has no timeline", fix=fix)
    if (log := directory / "run.mcap").is_file() and not has_frames(log):
        fix = "see run.json for how it ended"
        raise SceneError(f"{directory} holds a run without a single frame", fix=fix)
    return recording


def _with_layers(recording: Path) -> list[str]:
    """A recording, what waits to be part of it, and the layers that were made of it later (`fsi export --to surface`)."""
    layers = [recording.with_name(f"{recording.name}.tail"), recording.with_name("surface.rrd")]
    return [str(recording), *(str(layer) for layer in layers if layer.is_file())]


def _command() -> list[str]:
    """The viewer's program itself, where it lies beside its package: what stands between would not die with us."""
    require("rerun", "viewer", "the viewer")
    found = find_spec("rerun_cli")
    for folder in found.submodule_search_locations if found and found.submodule_search_locations else ():
        if os.access(program := Path(folder, "rerun"), os.X_OK):
            return [str(program)]
    return [sys.executable, "-m", "rerun"]


def _free_ports(count: int) -> list[int]:
    sockets = [socket.socket() for _ in range(count)]
    for one in sockets:
        one.bind((LOOPBACK, 0))
    ports = [one.getsockname()[1] for one in sockets]
    for one in sockets:
        one.close()
    return ports


def _answers(port: int) -> bool:
    with socket.socket() as one:
        one.settimeout(0.5)
        return one.connect_ex((LOOPBACK, port)) == 0
