"""The viewer in a real browser: the scene is seen, from a file and while a run goes on, and by this machine alone."""

import io
import os
import re
import socket
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from browser import CHROMIUM, Browser
from stand_in import event, frame

import fsi
from fsi.errors import SceneError
from fsi.record.background import open_recorders
from fsi.record.colours import colour_map

pytest.importorskip("rerun")
from fsi.record.timeline import TimelineRecorder
from fsi.record.timeline_marks import GAUGE
from fsi.record.viewer import WebViewer

needs_browser = pytest.mark.skipif(not CHROMIUM, reason="no Chromium")


def seen(png: bytes) -> dict[str, int]:
    """Pixels of a picture in the colours of the particles, by third of the colour map, and of the gauges."""
    from matplotlib.image import imread

    pixels = np.round(255 * imread(io.BytesIO(png))[..., :3]).astype(int).reshape(-1, 3)
    colours = {"low": colour_map()[8:60:4], "middle": colour_map()[100:150:4], "high": colour_map()[200:250:4]}
    colours["gauge"] = np.array([[GAUGE >> 24, GAUGE >> 16 & 255, GAUGE >> 8 & 255]])
    near = {name: (np.abs(pixels[:, None] - c).max(2) <= 12).any(1) for name, c in colours.items()}
    return {name: int(found.sum()) for name, found in near.items()}


def shows_the_scene(browser: Browser, seconds: float) -> dict[str, int]:
    """What is seen, once everything is, or after so long."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        time.sleep(2)
        picture = browser.picture()
        found = seen(picture)
        if all(count > 300 for count in found.values()):
            break
    if folder := os.environ.get("SPINDRIFT_PICTURES"):
        Path(folder, f"{os.environ['PYTEST_CURRENT_TEST'].split('::')[1].split(' ')[0]}.png").write_bytes(picture)
    return found


def test_it_serves_this_machine_only(scene, flap, tmp_path):
    recorder = TimelineRecorder(tmp_path / "run.rrd")
    recorder.begin(scene, flap)
    recorder.end()
    with WebViewer(tmp_path / "run.rrd") as viewer:
        ports = {int(port) for port in re.findall(r":(\d+)/", viewer.page)}
        assert len(ports) == 2
        listening = [line.split() for line in Path("/proc/net/tcp").read_text().splitlines()[1:]]
        listening += [line.split() for line in Path("/proc/net/tcp6").read_text().splitlines()[1:]]
        addresses = {int(port, 16): host for host, port in (row[1].split(":") for row in listening if row[3] == "0A")}
        assert {addresses[port] for port in ports} == {"0100007F"}  # 127.0.0.1
    for port in ports:
        with socket.socket() as one:
            assert one.connect_ex(("127.0.0.1", port)) != 0  # nothing is left behind


def test_the_live_view_gets_all_that_the_file_gets(scene, flap, tmp_path):
    with WebViewer() as viewer:
        [recorder] = open_recorders(fsi.load_scene(scene, ["output.timeline=true"]), tmp_path, viewer.sink)
        recorder.begin(fsi.load_scene(scene, ["output.timeline=true"]), flap)
        recorder.event(event("start"))
        for step in range(20):
            recorder.series(frame(step))
        recorder.particles(frame(20))
        recorder.end()
    assert (tmp_path / "run.rrd").stat().st_size > 10_000


def test_live_needs_the_timeline(scene, tmp_path):
    with pytest.raises(SceneError, match=r"output.timeline: the live view shows the timeline; set it to true"):
        open_recorders(scene, tmp_path, live="rerun+http://127.0.0.1:1/proxy")


@needs_browser
@pytest.mark.slow
def test_run_is_seen_in_the_browser(tmp_path):
    settings = ["spacing=0.05", "duration=2", "waves.wave_height=0.2"]
    run = fsi.run("flap", overrides=settings, out=tmp_path / "run", quiet=True, threads=1)
    with WebViewer(run.folder / "run.rrd") as viewer, Browser(1200, 900) as browser:
        browser.open(viewer.page + "&renderer=webgl")
        found = shows_the_scene(browser, 120)
    assert min(found.values()) > 300, found


@needs_browser
@pytest.mark.slow
def test_run_is_seen_while_it_goes_on(tmp_path):
    command = [sys.executable, "-m", "fsi", "run", "flap", "--live", "--set", "spacing=0.05", "--until", "600"]
    run = subprocess.Popen([*command, "--out", tmp_path / "run", "--threads", "1"], stderr=subprocess.PIPE, text=True)
    try:
        page = next(line.split()[2] for line in run.stderr if line.startswith("live view: "))
        with Browser(1200, 900) as browser:
            browser.open(page + "&renderer=webgl")
            found = shows_the_scene(browser, 120)
        assert run.poll() is None
        assert min(found.values()) > 300, found
    finally:
        run.terminate()
        assert run.wait(60) == 130
