"""Objects from files, and files from objects: the one room that knows both.

Classes offer these functions as methods (`FocalPlane.load`, `Plan.write`, ...) and find them here by name.

- `load`: a focal plane by name, or from a file or folder of any known kind
- `focal_plane_tables`: a focal plane as FITS tables, exact to the last bit
- `body_tables`: its bodies and obstacles, a row a vertex
- `sealed_tables`: FITS tables with a version and a digest
- `plan_file`: a plan as one FITS file (``docs/plan-format.md``); `plan_tables`, `proof_tables`: which column holds what
- `target_files`: readers and a writer of targets; `target_columns`: what their columns mean
- `states`: readers and a writer of where everyone stands and who can move
- `motion_states`: the state after an executed motion, or a controller's file of one
- `certificate_tables`: proofs that goals cannot be reached, as tables of a plan file
- `exports`: a plan's motion in the formats of other programs
"""

from fiberplan.io.exports import EXPORTS
from fiberplan.io.focal_plane_tables import write_focal_plane
from fiberplan.io.load import load_focal_plane
from fiberplan.io.plan_file import read_plan, write_plan
from fiberplan.io.states import read_state, write_state
from fiberplan.io.target_files import columns_of, read_columns, table_of, write_targets

__all__ = [
    "EXPORTS",
    "columns_of",
    "load_focal_plane",
    "read_columns",
    "read_plan",
    "read_state",
    "table_of",
    "write_focal_plane",
    "write_plan",
    "write_state",
    "write_targets",
]
