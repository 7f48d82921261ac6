"""The page of a folder, whatever it holds: a run or a study."""

from __future__ import annotations

from pathlib import Path


def report(directory: str | Path) -> Path:
    """Write the page of the folder of a run or of a study and return its file. Raises SceneError where it holds none."""
    if Path(directory, "run.json").is_file():
        from cases.report.run import report as of_run

        return of_run(directory)
    from cases.study.report import report as of_study

    return of_study(directory)
