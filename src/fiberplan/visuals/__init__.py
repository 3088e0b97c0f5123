"""Pictures of plans: one self-contained HTML page (`show`); still figures are in `fiberplan.visuals.figures`.

Figures need matplotlib, which takes a while to import, so that module is loaded by whoever draws.
"""

from fiberplan.visuals.page import show

__all__ = ["show"]
