"""What users run: real arrays with their obstacles, from field to field, one seed after the other.

Move k goes from field 100 + k to field 101 + k, as in a night; with some offline, both fields are drawn around those.
"""

from functools import cache, partial
from pathlib import Path

import numpy as np

import fiberplan as fp
from fiberplan.instruments import desi
from fiberplan.scenes.clustered import clustered_targets
from fiberplan.scenes.uniform import uniform_field
from scenes.scene import Scene
from scenes.sdss import MOST_BENT, OFFLINE

ARRAYS = {  # name -> instrument, or a path in the folder of real data
    "sdss": "sdss",
    "apo": "sdss/apo/wok_calibs/sloanFlatCMM",
    "lco": "sdss/lco/wok_calibs/duPontFlatCMM",
}
DESI = "desi/fp-20260219.ecsv"
PETALS = 10
MARGINS = (0.4, 0.8, 1.0)  # [mm]
FIRST = 100  # number of the first field
MOVES = 30


@cache
def array(data: Path, name: str) -> fp.FocalPlane:
    where = ARRAYS.get(name, name)
    return fp.FocalPlane.load(data / where if "/" in where else where)


def field_to_field(seed: int, data: Path, name: str, margin: float) -> fp.Problem:
    """From field to field."""
    plane = array(data, name)
    start, goal = (uniform_field(plane, FIRST + seed + k, margin) for k in (0, 1))
    return fp.Problem(plane, start, goal, margin)


def offline(seed: int, data: Path, name: str, margin: float, extended: bool) -> fp.Problem:
    """From field to field, ten drawn at random being offline."""
    plane, rng = array(data, name), np.random.default_rng(seed)
    able = np.flatnonzero(plane.online)
    out = rng.choice(able, OFFLINE, replace=False)
    online, where = plane.online.copy(), plane.folded.copy()
    online[out] = False
    if extended:
        where[out, 0] = rng.uniform(plane.lower[out, 0], plane.upper[out, 0])
        where[out, 1] = rng.uniform(0.0, MOST_BENT, OFFLINE)
    plane = plane.replace(online=online)
    start, goal = (uniform_field(plane, FIRST + seed + k, margin, start=where) for k in (0, 1))
    return fp.Problem(plane, start, goal, margin)


def clustered(seed: int, data: Path, name: str, margin: float) -> fp.Problem:
    """From a uniform field to one that is clustered as galaxies are."""
    plane = array(data, name)
    targets = clustered_targets(plane, FIRST + seed, margin)
    return fp.Problem.from_targets(plane, targets, uniform_field(plane, FIRST + seed, margin), margin, conflicts="drop")


def petals(seed: int, data: Path) -> fp.Problem:
    """A real petal of DESI from field to field, each in turn: whoever does not work stands where it stood."""
    plane = desi.petal(array(data, DESI), seed % PETALS)
    start, goal = (uniform_field(plane, FIRST + seed + k) for k in (0, 1))
    return fp.Problem(plane, start, goal, conflicts="drop")


def pfs(seed: int, data: Path) -> fp.Problem:
    """The 2,394 nominal cobras of PFS from field to field, at the margin that is recommended."""
    plane = array(data, "pfs")
    margin = plane.recommended_margin or 0.0
    start, goal = (uniform_field(plane, FIRST + seed + k, margin) for k in (0, 1))
    return fp.Problem(plane, start, goal, margin)


def _scene(make, label: str, name: str, margin: float, **settings) -> Scene:
    made = partial(make, name=name, margin=margin, **settings)
    kind = ", extended any way" if settings.get("extended") else ""
    text = make.__doc__.rstrip(".")
    made.__doc__ = f"{name}: {text[0].lower()}{text[1:]}{kind}, at a margin of {margin} mm."
    where = ARRAYS[name]
    return Scene(f"{name}-{label}-{margin}", made, fields=MOVES, needs=where if "/" in where else None)


SCENES = (
    *(
        scene
        for name in ARRAYS
        for margin in MARGINS
        for scene in (
            _scene(field_to_field, "field", name, margin),
            _scene(offline, "offline", name, margin, extended=False),
            _scene(offline, "extended", name, margin, extended=True),
            _scene(clustered, "clustered", name, margin),
        )
    ),
    Scene("desi-petals-field", petals, fields=MOVES, needs=DESI),
    Scene("pfs-field", pfs, fields=MOVES),
)
