"""Pictures of plans; nothing here knows a kernel or a planner.

- `page`, `page_data`, ``assets/``: one self-contained HTML page (`show`)
- `night_report`: one page of a night of audited motions
- `figures`: still pictures; they need matplotlib, which is slow to import, so callers import that module themselves
- `style`: colours and shapes that the page and the pictures share
"""

from fiberplan.visuals.page import show

__all__ = ["show"]
