"""``fiberplan instruments``: what is built in, and what an instrument is taken to be."""

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated

import typer

from fiberplan.cli.answers import say_json
from fiberplan.cli.completion import instrument_names
from fiberplan.cli.options import JsonOption
from fiberplan.cli.output import say
from fiberplan.cli.report import cautions

if TYPE_CHECKING:
    import numpy as np

    from fiberplan.focal_plane import FocalPlane


def instruments(
    name: Annotated[
        str | None,
        typer.Argument(
            metavar="[NAME]",
            help="A built-in name, or an instrument's file or folder.",
            autocompletion=instrument_names,
        ),
    ] = None,
    schema: Annotated[
        bool, typer.Option("--schema", help="Print the JSON Schema of instrument files (TOML) instead.")
    ] = False,
    json: JsonOption = False,
) -> None:
    """List the built-in instruments, or tell what one is made of and where its numbers come from."""
    if schema:
        from fiberplan.instruments import definition_model

        say_json(definition_model.schema())
        return
    from rich.table import Table

    from fiberplan.focal_plane import FocalPlane
    from fiberplan.instruments import names

    if name is None:
        planes = {known: FocalPlane.load(known) for known in names()}
        if json:
            say_json([_entry(known, plane) for known, plane in planes.items()])
            return
        table = Table("name", "positioners", "what it is")
        for known, plane in planes.items():
            table.add_row(*map(str, _entry(known, plane).values()))
        say(table)
        return
    plane = FocalPlane.load(name)
    if json:
        counts = {"positioners": plane.n, "online": int(plane.online.sum()), "bodies": len(plane.bodies)}
        places = {"ids": plane.ids, "base": plane.base}
        said = {"notes": plane.notes, "assumptions": plane.assumptions, "cautions": list(cautions(plane, math.inf))}
        say_json({"name": plane.name, **counts, "facts": dict(facts(plane)), **places} | said)
        return
    table = Table(show_header=False, title=plane.name, title_justify="left")
    for what, value in facts(plane):
        table.add_row(what, value)
    say(table)
    for note in plane.notes:
        say(f"- {note}")
    for text in plane.assumptions:
        say(f"assumed: {text}")
    for text in cautions(plane, math.inf):
        say(f"note: {text}")


def _entry(name: str, plane: "FocalPlane") -> dict[str, str | int]:
    return {"name": name, "positioners": plane.n, "about": next(iter(plane.notes), "")}


def facts(plane: "FocalPlane") -> Iterator[tuple[str, str]]:
    """What an instrument is made of, as (what, value with its unit)."""
    import numpy as np

    yield "positioners", f"{plane.n}, {int(plane.online.sum())} online"
    yield "first and last", f"{plane.ids[0]}, {plane.ids[-1]}"
    yield "extent", f"{_between(plane.base[:, 0])} by {_between(plane.base[:, 1])} mm"
    yield "base to elbow", f"{_between(plane.length)} mm"
    for fiber, offset in plane.fiber_offsets.items():
        far = np.linalg.norm(offset, axis=1)
        there = far[np.isfinite(far)]
        of = "" if len(there) == plane.n else f", {len(there)} of {plane.n} carry it"
        yield f"elbow to fiber '{fiber}'", f"{_between(there)} mm{of}" if len(there) else "nobody carries it"
    for what, values, unit in plane.kinematics.describe():
        yield what, f"{' to '.join(map(_between, values))} {unit}"
    if np.isfinite(plane.field_radius):
        yield "field", f"radius {plane.field_radius:g} mm"
    for k, joint in enumerate(("alpha", "beta")):
        low, high = np.degrees(plane.lower[:, k]), np.degrees(plane.upper[:, k])
        yield f"{joint} range", f"{_between(low)} to {_between(high)} deg"
        yield f"{joint} folded", f"{_between(np.degrees(plane.folded[:, k]))} deg"
        yield f"{joint} speed", f"{_between(np.degrees(plane.max_speed[:, k]))} deg/s"
        if plane.max_acceleration is not None:
            yield f"{joint} acceleration", f"{_between(np.degrees(plane.max_acceleration[:, k]))} deg/s^2"
        if plane.min_speed is not None:
            yield f"{joint} least speed", f"{_between(np.degrees(plane.min_speed[:, k]))} deg/s"
    for body in plane.bodies:
        shape = {1: "disc", 2: "capsule"}.get(body.points.shape[-2], "outline" if body.closed else "polyline")
        yield f"body '{body.name}'", f"{shape} on the {body.link} link, radius {_between(np.ravel(body.radius))} mm"
    yield "obstacles", str(len(plane.obstacles))
    if plane.recommended_margin is not None:
        yield "margin", f"{plane.recommended_margin:g} mm is recommended"
    yield "neighbour pairs", f"{len(plane.pairs)} that can come within {plane.pair_margin:g} mm of each other"


def _between(values: "np.ndarray") -> str:
    """One value, or the smallest and the largest."""
    low, high = f"{values.min():.6g}", f"{values.max():.6g}"
    return low if low == high else f"{low} .. {high}"
