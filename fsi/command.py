"""The command `fsi`: arguments to calls, results to stdout, messages to stderr, errors to exit codes."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Literal

import typer
from rich.console import Console

from fsi import runner
from fsi.errors import RunError, SceneError
from fsi.progress import clock
from fsi.record.run_folder import export, read_manifest
from fsi.record.viewer import WebViewer, open_browser, open_window, recording_of
from fsi.scene.file import builtin_scenes, load_scene, resolved_toml

FAILED, WRONG_INPUT, INTERRUPTED = 1, 2, 130

app = typer.Typer(
    help="Explicit incompressible SPH, coupled to rigid bodies in MuJoCo.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)

SceneName = Annotated[str, typer.Argument(metavar="SCENE", help="A TOML file, or a name that `fsi cases` lists.")]
RunDirectory = Annotated[Path, typer.Argument(metavar="DIR", help="The folder of a run.")]
Settings = Annotated[list[str] | None, typer.Option("--set", metavar="A.B=VALUE", help="Replace a value of the scene.")]
Until = Annotated[float | None, typer.Option(metavar="T", help="Simulated time [s] in place of the scene's duration.")]
Level = Annotated[str | None, typer.Option(metavar="NAME", help="A table [levels.NAME] of the scene, such as paper.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print the result as JSON.")]


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
    else:
        return
    raise typer.Exit(code)


def _fail(error: object, code: int) -> int:
    print(error, file=sys.stderr)
    return code


@app.command()
def run(
    scene: SceneName,
    settings: Settings = None,
    until: Until = None,
    level: Level = None,
    out: Annotated[Path | None, typer.Option(metavar="DIR", help="Folder of the run; runs/NAME if not given.")] = None,
    threads: Annotated[int | None, typer.Option(min=1, help="Threads; all cores if not given.")] = None,
    live: Annotated[bool, typer.Option("--live", help="Show the timeline in the browser as the run goes on.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", help="No progress and no messages.")] = False,
    as_json: AsJson = False,
) -> None:
    """Run a scene."""
    with exit_codes():
        result = runner.run(
            scene,
            out=out,
            until=until,
            threads=threads,
            overrides=settings or (),
            level=level,
            live=live,
            quiet=quiet,
        )
        if as_json:
            print(json.dumps({"folder": str(result.folder), **read_manifest(result.folder)}))
        else:
            print(
                f"{result.folder}: {result.status}, {result.simulated_seconds:g} s in {result.steps} steps, "
                f"{result.wall_seconds:.1f} s of wall time"
            )
        if result.status == "interrupted":
            raise typer.Exit(INTERRUPTED)


@app.command()
def check(
    scene: SceneName,
    settings: Settings = None,
    until: Until = None,
    level: Level = None,
    measure: Annotated[
        int, typer.Option(min=0, metavar="STEPS", help="Run and time so many steps for a better estimate.")
    ] = 0,
    threads: Annotated[int | None, typer.Option(min=1, help="Threads for --measure; all cores if not given.")] = None,
    as_json: AsJson = False,
) -> None:
    """Print the resolved scene, as TOML, and what a run of it would take."""
    with exit_codes():
        result = runner.check(
            scene, until=until, overrides=settings or (), level=level, measure=measure, threads=threads
        )
        if as_json:
            print(json.dumps(result | {"scene": result["scene"].model_dump(mode="json")}, default=float))
            return
        print(resolved_toml(result["scene"]))
        for line in (*result["waves"], *_estimate_lines(result["estimate"])):
            print(f"# {line}")
        for line in (*result["warnings"], *result["notes"]):
            print(line, file=sys.stderr)


def _estimate_lines(estimate: dict) -> list[str]:
    particles = {kind: estimate[kind] for kind in ("fluid", "wall", "body")}
    counts = ", ".join(f"{count} {kind}" for kind, count in particles.items())
    measured = [
        f"measured: {estimate['seconds_per_step']:.3g} s a step (median of {estimate['measured_steps']}, "
        f"threads: {estimate['threads']}), time step {estimate['time_step']:.3g} s"
    ] if "measured_steps" in estimate else []  # fmt: skip
    return [
        f"particles: {sum(particles.values())} ({counts})",
        f"memory: {estimate['memory_bytes'] / 1e6:.0f} MB",
        *measured,
        f"run time: about {clock(estimate['seconds'])}, {estimate['steps']:.0f} steps",
        f"log: about {estimate['log_bytes'] / 1e6:.3g} MB: {estimate['snapshots']} snapshots of "
        f"{estimate['snapshot_particles']} particles, {estimate['snapshot_bytes'] / 1e3:.3g} kB each, and "
        f"{estimate['series_frames']} frames of series, {estimate['series_bytes'] / 1e3:.3g} kB each",
    ]


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
    to: Annotated[Literal["nc", "csv"], typer.Option(help="netCDF, or one wide CSV table.")] = "nc",
) -> None:
    """Write the time series of a run as a netCDF or CSV file."""
    with exit_codes():
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


@app.command()
def validate(
    names: Annotated[
        list[str] | None,
        typer.Argument(metavar="CASE", help="Cases, groups, patterns such as 'still_*', or 'defaults'; all if none."),
    ] = None,
    level: Annotated[
        list[str] | None,
        typer.Option(metavar="coarse|medium|paper|fine", help="Resolution; coarse if none. Repeatable."),
    ] = None,
    solver: Annotated[
        list[str] | None, typer.Option(metavar="NAME", help="Variant of the numerics; the default if none. Repeatable.")
    ] = None,
    out: Annotated[Path | None, typer.Option(metavar="DIR", help="Folder of rows, plots and VALIDATION.md.")] = None,
    threads: Annotated[int | None, typer.Option(min=1, help="Threads; all cores if not given.")] = None,
    jobs: Annotated[int, typer.Option(min=1, help="Runs at a time, each on a core of its own, with one thread.")] = 1,
    figures: Annotated[bool, typer.Option("--figures", help="A page with pictures for each run.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", help="No progress.")] = False,
    as_json: AsJson = False,
) -> None:
    """Measure the solver against exact answers and experiments."""
    with exit_codes():
        result = runner.validate(
            names or (),
            levels=level or (),
            solvers=solver or (),
            out=out,
            threads=threads,
            jobs=jobs,
            figures=figures,
            quiet=quiet,
        )
        if as_json:
            print(json.dumps([row.as_dict() for row in result.rows]))
        else:
            console = Console()
            console.width = max(console.width, 100)  # the table's, also where the output is no terminal
            for part in result.tables():
                console.print(part)
            print(f"written to {result.report}")
        if result.failures:
            raise RunError("\n".join(result.failures))


@app.command()
def bench(
    quick: Annotated[bool, typer.Option("--quick", help="A trial on tiny sizes, whose figures mean nothing.")] = False,
    large: Annotated[bool, typer.Option("--large", help="Also sizes of up to 20 million particles.")] = False,
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help="The report; BENCHMARK.md if not given, none with --quick.")
    ] = None,
    quiet: Annotated[bool, typer.Option("--quiet", help="No progress.")] = False,
    as_json: AsJson = False,
) -> None:
    """Measure speed, memory and start-up on this machine."""
    with exit_codes():
        result = runner.bench(quick=quick, large=large, out=out, quiet=quiet)
        if as_json:
            print(json.dumps(result.result))
            return
        for table in result.tables():
            Console().print(table)
        if result.report:
            print(f"written to {result.report}")


@app.command()
def sweep(
    study: Annotated[Path, typer.Argument(metavar="STUDY", help="A study file, see docs/studies.md.")],
    workers: Annotated[
        int | None, typer.Option(min=0, help="Worker processes; as many as there are cores if not given.")
    ] = None,
    scheduler: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="A Dask scheduler, e.g. tcp://host:8786, in place of workers.")
    ] = None,
    threads: Annotated[int, typer.Option(min=1, help="Threads of each worker.")] = 1,
    out: Annotated[Path | None, typer.Option(metavar="DIR", help="Folder of the study; studies/NAME if none.")] = None,
    csv: Annotated[bool, typer.Option("--csv", help="Also write the table as CSV.")] = False,
    parquet: Annotated[bool, typer.Option("--parquet", help="Also write the table as Parquet.")] = False,
    retry: Annotated[bool, typer.Option("--retry", help="Run failed runs again.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", help="No progress.")] = False,
    as_json: AsJson = False,
) -> None:
    """Run a parameter study, or go on with one that was stopped."""
    with exit_codes():
        options = {"workers": workers, "scheduler": scheduler, "threads": threads, "retry": retry, "quiet": quiet}
        result = runner.sweep(study, out=out, **options)
        from cases.study.summary import summary, summary_lines

        facts = summary(result, [kind for kind, wanted in (("csv", csv), ("parquet", parquet)) if wanted])
        print(json.dumps(facts, default=float) if as_json else "\n".join(summary_lines(facts)))
        if facts["runs"] and not facts["done"]:
            raise RunError(f"all {facts['runs']} runs failed: {facts['reasons'][0]}")
        if failed := facts["runs"] - facts["done"]:
            raise RunError(f"{failed} of {facts['runs']} runs failed")


@app.command()
def report(directory: Annotated[Path, typer.Argument(metavar="DIR", help="The folder of a run or a study.")]) -> None:
    """Write the report of a run or a study: one HTML page, and its plots as PNG."""
    with exit_codes():
        print(runner.report(directory))


def main() -> None:
    """The command `fsi`."""
    app()
