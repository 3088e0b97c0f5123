"""What a focal-plane file of DESI says of its motors: bus and power supply of each, and which phi has a linear one."""

import os
from pathlib import Path
from typing import NamedTuple

from fiberplan.errors import InstrumentError
from fiberplan.instruments.desi import focal_plane_file
from fiberplan.tables.ecsv import read_ecsv

FIRST_SUPPLY = frozenset(f"can{bus}" for bus in (10, 11, 13, 22, 23, *range(30, 36), *range(39, 43)))
"""Buses of a petal that its supply V1 feeds, V2 the others; from the public code of the instrument's team."""


class Motors(NamedTuple):
    """The motors of a focal plane, by device id."""

    buses: dict[str, tuple[int, str]]  #: number and bus on which controllers know it
    linear: frozenset[str]  #: those whose phi has a linear motor
    supplies: dict[str, str]  #: petal and name of the power supply


def motors_of(path: str | os.PathLike | None) -> Motors:
    """The motors that a ``fp-*.ecsv`` tells of, or its folder; none if there is no path.

    Raises:
        InstrumentError: no such file, or a column that lacks.
    """
    if path is None:
        return Motors({}, frozenset(), {})
    file = focal_plane_file(Path(path))
    if file is None:
        raise InstrumentError(f"{path}: is no fp-*.ecsv of DESI, nor a folder that has one")
    table = read_ecsv(file, InstrumentError)
    table.require("DEVICE_ID", "BUS_ID", "CAN_ID", "LINPHI", "PETAL_LOC")
    ids, flags = table.texts("DEVICE_ID", ""), table.texts("LINPHI", "False")
    buses, numbers = table.texts("BUS_ID", ""), table.texts("CAN_ID", "")
    known = {
        id_: (int(number), f"can{bus}")
        for id_, bus, number in zip(ids, buses, numbers, strict=True)
        if id_ and bus.isdecimal() and number.isdecimal()
    }
    linear = frozenset(id_ for id_, flag in zip(ids, flags, strict=True) if flag.lower() == "true")
    supplies = {
        id_: f"petal {petal} V{1 if known[id_][1] in FIRST_SUPPLY else 2}"
        for id_, petal in zip(ids, table.texts("PETAL_LOC", ""), strict=True)
        if id_ in known
    }
    return Motors(known, linear, supplies)
