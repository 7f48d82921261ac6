"""The command `fsi render`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer


def render(
    directory: Annotated[Path, typer.Argument(metavar="DIR", help="The folder of a run.")],
    to: Annotated[Literal["png", "mp4", "gif"], typer.Option(help="A picture a frame, or one video.")] = "mp4",
    field: Annotated[
        str, typer.Option(metavar="NAME", help="Field of the colours; that of the timeline if none.")
    ] = "",
    limits: Annotated[str | None, typer.Option(metavar="A,B", help="Values at the ends of the colours.")] = None,
    surface: Annotated[bool, typer.Option("--surface", help="The fluid's surface in place of its particles.")] = False,
    camera: Annotated[
        str | None, typer.Option(metavar="X,Y,Z,X,Y,Z", help="Place and target of the eye [m], three dimensions.")
    ] = None,
    window: Annotated[
        str | None, typer.Option(metavar="X0,X1,Z0,Z1", help="What is shown of it [m], two dimensions.")
    ] = None,
    size: Annotated[
        str | None,
        typer.Option(metavar="WxH", help="Width and height in pixels; 1280 wide, as high as it needs, if none."),
    ] = None,
    every: Annotated[int, typer.Option(min=1, help="Every so many-th frame.")] = 1,
    start: Annotated[float, typer.Option("--from", metavar="T", help="From this time on [s].")] = 0.0,
    until: Annotated[float | None, typer.Option(metavar="T", help="Up to this time [s].")] = None,
    fps: Annotated[int | None, typer.Option(min=1, help="Frames a second of the video.")] = None,
) -> None:
    """Draw pictures or a video of a run, also on a machine without a screen."""
    from cases.pictures.look import Look
    from cases.pictures.render import render as draw

    wide, high = (int(n) for n in _numbers("--size", size.replace("x", ","), 2)) if size else (0, 0)
    look = Look(
        field=field, surface=surface, limits=_numbers("--limits", limits, 2) if limits else None,
        size=(wide - wide % 2, high - high % 2) if size else None,
        camera=_numbers("--camera", camera, 6) if camera else None,
        window=_numbers("--window", window, 4) if window else None,
    )  # fmt: skip
    print(draw(directory, to, look=look, every=every, start=start, until=until, fps=fps))


def _numbers(key: str, text: str, count: int) -> tuple[float, ...]:
    """So many numbers out of a text with commas. Raises SceneError."""
    from fsi.errors import SceneError

    try:
        found = tuple(float(part) for part in text.split(","))
    except ValueError:
        found = ()
    if len(found) != count:
        raise SceneError(f"{text!r} is not {count} numbers", key=key, fix="separate them by commas")
    return found
