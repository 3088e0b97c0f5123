"""Objects from files, and files from objects: the one place that knows both.

Classes offer these functions as methods (`FocalPlane.load`, `Plan.write`, ...) and find them here by name.
"""

from fiberplan.io.focal_plane_tables import write_focal_plane
from fiberplan.io.load import load_focal_plane
from fiberplan.io.plan_file import read_plan, write_plan
from fiberplan.io.target_files import read_columns

__all__ = ["load_focal_plane", "read_columns", "read_plan", "write_focal_plane", "write_plan"]
