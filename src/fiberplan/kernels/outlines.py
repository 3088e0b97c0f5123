"""Whether a closed outline has an inside."""

from fiberplan.kernels.compile import leaf
from fiberplan.kernels.segments import segment_to_segment, segments_cross


@leaf
def crosses_itself(outline):
    """Whether two edges of an outline (k, 2) [mm] cross, or two that are not next to each other touch."""
    k = len(outline)
    for a in range(k):
        ax, ay = outline[a]
        bx, by = outline[(a + 1) % k]
        for c in range(a + 1, k):
            cx, cy = outline[c]
            dx, dy = outline[(c + 1) % k]
            if segments_cross(ax, ay, bx, by, cx, cy, dx, dy):
                return True
            adjacent = c - a == 1 or c - a == k - 1
            if not adjacent and segment_to_segment(ax, ay, bx, by, cx, cy, dx, dy)[0] == 0.0:
                return True
    return False
