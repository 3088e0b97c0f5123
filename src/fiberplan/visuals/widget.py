"""The page of a plan inside a notebook, alive: a widget that holds the same HTML as `show` writes (extra ``notebook``).

It is kept by the running notebook only; what is saved with the notebook is the small drawing of `notebook`.
"""

from typing import Any

from fiberplan.errors import FiberplanError
from fiberplan.plan import Plan
from fiberplan.visuals.page import render

_FRAME = """
function render({ model, el }) {
  const frame = document.createElement("iframe");
  frame.title = model.get("title");
  frame.sandbox = "allow-scripts allow-downloads";
  frame.style = `width: 100%; height: ${model.get("height")}px; border: 0`;
  frame.srcdoc = model.get("page");
  el.replaceChildren(frame);
}
export default { render };
"""


def widget(plan: Plan, height: int = 700) -> Any:
    """The page of a plan as a widget for Jupyter and its relatives.

    Args:
        plan: what is shown.
        height: of the widget [pixel].

    Raises:
        FiberplanError: `anywidget` is not installed.
    """
    try:
        import anywidget
        import traitlets
    except ImportError:
        raise FiberplanError("a widget needs the extra 'notebook': pip install 'fiberplan[notebook]'") from None

    class PlanPage(anywidget.AnyWidget):
        """One page in a frame of its own."""

        _esm = _FRAME
        page = traitlets.Unicode().tag(sync=True)
        title = traitlets.Unicode().tag(sync=True)
        height = traitlets.Int().tag(sync=True)

    return PlanPage(page=render([plan]).decode("ascii"), title=f"{plan.problem.plane.name}: {plan}", height=height)
