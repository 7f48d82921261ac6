"""Charts of a report: figures as wide as its page, in one style, with units on every axis."""

from __future__ import annotations

from collections.abc import Sequence

from fsi.extras import require

WIDTH = 11.5  # [in] of the page
COLOURS = ("#0b5cad", "#d1602b", "#2e8b57", "#8a4fbf", "#b8860b", "#5b6770", "#c2185b", "#00838f")
STYLE = {  # of a panel when it is made
    "font.size": 12,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "grid.color": "0.9",
}


def canvas(rows: int = 1, columns: int = 1, *, height: float = 3.2, sharex: bool = False):
    """A figure as wide as the page with `rows` x `columns` panels, each `height` inches high, and the panels row by
    row as a flat list. Nothing of matplotlib's global state is touched."""
    matplotlib = require("matplotlib", "report", "a report")
    from matplotlib.figure import Figure

    with matplotlib.rc_context({**STYLE, "axes.prop_cycle": matplotlib.cycler(color=COLOURS)}):
        figure = Figure(figsize=(WIDTH, height * rows), layout="constrained")
        panels = figure.subplots(rows, columns, squeeze=False, sharex=sharex)
    return figure, list(panels.ravel())


def lines(panel, x, columns: Sequence, names: Sequence[str], *, xlabel: str, ylabel: str, title: str = "") -> None:
    """Curves over a common x; the legend stands beside the panel, where it covers nothing, and is left out for a single
    curve."""
    for column, name in zip(columns, names, strict=True):
        panel.plot(x, column, label=name, linewidth=1.4)
    panel.set(xlabel=xlabel, ylabel=ylabel)
    panel.set_title(title, loc="left", fontsize=13)
    panel.margins(x=0)
    legend(panel)


def legend(panel) -> None:
    """A legend to the right of the panel, where there is more than one name in it."""
    handles, names = panel.get_legend_handles_labels()
    if len(names) > 1:
        place = {"loc": "upper left", "bbox_to_anchor": (1.0, 1.0), "borderaxespad": 0.2}
        panel.legend(handles, names, fontsize=11, frameon=False, **place)


def heat_map(panel, x, y, values, *, xlabel: str, ylabel: str, label: str, limits=(None, None)) -> None:
    """A matrix (y, x) as coloured cells with the value written in each; the cells stand side by side, however far their values
    of x and y lie apart. `limits` are the values at the ends of the colours, those of the matrix if None."""
    import numpy as np

    values = np.asarray(values, float)
    image = panel.pcolormesh(
        np.arange(len(x)), np.arange(len(y)), values, cmap="viridis", edgecolors="white", linewidth=1,
        vmin=limits[0], vmax=limits[1],
    )  # fmt: skip
    middle = 0.5 * sum(image.get_clim()) if np.isfinite(values).any() else 0.0
    for (row, column), value in np.ndenumerate(values):
        colour = "0.5" if np.isnan(value) else "white" if value < middle else "black"
        text = "none" if np.isnan(value) else f"{value:,.0f}" if abs(value) >= 1000 else f"{value:.3g}"
        panel.text(column, row, text, ha="center", va="center", color=colour, fontsize=11 if len(x) <= 12 else 8)
    panel.set_xticks(range(len(x)), [f"{v:.4g}" for v in x])
    panel.set_yticks(range(len(y)), [f"{v:.4g}" for v in y])
    panel.set(xlabel=xlabel, ylabel=ylabel)
    panel.grid(False)
    panel.figure.colorbar(image, ax=panel, label=label)
