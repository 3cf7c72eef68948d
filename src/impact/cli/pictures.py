"""The command `plot`: pictures of a result, of one kind or several."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..errors import UsageError
from ..text import safe_text
from ..views.names import FOLLOWED, KINDS, LOGS, WIDTHS
from . import door
from .options import Json, Plugins
from .words import dump, pairs

if TYPE_CHECKING:
    from ..views.kinds import Numbers


def plot(
    result: Annotated[Path, typer.Argument(help="A result of `impact sweep`, or a history of `impact run`.")],
    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            help="The picture: .png, .svg or .pdf; of several kinds each has its kind in its name. "
            "\\[default: RESULT.png]",
        ),
    ] = None,
    kind: Annotated[
        list[str] | None,
        typer.Option(
            "--kind",
            "-k",
            metavar="KIND",
            help=f"{', '.join(KINDS)}; may be repeated. \\[default: {next(iter(KINDS))}]",
        ),
    ] = None,
    x: Annotated[
        str | None, typer.Option("--x", help="What to draw over. \\[default: e, else the first axis]")
    ] = None,
    y: Annotated[
        str | None, typer.Option("--y", help="Second axis of a map, or of validity. \\[default: the next axis]")
    ] = None,
    variable: Annotated[str, typer.Option("--variable", help="What a map shows.")] = "e_error",
    sel: Annotated[
        list[str] | None,
        typer.Option(
            "--sel", metavar="NAME=VALUE", help="Value of another axis; may be repeated. \\[default: its first]"
        ),
    ] = None,
    model: Annotated[
        list[str] | None, typer.Option("--model", metavar="KEY", help="A model to show; may be repeated.")
    ] = None,
    log: Annotated[str | None, typer.Option("--log", help="Axes to make logarithmic: x, y or xy.")] = None,
    width: Annotated[
        str, typer.Option("--width", help="That of one column of a journal, single, or of two, double.")
    ] = "double",
    data: Annotated[
        Path | None, typer.Option("--data", metavar="FILE", help="Write the numbers behind the picture: .csv.")
    ] = None,
    plugin: Plugins = None,
    as_json: Json = False,
) -> None:
    """Draw a stored result: by default the final-velocity comparison, Figure 6 of the paper.

    loop, history and impulse follow a point of the result through time again; --sel chooses it.
    """
    from .. import api
    from ..results import backend
    from ..views.kinds import Choice, as_csv, draw
    from ..views.look import check_picture, save_figure

    dataset = api.load(result)
    output = output or result.with_suffix(".png")
    check_picture(output)
    if data is not None and data.suffix.lower() != ".csv":
        raise UsageError(f"--data {safe_text(str(data))}: wants a name that ends in .csv")
    if width not in WIDTHS:
        raise UsageError(f"--width {safe_text(width)}: wants {' or '.join(WIDTHS)}")
    if log not in (None, *LOGS):
        raise UsageError(f"--log {safe_text(str(log))}: wants {', '.join(LOGS)}")
    chosen = pairs("--sel", sel)
    choice = Choice(x, y, variable, chosen, model, log or "")
    kinds = list(dict.fromkeys(kind or ["final-velocities"]))
    # beside a loop at one e stands a picture over all of them
    over = replace(choice, sel={name: value for name, value in chosen.items() if name != (x or "e")})
    found = {
        one: api.pictured(dataset, one, choice if one in FOLLOWED or len(kinds) == 1 else over, plugin or ())
        for one in kinds
    }
    for one, numbers in found.items():
        picture, table = (_named(path, one, len(kinds)) for path in (output, data))
        for path in (picture, table):
            if path is not None:
                backend.check_output(path, overwrite=True, source=result)
        assert picture is not None
        save_figure(draw(numbers, WIDTHS[width]), picture)
        if table is not None:
            backend.write_whole(table, as_csv(numbers).encode(), overwrite=True)
        door.say(_told(picture, numbers))
    if as_json:
        from dataclasses import asdict

        print(dump({one: asdict(numbers) for one, numbers in found.items()}))


def _named(path: Path | None, kind: str, kinds: int) -> Path | None:
    """A file of its own for each of several kinds."""
    return path if path is None or kinds == 1 else path.with_name(f"{path.stem}-{kind}{path.suffix}")


def _told(picture: Path, numbers: Numbers) -> str:
    conditions = numbers.conditions.replace("\N{NO-BREAK SPACE}", " ")
    without = f"; without {', '.join(numbers.not_drawn)}" if numbers.not_drawn else ""
    return safe_text(f"{picture}: {numbers.title}" + (f", {conditions}" if conditions else "") + without, 1000)
