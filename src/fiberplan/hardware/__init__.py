"""Controllers: what writes a plan for the motors of an instrument, and reads back the motion that its files cause.

**Certify the bytes.** A proof of what was planned is no proof of what motors do. So each controller is a package with
`write(plan, path)` and `read(path, plane, state)`, whose `encode` and `decode` share no code, and a file is only left
behind if the motion that its bytes cause is proven. Another package names its own controllers in the entry points of
the group ``fiberplan.controllers``; ``fiberplan export --to NAME`` finds them by name.

- `controller`: what a controller is, and `CONTROLLERS`, all by name
- `certified`: writing, reading back and proving, the same for all
- `planned`: plans for a controller, mended until what it makes the motors do is proven
- `audit`: files of motion, whoever made them, read and proven
- `motion_tables`: motion from any table of positioner, time, alpha and beta
- `sdss`: trajectories of SDSS-V, points of each axis
- `desi`: move tables of DESI, whole steps row by row
- `moons`: waveforms of MOONS, whole steps a segment of time
- `pfs`: targets of PFS' cobras, iteration by iteration
- `simulated`: what robots make of a motion when clocks, motors and the line to them are not perfect
"""

from fiberplan.hardware import desi, moons, pfs, sdss
from fiberplan.hardware.audit import Audit
from fiberplan.hardware.controller import CONTROLLERS, Controller, HandedOver
from fiberplan.hardware.planned import plan_for

__all__ = ["CONTROLLERS", "Audit", "Controller", "HandedOver", "desi", "moons", "pfs", "plan_for", "sdss"]
