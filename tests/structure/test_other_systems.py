"""What only some systems have is on no common path: checked by hiding it, as macOS and Windows would."""

import subprocess
import sys
import textwrap

HIDE = """
import os, signal, sys

class Hidden:
    def find_spec(self, name, path=None, target=None):
        if name in ("fcntl", "resource", "termios", "pwd", "grp", "tty", "pty", "syslog"):
            raise ModuleNotFoundError(f"no module named {name!r} here", name=name)

sys.meta_path.insert(0, Hidden())
for name in ("fcntl", "resource", "termios", "pwd", "grp", "tty", "pty", "syslog"):
    sys.modules.pop(name, None)
for name in ("killpg", "fork", "sysconf", "sched_getaffinity", "sched_setaffinity", "setsid", "geteuid", "nice"):
    delattr(os, name)
for name in ("SIGKILL", "SIGHUP", "SIGUSR1", "SIGUSR2", "SIGXCPU", "SIGALRM", "pthread_kill", "alarm", "setitimer"):
    delattr(signal, name)
"""
RUN = """
import fsi
from fsi.command import app
from typer.testing import CliRunner

scene = fsi.Scene(
    name="small", spacing=0.05, duration=0.01, tank={"min": (0.0, -0.4), "max": (1.0, 0.3)}, output={"timeline": False}
)
fsi.check(scene)
run = fsi.run(scene, threads=1, quiet=True)
assert run.status == "done", run.reason
assert run.load().sizes["time"] == 2
for command in (["export", "runs/small", "--to", "csv"], ["cases"], ["check", "flap"], ["new", "flap"], ["--version"]):
    done = CliRunner().invoke(app, command)
    assert done.exit_code == 0, done.output
import bodies, couplers, cases.study, cases.pages, cases.pictures.export, fsi.record.viewer, fsi.resuming, fsi.environment
"""


def test_modules_and_calls_of_one_system_are_not_needed(tmp_path):
    done = subprocess.run(
        [sys.executable, "-c", HIDE + textwrap.dedent(RUN)],
        cwd=tmp_path, capture_output=True, text=True, timeout=300,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr


def test_the_viewer_ends_where_there_are_no_groups_of_processes(monkeypatch):
    import os

    from fsi.record.viewer import WebViewer

    monkeypatch.delattr(os, "killpg")
    viewer = WebViewer.__new__(WebViewer)
    viewer._process, viewer._ports = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(60)"]), ()
    viewer.__exit__()
    assert viewer._process.returncode is not None
