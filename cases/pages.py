"""The page of a folder, whatever it holds: a run or a study; or of several, which are compared."""

from __future__ import annotations

from pathlib import Path

from fsi.errors import SceneError


def report(
    *directories: str | Path,
    scale: float | None = None,
    scatter: str | Path | None = None,
    out: str | Path | None = None,
) -> Path:
    """Write the page of the folder of a run or of a study and return its file, `report.html` in it; of two or more folders the
    page that compares them, `out` (`comparison.html`). `scale` is full size over model: figures at full scale by Froude's law;
    `scatter` is a table of seas, from which a power matrix makes the mean annual energy. Raises SceneError where a folder holds
    neither run nor study, or an option has nothing to act on."""
    if len(directories) > 1:
        for key, value in (("--scale", scale), ("--scatter", scatter)):
            if value is not None:
                raise SceneError("is of no use to a comparison", key=key, fix="write the report of one folder with it")
        return _compared([Path(directory) for directory in directories], Path(out or "comparison.html"))
    if out is not None:
        fix = "leave it out: the page is report.html in the folder"
        raise SceneError("is the page of a comparison", key="--out", fix=fix)
    [directory] = directories
    if Path(directory, "run.json").is_file():
        if scatter is not None:
            raise SceneError("is of no use to a run", key="--scatter", fix="give the folder of a power matrix study")
        from cases.report.run import report as of_run

        return of_run(directory, scale=scale)
    from cases.study.report import report as of_study

    return of_study(directory, scale=scale, scatter=scatter)


def _compared(folders: list[Path], out: Path) -> Path:
    """Write the page of folders that are all of runs or all of studies. Raises SceneError where they are mixed, too many, or
    `out` is a file that is no page of ours."""
    from cases.report.charts import COLOURS
    from cases.report.compare import of_runs, short_names
    from cases.report.page import MADE_BY

    if len(folders) > len(COLOURS):
        raise SceneError(f"{len(folders)} folders", key="DIR", fix=f"compare at most {len(COLOURS)} at a time")
    if out.is_dir() or (out.is_file() and MADE_BY not in out.read_text(encoding="utf-8", errors="replace")[:2000]):
        raise SceneError(f"{out} is something else than a page of Spindrift", key="--out", fix="name another file")
    runs = [Path(folder, "run.json").is_file() for folder in folders]
    names = short_names(folders)
    if all(runs):
        return of_runs(folders, names).write(out)
    if any(runs):
        odd, run = folders[runs.index(False)], folders[runs.index(True)]
        raise SceneError(f"{odd} holds no run, {run} does", fix="compare runs with runs, studies with studies")
    from cases.study.compare import of_studies

    return of_studies(folders, names).write(out)
