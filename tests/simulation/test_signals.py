"""Signals and lost streams: a run ends within two seconds of a signal, also while it compiles, and outlives its terminal."""

import contextlib
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import fsi
from fsi.messages import Messages
from fsi.simulation.signals import CAUGHT, at_once

RUN = [sys.executable, "-m", "fsi", "run", "still_water", "--set", "spacing=0.1", "--set", "output.timeline=false",
       "--threads", "1"]  # fmt: skip
IMPORTING = """
import sys, time

class Slow:
    def find_spec(self, name, *_):
        if name == "typer":
            print("importing", flush=True)
            time.sleep(30)

sys.meta_path.insert(0, Slow())
from fsi.start import main
main()
"""
COMPILING = """
import sys, threading, time
import numba, numpy
from fsi.messages import Messages
from fsi.simulation.signals import at_once
lines = "\\n".join(f"    x[{n}] = numpy.sin(x[{n + 1}]) * x[{n + 2}] + {n}" for n in range(3000))
scope = {"numpy": numpy}
exec(f"def long(x):\\n{lines}", scope)
with at_once(Messages()):
    print("compiling", flush=True)
    numba.njit(scope["long"])(numpy.zeros(4000))
"""


@pytest.mark.parametrize("number", ["SIGUSR1"])
def test_a_signal_ends_the_compiler_too(number):
    child = subprocess.Popen(
        [sys.executable, "-c", COMPILING], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert child.stdout.readline() == "compiling\n"
    time.sleep(0.5)
    child.send_signal(getattr(signal, number))
    _, said = child.communicate(timeout=10)  # 2 s on a machine that is not busy
    assert child.returncode == 143 and said == f"stopped by {number}\n"


@pytest.mark.parametrize(("number", "code"), [("SIGTERM", 143), ("SIGINT", 130)])
def test_a_signal_ends_the_command_while_it_is_imported(number, code):
    child = subprocess.Popen(
        [sys.executable, "-c", IMPORTING], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert child.stdout.readline() == "importing\n"
    child.send_signal(getattr(signal, number))
    _, said = child.communicate(timeout=10)
    assert child.returncode == code and said == f"stopped by {number}\n"


def test_handlers_are_put_back_and_nohup_is_respected():
    before = {number: signal.getsignal(number) for number in CAUGHT}
    signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with at_once(Messages()) as caught:
            assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
            assert signal.getsignal(signal.SIGTERM) == caught._note
            assert signal.getsignal(signal.SIGINT) is before[signal.SIGINT]
    finally:
        signal.signal(signal.SIGHUP, before[signal.SIGHUP])
    assert {number: signal.getsignal(number) for number in CAUGHT} == before


@pytest.mark.slow
@pytest.mark.parametrize("after", [4.0, 14.0, 24.0])  # [s]: before the folder is made, and in the first step
def test_a_signal_ends_a_run_that_compiles(tmp_path, after):
    cold = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    child = subprocess.Popen([*RUN, "--until", "1e3", "--out", tmp_path / "run"], env=cold, stderr=subprocess.PIPE)
    time.sleep(after)
    child.terminate()
    child.communicate(timeout=2)
    assert child.returncode == 143
    if (tmp_path / "run").exists():
        assert json.loads((tmp_path / "run/run.json").read_text())["status"] == "interrupted"


@pytest.mark.parametrize("fault", ["full", "dead", "closed"])
def test_lost_messages_are_news_once(monkeypatch, fault):
    if fault == "dead":
        reader, writer = os.pipe()
        os.close(reader)
        stream = open(writer, "w")  # noqa: SIM115
    else:
        stream = open("/dev/full", "w")  # noqa: SIM115
    if fault == "closed":
        stream.close()
    monkeypatch.setattr(sys, "stderr", stream)
    say = Messages()
    assert say.new_fault() == ""
    say("hear me")
    reason = {"full": "No space left on device", "dead": "Broken pipe", "closed": "I/O operation on closed file."}[
        fault
    ]
    assert say.new_fault() == f"stderr cannot be written: {reason}" and say.new_fault() == ""
    with contextlib.suppress(OSError):
        stream.close()


def test_a_run_outlives_its_stderr(tmp_path, monkeypatch):
    with contextlib.suppress(OSError), open("/dev/full", "w") as full:  # it cannot be flushed
        monkeypatch.setattr(sys, "stderr", full)
        run = fsi.run(
            "still_water", overrides=["spacing=0.1", "output.timeline=false"], until=0.02, threads=1, out=tmp_path
        )
    [event] = [text for text in run.load().event_text.values if "messages are lost" in text]
    assert run.status == "done" and event == "messages are lost: stderr cannot be written: No space left on device"


def test_what_is_opened_next_does_not_become_stderr(tmp_path):
    """Without stderr the log would get its number, and what libraries write there would land in it."""
    code = (
        "import os; os.close(1); os.close(2)\n"
        "from fsi.messages import open_closed_streams; open_closed_streams()\n"
        "log = open('log', 'wb'); os.write(2, b'noise'); os.write(1, b'noise'); print('noise'); log.write(b'data')\n"
    )
    assert subprocess.run([sys.executable, "-c", code], cwd=tmp_path).returncode == 0
    assert (tmp_path / "log").read_bytes() == b"data"


@pytest.mark.slow
def test_a_full_stdout_does_not_undo_a_run(tmp_path):
    with open("/dev/full", "w") as full:
        done = subprocess.run(
            [*RUN, "--until", "0.02", "--out", tmp_path / "run"], stdout=full, stderr=subprocess.PIPE, text=True
        )
        assert done.returncode == 0 and "stdout cannot be written: No space left on device" in done.stderr
        listed = subprocess.run([sys.executable, "-m", "fsi", "cases"], stdout=full, stderr=subprocess.PIPE, text=True)
    assert (listed.returncode, listed.stderr) == (1, "stdout cannot be written: No space left on device\n")
    assert fsi.load_run(tmp_path / "run").attrs["status"] == "done"


ORPHAN = """
import subprocess, sys, time
from fsi.record.bound import bound
child = subprocess.Popen(bound([sys.executable, "-c", "import time; time.sleep(60)"]), start_new_session=True)
print(child.pid, flush=True)
time.sleep(60)
"""


@pytest.mark.parametrize("number", ["SIGKILL"])
def test_a_bound_child_does_not_outlive_its_parent(number):
    parent = subprocess.Popen([sys.executable, "-c", ORPHAN], stdout=subprocess.PIPE, text=True)
    child = int(parent.stdout.readline())
    time.sleep(0.5)
    os.kill(child, 0)
    parent.send_signal(getattr(signal, number))
    parent.wait()
    for _ in range(100):
        if gone(child):
            return
        time.sleep(0.1)
    raise AssertionError("the child lives on")


def gone(process: int) -> bool:
    """Whether a process has ended; one that nobody has waited for yet has."""
    try:
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] == "Z"
    except OSError:
        try:
            os.kill(process, 0)
        except ProcessLookupError:
            return True
        return False
