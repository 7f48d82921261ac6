"""The command `fsi`: arguments to calls, results to stdout, messages to stderr, errors to exit codes."""

from __future__ import annotations

import errno
import json
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import wraps
from pathlib import Path
from typing import Annotated, Literal

import typer
from typer.core import TyperCommand, TyperGroup

import fsi
from fsi import garbage, plugins, runner
from fsi.errors import RunError, SceneError, short
from fsi.messages import Messages, open_closed_streams
from fsi.progress import clock
from fsi.record.export import export
from fsi.record.manifest import read_manifest
from fsi.record.viewer import WebViewer, open_browser, open_window, recording_of
from fsi.scene.check_floating import floating_lines
from fsi.scene.file import builtin_scenes, load_scene, resolved_toml
from fsi.simulation.signals import at_once
from fsi.strict_json import dumps

SHARED = ("run", "resume")  # what several processes do together
FAILED, WRONG_INPUT, INTERRUPTED, TERMINATED = 1, 2, 130, 143


class Registered(TyperCommand):
    """A command that another package brings: its summary is read from its source, and it is imported when it runs."""

    def __init__(self, name: str):
        super().__init__(name, help=plugins.summary("commands", name))

    def make_context(self, info_name, args, parent=None, **extra):
        with exit_codes():
            function = plugins.find("commands", self.name)

        @wraps(function)
        def call(*values, **named):
            with exit_codes():
                return function(*values, **named)

        single = typer.Typer(add_completion=False, pretty_exceptions_enable=False, rich_markup_mode="markdown")
        single.command(self.name)(call)
        return typer.main.get_command(single).make_context(info_name, args, parent=parent, **extra)


class Commands(TyperGroup):
    """Our own commands, then those of the group `spindrift.commands`."""

    def list_commands(self, ctx) -> list[str]:
        own = list(self.commands)
        return [*own, *(name for name in plugins.registered("commands") if name not in own)]

    def get_command(self, ctx, cmd_name: str):
        if own := super().get_command(ctx, cmd_name):
            with exit_codes():
                plugins.check_ours("commands", cmd_name)
            return own
        return Registered(cmd_name) if cmd_name in plugins.registered("commands") else None


app = typer.Typer(
    cls=Commands,
    help="Explicit incompressible SPH, coupled to rigid bodies in MuJoCo.",
    no_args_is_help=True,
    rich_markup_mode="markdown",  # the default takes units in brackets for styles
    pretty_exceptions_enable=False,
)

SceneName = Annotated[str, typer.Argument(metavar="SCENE", help="A TOML file, or a name that `fsi cases` lists.")]
RunDirectory = Annotated[Path, typer.Argument(metavar="DIR", help="The folder of a run.")]
Settings = Annotated[list[str] | None, typer.Option("--set", metavar="A.B=VALUE", help="Replace a value of the scene.")]
Until = Annotated[float | None, typer.Option(metavar="T", help="Simulated time [s] in place of the scene's duration.")]
Level = Annotated[str | None, typer.Option(metavar="NAME", help="A table [levels.NAME] of the scene, such as paper.")]
Arrangement = Annotated[
    str | None,
    typer.Option(metavar="4x1x1", help="Processes along x, y and z, as mpiexec starts them; chosen if not given."),
]
Trust = Annotated[bool, typer.Option("--trust", help="Run the Python code that it names: docs/guide/trust.md.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print the result as JSON.")]


def _version(wanted: bool) -> None:
    if wanted:
        print(f"spindrift {fsi.__version__}")
        raise typer.Exit


@app.callback()
def options(
    context: typer.Context,
    version: Annotated[
        bool, typer.Option("--version", help="Print the version.", is_eager=True, callback=_version)
    ] = False,
) -> None:
    """Explicit incompressible SPH, coupled to rigid bodies in MuJoCo."""
    command, started = context.invoked_subcommand, runner.together() or 1
    if command not in SHARED:  # those begin to step later
        garbage.resume()
    if started > 1 and command not in SHARED:
        with exit_codes():
            fault = f"fsi {command} runs in one process, and {started} were started"
            raise SceneError(fault, fix=f"start it without mpiexec; {' and '.join(SHARED)} can be shared")


@contextmanager
def exit_codes() -> Iterator[None]:
    """End the command with its exit code and the error's own words."""
    try:
        yield
    except SceneError as error:
        code = _fail(error, WRONG_INPUT)
    except RunError as error:
        code = _fail(error, FAILED)
    except KeyboardInterrupt:
        code = _fail("interrupted", INTERRUPTED)
    except OSError as fault:
        if not fault.filename:
            raise
        code = _fail(f"{short(fault.filename)}: {fault.strerror}", WRONG_INPUT)
    else:
        return
    raise typer.Exit(code)


def _fail(error: object, code: int) -> int:
    Messages()(str(error))
    return code


