"""The kinds of arm there are, and which of them a table of positioners describes."""

from collections.abc import Mapping

import numpy as np

from fiberplan.focal_plane.four_bar import FourBar
from fiberplan.focal_plane.kinematics import Kinematics
from fiberplan.focal_plane.two_link import TWO_LINK

STORED = {"four_bar": FourBar}  #: prefix of the columns that hold a kind's constants -> the kind


def kinematics_of(columns: Mapping[str, np.ndarray]) -> Kinematics:
    """The kind of arm whose constants are among `columns`, as `<prefix>_<name>`; two links if there are none."""
    for prefix, kind in STORED.items():
        own = {name.removeprefix(f"{prefix}_"): values for name, values in columns.items() if name.startswith(prefix)}
        if own:
            return kind(**own)
    return TWO_LINK


def stored(kinematics: Kinematics) -> dict[str, tuple[np.ndarray, str]]:
    """The constants of a kind as columns with their units; none of two links."""
    prefix = next((key for key, kind in STORED.items() if isinstance(kinematics, kind)), "")
    return {f"{prefix}_{name}": column for name, column in kinematics.columns().items()}
