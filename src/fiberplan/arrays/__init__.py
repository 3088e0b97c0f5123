"""The door through which numbers come in: one unit, one memory layout, nothing that changes afterwards.

- `door`: arrays, numbers and names as fiberplan holds them (`read_only`, `number`, `texts`)
- `digits`: numbers in messages that can be told apart
- `units`: astropy's quantities as plain numbers of one unit, masked values refused
- `frozen`: mappings that cannot be changed, and objects that stay as they are when pickled or copied
- `seeds`: which there are
"""

from fiberplan.arrays.digits import told_apart
from fiberplan.arrays.door import LARGEST, in_units, not_negative, number, read_only, texts
from fiberplan.arrays.frozen import Frozen, FrozenDict, frozen, shortened
from fiberplan.arrays.units import plain

__all__ = [
    "LARGEST",
    "Frozen",
    "FrozenDict",
    "frozen",
    "in_units",
    "not_negative",
    "number",
    "plain",
    "read_only",
    "shortened",
    "texts",
    "told_apart",
]
