"""What was proven of a plan, as the table CERTIFICATE, and back."""

import json
from collections.abc import Mapping
from typing import Any

import numpy as np
from astropy.io import fits

from fiberplan.certificates import Certificate, Contact, ZoneEntry
from fiberplan.certificates.opening import Opening
from fiberplan.errors import PlanError
from fiberplan.focal_plane.geometry import Geometry
from fiberplan.tables.fits_tables import numbers, pick, table_hdu, texts


def proof_table(proof: Certificate) -> fits.BinTableHDU:
    """A row a pair, contact, opening, zone entered, or limit broken."""
    pairs = [proof.pairs, proof.obstacle_pairs]
    kinds = ["pair"] * len(proof.pairs) + ["obstacle"] * len(proof.obstacle_pairs)
    times = [np.full(len(kinds), np.nan)]
    clearance = [proof.clearance, proof.obstacle_clearance]
    for kind, contacts in (("contact", proof.contacts), ("undecided", proof.undecided), ("resting", proof.resting)):
        kinds += [kind] * len(contacts)
        pairs.append(np.array([c.pair for c in contacts], np.int64).reshape(-1, 2))
        times.append(np.array([c.time for c in contacts], float))
        clearance.append(np.array([c.clearance for c in contacts], float))
    kinds += ["opening"] * len(proof.opening)
    pairs.append(np.array([o.pair for o in proof.opening], np.int64).reshape(-1, 2))
    times.append(np.array([o.time for o in proof.opening], float))
    clearance.append(np.array([o.clearance for o in proof.opening], float))
    kinds += ["zone"] * len(proof.zones)
    pairs.append(np.array([(zone.positioner, -1) for zone in proof.zones], np.int64).reshape(-1, 2))
    times.append(np.array([zone.time for zone in proof.zones], float))
    clearance.append(np.array([zone.slider for zone in proof.zones], float))
    sentences = [""] * len(kinds) + list(proof.violations)
    count = len(proof.violations)
    both = np.concatenate([*pairs, np.full((count, 2), -1)])
    columns: dict[str, Any] = {
        "kind": [*kinds, *["violation"] * count],
        "first": both[:, 0],
        "second": both[:, 1],
        "time": np.concatenate([*times, np.full(count, np.nan)]),
        "clearance": np.concatenate([*clearance, np.full(count, np.nan)]),
        "text": sentences,
    }
    return table_hdu("CERTIFICATE", columns, {"time": "s", "clearance": "mm"})


def certificate_from_tables(tables: Mapping[str, Any]) -> Certificate:
    """The certificate in these tables."""
    table = pick(tables, "CERTIFICATE", PlanError)
    scalars = json.loads(texts(pick(tables, "PARAMETERS", PlanError), "json")[0])["certificate"]
    kind, text = np.array(texts(table, "kind")), texts(table, "text")
    pair = np.stack([numbers(table, "first", int), numbers(table, "second", int)], axis=1)
    time, clearance = numbers(table, "time"), numbers(table, "clearance")

    def contacts(which: str) -> tuple[Contact, ...]:
        rows = np.flatnonzero(kind == which)
        return tuple(Contact((int(pair[k, 0]), int(pair[k, 1])), float(time[k]), float(clearance[k])) for k in rows)

    said = scalars.get("geometry")  # files of earlier versions do not say
    return Certificate(
        **scalars
        | {"assumptions": tuple(scalars.get("assumptions", ()))}
        | {"geometry": None if said is None else Geometry(**said | {"radii": tuples(said["radii"])})},
        pairs=pair[kind == "pair"],
        clearance=clearance[kind == "pair"],
        obstacle_pairs=pair[kind == "obstacle"],
        obstacle_clearance=clearance[kind == "obstacle"],
        contacts=contacts("contact"),
        undecided=contacts("undecided"),
        violations=tuple(text[k] for k in np.flatnonzero(kind == "violation")),
        resting=contacts("resting"),
        zones=tuple(
            ZoneEntry(int(pair[k, 0]), float(time[k]), float(clearance[k])) for k in np.flatnonzero(kind == "zone")
        ),
        opening=tuple(
            Opening((int(pair[k, 0]), int(pair[k, 1])), float(clearance[k]), float(time[k]))
            for k in np.flatnonzero(kind == "opening")
        ),
    )


def tuples(value: Any) -> Any:
    """JSON's lists as the tuples that were written."""
    if isinstance(value, list):
        return tuple(tuples(item) for item in value)
    return {key: tuples(item) for key, item in value.items()} if isinstance(value, dict) else value
