"""The commands of `fsi` that need more than `fsi`: validation, benchmarks, studies and reports.

Each is an entry point of the group `spindrift.commands` (`fsi.plugins`); what a command needs is imported when it runs.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from fsi import runner
from fsi.command import AsJson, Settings, Trust
from fsi.errors import RunError
from fsi.strict_json import dumps


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
    trust: Trust = False,
    pages: Annotated[
        bool, typer.Option("--pages", help="Run nothing: write a page for each case from kept rows.")
    ] = False,
    quiet: Annotated[bool, typer.Option("--quiet", help="No progress.")] = False,
    as_json: AsJson = False,
) -> None:
    """Measure the solver against exact answers and experiments."""
    if pages:
        from cases.validation.engine.validate import pages as write_pages

        print("\n".join(map(str, write_pages(names or (), out=out))))
        return
    result = runner.validate(
        names or (),
        levels=level or (),
        solvers=solver or (),
        out=out,
        threads=threads,
        jobs=jobs,
        figures=figures,
        trust=trust,
        quiet=quiet,
    )
    if as_json:
        print(dumps([row.as_dict() for row in result.rows]))
    else:
        console = Console()
        console.width = max(console.width, 100)  # the table's, also where the output is no terminal
        for part in result.tables():
            console.print(part)
        print(f"written to {result.report}")
    if result.failures:
        raise RunError("\n".join(result.failures))


def bench(
    quick: Annotated[bool, typer.Option("--quick", help="A trial on tiny sizes, whose figures mean nothing.")] = False,
    large: Annotated[bool, typer.Option("--large", help="Also sizes of up to 20 million particles.")] = False,
    only_users: Annotated[
        bool,
        typer.Option("--users", help="Only what users run and the time to equal error; replaces both in the report."),
    ] = False,
    against: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Another checkout, the state before, stepped in turns with this one."),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help="The report; BENCHMARK.md if not given, none with --quick.")
    ] = None,
    ranks: Annotated[
        list[int] | None,
        typer.Option(min=2, metavar="N", help="Only what it costs to share a step among N ranks. Repeatable."),
    ] = None,
    scene: Annotated[str, typer.Option(metavar="SCENE", help="The scene for --ranks.")] = "tank_still",
    settings: Settings = None,
    quiet: Annotated[bool, typer.Option("--quiet", help="No progress.")] = False,
    as_json: AsJson = False,
) -> None:
    """Measure speed, memory and start-up on this machine."""
    if ranks:
        from cases.bench.ranks import cost_of_ranks, lines

        rows = cost_of_ranks(ranks, scene, tuple(settings or ()))
        print(dumps(rows) if as_json else "\n".join(lines(rows)))
        return
    result = runner.bench(quick=quick, large=large, only_users=only_users, against=against, out=out, quiet=quiet)
    if as_json:
        print(dumps(result.result))
        return
    for table in result.tables():
        Console().print(table)
    if result.report:
        print(f"written to {result.report}")


def sweep(
    study: Annotated[
        Path, typer.Argument(metavar="STUDY", help="A study file, see docs/guide/studies.md; a scene with --radiation.")
    ],
    radiation: Annotated[
        bool, typer.Option("--radiation", help="Move every joint of a scene by force: added mass and damping.")
    ] = False,
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
    trust: Trust = False,
    quiet: Annotated[bool, typer.Option("--quiet", help="No progress.")] = False,
    as_json: AsJson = False,
) -> None:
    """Run a parameter study, or go on with one that was stopped."""
    options = {
        "workers": workers,
        "scheduler": scheduler,
        "threads": threads,
        "retry": retry,
        "trust": trust,
        "quiet": quiet,
    }
    source: object = study
    if radiation:
        from cases.study.radiation import radiation_study

        source = radiation_study(study)
    result = runner.sweep(source, out=out, **options)
    from cases.study.summary import summary, summary_lines

    facts = summary(result, [kind for kind, wanted in (("csv", csv), ("parquet", parquet)) if wanted])
    print(dumps(facts) if as_json else "\n".join(summary_lines(facts)))
    if facts["runs"] and not facts["done"]:
        raise RunError(f"all {facts['runs']} runs failed: {facts['reasons'][0]}")
    if failed := facts["runs"] - facts["done"]:
        raise RunError(f"{failed} of {facts['runs']} runs failed")


def report(
    directories: Annotated[
        list[Path],
        typer.Argument(metavar="DIR...", help="The folder of a run or a study; of two or more, to compare them."),
    ],
    scale: Annotated[
        float | None, typer.Option(metavar="N", help="Full size over model: figures at full scale by Froude's law.")
    ] = None,
    scatter: Annotated[
        Path | None,
        typer.Option(metavar="CSV", help="How often which sea occurs (Hs, Tp): mean annual energy of a power matrix."),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help="The page of a comparison; comparison.html if not given.")
    ] = None,
) -> None:
    """Write the report of a run or a study, or compare several: one HTML page, and its plots as PNG."""
    print(runner.report(*directories, scale=scale, scatter=scatter, out=out))


def new(
    kind: Annotated[str, typer.Argument(metavar="KIND", help="flap, float, flume or coast.")],
    out: Annotated[Path | None, typer.Option(metavar="DIR", help="Folder of the files; KIND if not given.")] = None,
) -> None:
    """Write a commented scene to start from."""
    from cases.new import new as write

    scene, *others = write(kind, out or Path(kind))
    print("\n".join(map(str, (scene, *others))))
    print(f"run it by: fsi run {scene}")


def schema() -> None:
    """Print the JSON schema of a scene file, for editors."""
    from fsi.scene.schema import scene_schema

    print(dumps(scene_schema(), indent=2))