def _result(text: str) -> None:
    """The result of a run on stdout: where nobody reads it, the run is no less done."""
    try:
        print(text, flush=True)
    except (OSError, ValueError) as fault:
        _lost(fault)


def _lost(fault: Exception) -> None:
    Messages()(f"stdout cannot be written: {getattr(fault, 'strerror', None) or fault}")
    with suppress(OSError):  # what waits to be written goes nowhere, and Python does not try again
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)


@app.command()
def run(
    scene: SceneName,
    settings: Settings = None,
    until: Until = None,
    level: Level = None,
    out: Annotated[Path | None, typer.Option(metavar="DIR", help="Folder of the run; runs/NAME if not given.")] = None,
    threads: Annotated[int | None, typer.Option(min=1, help="Threads; all cores if not given.")] = None,
    live: Annotated[bool, typer.Option("--live", help="Show the timeline in the browser as the run goes on.")] = False,
    viewer: Annotated[Literal["mujoco"] | None, typer.Option(help="Watch the bodies in MuJoCo's own viewer.")] = None,
    trust: Trust = False,
    quiet: Annotated[bool, typer.Option("--quiet", help="No progress and no messages.")] = False,
    ranks: Arrangement = None,
    as_json: AsJson = False,
) -> None:
    """Run a scene; `mpiexec -n 4 fsi run SCENE` shares it among four processes."""
    with exit_codes(), runner.joined(ranks) as member:
        result = runner.run(
            scene,
            out=out,
            until=until,
            threads=threads,
            overrides=settings or (),
            level=level,
            live=live,
            viewer=viewer,
            trust=trust,
            quiet=quiet,
            ranks=member,
        )
        if as_json:
            _result(dumps({"folder": str(result.folder), **read_manifest(result.folder)}))
        else:
            lost = f", {result.lost_particles} particles lost" if result.lost_particles else ""
            _result(
                f"{result.folder}: {result.status}, {result.simulated_seconds:g} s in {result.steps} steps, "
                f"{result.wall_seconds:.1f} s of wall time{lost}"
            )
        if result.exit_code:
            raise typer.Exit(result.exit_code)


@app.command()
def check(
    scene: SceneName,
    settings: Settings = None,
    until: Until = None,
    level: Level = None,
    measure: Annotated[
        int, typer.Option(min=0, metavar="STEPS", help="Run and time so many steps for a better estimate.")
    ] = 0,
    periods: Annotated[
        bool, typer.Option("--periods", help="The natural periods of the bodies too, by potential flow.")
    ] = False,
    threads: Annotated[int | None, typer.Option(min=1, help="Threads for --measure; all cores if not given.")] = None,
    ranks: Arrangement = None,
    as_json: AsJson = False,
) -> None:
    """Print the resolved scene, as TOML, and what a run of it would take. No code that it names is run."""
    with exit_codes():
        result = runner.check(
            scene,
            until=until,
            overrides=settings or (),
            level=level,
            measure=measure,
            periods=periods,
            threads=threads,
            ranks=ranks,
        )
        if as_json:
            print(dumps(result | {"scene": result["scene"].model_dump(mode="json")}))
            return
        print(resolved_toml(result["scene"]))
        shares = _rank_lines(result["ranks"]) if ranks else []
        floats = floating_lines(result["hydrostatics"])
        for line in (*result["waves"], *floats, *_estimate_lines(result["estimate"]), *shares):
            print(f"# {line}")
        for name, period in result.get("natural_periods", {}).items():
            print(f"# natural period, {name}: {period:.3g} s")
        for line in (*result["warnings"], *result["notes"]):
            Messages()(line)


def _estimate_lines(estimate: dict) -> list[str]:
    particles = {kind: estimate[kind] for kind in ("fluid", "wall", "body")}
    counts = ", ".join(f"{count} {kind}" for kind, count in particles.items())
    measured = [
        f"measured: {estimate['seconds_per_step']:.3g} s a step (median of {estimate['measured_steps']}, "
        f"threads: {estimate['threads']}), time step {estimate['time_step']:.3g} s"
    ] if "measured_steps" in estimate else []  # fmt: skip
    all_of_it = estimate["snapshot_particles"] >= particles["fluid"]
    some = "" if all_of_it else f" of the {particles['fluid']}"
    checkpoints = [
        f"checkpoints: {estimate['checkpoint_bytes'] / 1e6:.3g} MB each, the last two are kept; copying them takes about "
        f"{100 * estimate['checkpoint_share']:.2g} % of the run time"
    ] if estimate.get("checkpoint_bytes") else []  # fmt: skip
    return [
        f"particles: {sum(particles.values())} ({counts})",
        f"memory: {estimate['memory_bytes'] / 1e6:.0f} MB",
        *measured,
        f"run time: about {clock(estimate['seconds'])}, {estimate['steps']:.0f} steps",
        f"log: about {estimate['log_bytes'] / 1e6:.3g} MB: {estimate['snapshots']} snapshots of "
        f"{estimate['snapshot_particles']}{some} particles, {estimate['snapshot_bytes'] / 1e3:.3g} kB each, and "
        f"{estimate['series_frames']} frames of series, {estimate['series_bytes'] / 1e3:.3g} kB each",
        *checkpoints,
    ]


