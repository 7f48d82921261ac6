"""What a study came to, in a few lines."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from pathlib import Path

from cases.study.judge import best_row
from cases.study.results import export


def summary(data, tables: Iterable[str] = ()) -> dict:
    """Facts on the dataset of a study: `folder`, `runs`, `done`, `reasons` of failures, the `best` point, `files`."""
    folder = Path(data.attrs["folder"])
    states = data.status.values.ravel().tolist()
    reasons = Counter(text for text in data.reason.values.ravel().tolist() if text)
    best = best_row(data)
    return {
        "folder": str(folder),
        "runs": len(states),
        "done": states.count("done"),
        "reasons": [f"{text} ({count} runs)" if count > 1 else text for text, count in reasons.most_common()],
        "best": {key: best[key] for key in ("parameters", "objective", "value", "run")} if best else None,
        "units": data[best["objective"].partition(".")[0]].attrs["units"] if best else "",
        "files": [str(folder / "study.nc"), *(str(export(data, folder, kind)) for kind in tables)],
    }


def summary_lines(facts: dict) -> list[str]:
    """The facts as text."""
    lines = [f"{facts['folder']}: {facts['done']} of {facts['runs']} runs done"]
    lines += [f"failed: {reason}" for reason in facts["reasons"]]
    if facts["best"]:
        at = ", ".join(f"{name} = {_text(value)}" for name, value in facts["best"]["parameters"].items())
        best = facts["best"]
        lines.append(f"best {best['objective']}: {best['value']:.4g} {facts['units']} at {at} (runs/{best['run']})")
    return lines + [f"written: {file}" for file in facts["files"]]


def _text(value) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)
