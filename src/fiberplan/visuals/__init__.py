"""Pictures of plans; nothing here knows a kernel or a planner.

- `page`, ``assets/``: one self-contained HTML page of one plan or two (`show`)
- `page_data`, `plane_data`, `proof_data`, `packing`: what it carries, each part for other pages too
- `origin`: where a plan comes from, for title and heading; `settings`: a planner's, with units
- `approaches`: how near arms come to each other over time
- `heights`: what may lie over what
- `night_report`: one page of a night of audited motions
- `figures`: still pictures; they need matplotlib, which is slow to import, so callers import that module themselves
- `style`: colours and shapes that the page and the pictures share
"""

from fiberplan.visuals.page import show

__all__ = ["show"]