def _rank_lines(plan: dict) -> list[str]:
    unequal = plan["imbalance"]
    lines = [
        f"ranks: {'x'.join(map(str, plan['shape']))}; largest over mean: {unequal['equal']:.3f} of the particles in boxes "
        f"of equal size, {unequal['particles']:.3f} in boxes balanced by particles, {unequal['work']:.3f} of the work as a run "
        "balances it"
    ]
    axes = "xz" if len(plan["shape"]) == 2 else "xyz"
    for number, rank in enumerate(plan["ranks"]):
        sides = zip(axes, rank["low"], rank["high"], strict=True)
        ends = ((a, *("" if end is None else f"{end:.4g}" for end in both)) for a, *both in sides)
        box = ", ".join(f"{axis} {low}..{high}" for axis, low, high in ends if low or high)
        lines.append(
            f"rank {number}: {box or 'everything'}: {rank['fluid']} fluid, {rank['boundary']} boundary, "
            f"{rank['ghosts']} ghosts, work {rank['work']:.3f}, {rank['memory_bytes'] / 1e6:.0f} MB"
        )
    return lines


@app.command()
def resume(
    directory: RunDirectory,
    until: Until = None,
    threads: Annotated[int | None, typer.Option(min=1, help="Threads; all cores if not given.")] = None,
    trust: Trust = False,
    quiet: Annotated[bool, typer.Option("--quiet", help="No progress and no messages.")] = False,
    ranks: Arrangement = None,
) -> None:
    """Go on with a run that was interrupted or killed, from its last checkpoint; on any number of processes."""
    from fsi.resuming import resume as go_on

    with exit_codes(), runner.joined(ranks) as member:
        result = go_on(directory, until=until, threads=threads, trust=trust, quiet=quiet, ranks=member)
        _result(f"{result.folder}: {result.status}, {result.simulated_seconds:g} s in {result.steps} steps")
        if result.exit_code:
            raise typer.Exit(result.exit_code)


@app.command()
def recover(directory: RunDirectory) -> None:
    """Complete the log of a run that was killed, so that any MCAP reader opens it."""
    from fsi.resuming import recover as complete

    with exit_codes():
        print(complete(directory))


@app.command()
def view(
    directory: RunDirectory,
    web: Annotated[bool, typer.Option("--web", help="In the browser; served to this machine only.")] = False,
) -> None:
    """Open the timeline of a run."""
    with exit_codes():
        recording = recording_of(directory)
        if not web:
            if open_window(recording):
                raise typer.Exit(FAILED)
            return
        with WebViewer(recording) as viewer:
            print(f"{viewer.page}\npress Ctrl-C to end", flush=True)
            open_browser(viewer.page)
            viewer.wait()


@app.command("export")
def export_run(
    directory: RunDirectory,
    to: Annotated[
        Literal["nc", "csv", "vtk", "surface"],
        typer.Option(
            help="netCDF, or one wide CSV table; VTKHDF files of particles, bodies and walls, or of the fluid's surface."
        ),
    ] = "nc",
) -> None:
    """Write the time series of a run as a netCDF or CSV file, or its particles, bodies or surface for ParaView."""
    with exit_codes():
        if to in ("vtk", "surface"):
            print("\n".join(map(str, plugins.function("vtk")(directory, to))))
        else:
            print(export(directory, to))


@app.command()
def cases(as_json: AsJson = False) -> None:
    """List the built-in scenes."""
    with exit_codes():
        scenes = {name: load_scene(path).description for name, path in builtin_scenes().items()}
        if as_json:
            print(json.dumps(scenes))
            return
        width = max(map(len, scenes), default=0)
        for name, description in scenes.items():
            print(f"{name:{width}}  {description}")


def main() -> None:
    """The command `fsi`. After a signal nothing is waited for any more: queues kill what lingers."""
    open_closed_streams()
    code: object = 0
    try:
        with at_once(Messages()):
            app()
    except SystemExit as ended:
        code = ended.code
    except OSError as fault:
        if fault.filename or fault.errno not in (errno.ENOSPC, errno.EIO, errno.EPIPE, errno.EBADF):
            raise
        _lost(fault)
        code = FAILED
    try:
        sys.stdout.flush()
    except (OSError, ValueError) as fault:
        _lost(fault)
        code = code or FAILED
    if code in (INTERRUPTED, TERMINATED):
        Messages().flush()
        os._exit(code)
    raise SystemExit(code)
