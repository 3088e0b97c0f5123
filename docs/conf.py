"""How Sphinx builds the manual: ``make docs``. Pages stay plain Markdown; the build adds what their examples print."""

import re
import shutil
import sys
import tempfile
from pathlib import Path

from pygments.lexers.special import TextLexer
from sphinx.application import Sphinx

DOCS = Path(__file__).parent
ROOT = DOCS.parent
sys.path.insert(0, str(DOCS))

from examples import blocks, results  # noqa: E402

import fiberplan  # noqa: E402

project = "fiberplan"
author = "the fiberplan developers"
version = release = fiberplan.__version__
root_doc = "docs/index"
include_patterns = ["docs/*.md", "design/*.md", "CHANGELOG.md", "CODE_OF_CONDUCT.md", "CONTRIBUTING.md", "SECURITY.md"]
exclude_patterns = ["docs/_build", ".venv"]
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
myst_enable_extensions = ["deflist", "colon_fence", "attrs_block"]
myst_heading_anchors = 4
default_role = "literal"  # docstrings have names between single backticks
autodoc_member_order = "bysource"
autodoc_typehints = "description"
autodoc_class_signature = "mixed"
autodoc_preserve_defaults = True
napoleon_numpy_docstring = False
napoleon_use_ivar = True
html_theme = "pydata_sphinx_theme"
html_title = f"fiberplan {version}"
html_static_path = ["_static"]
html_css_files = ["manual.css"]
html_context = {"default_mode": "auto"}  # light or dark as the reader has it
html_show_sourcelink = False
html_theme_options = {
    "navbar_end": ["theme-switcher"],
    "secondary_sidebar_items": ["page-toc"],
    "navigation_with_keys": False,
    "show_nav_level": 1,
    "header_links_before_dropdown": 5,
    "pygments_light_style": "a11y-high-contrast-light",
    "pygments_dark_style": "a11y-high-contrast-dark",
}
FIGURES = DOCS / "_examples"  #: figures that examples draw, while the manual is built
LINK = re.compile(r"\]\((?:\.\./)*README\.md(#[\w-]+)?\)")


def show_results(app: Sphinx, name: str, source: list[str]) -> None:
    """Run the examples of a page, and put what they print and draw below them."""
    page = ROOT / f"{name}.md"
    text = source[0]
    found = blocks(text) if page.parent == DOCS else []
    with tempfile.TemporaryDirectory() as folder:
        done = list(results(page, Path(folder))) if found else []
        for block, result in reversed(list(zip(found, done, strict=True))):
            shown = f"\n\n```{{code-block}} text\n:class: output\n\n{result.printed}```\n" if result.printed else ""
            for picture in result.pictures:
                kept = FIGURES / page.stem / picture.name
                kept.parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(picture, kept)
                shown += f"\n\n![{picture.stem.replace('-', ' ')}, as the example draws it]({kept.relative_to(DOCS)})\n"
            text = text[: block.end] + shown + text[block.end :]
    source[0] = LINK.sub("](/docs/index.md)", text)  # its part in the manual


_KEPT: dict[str, list[str]] = {}


def keep(app: Sphinx, what: str, name: str, thing: object, options: object, lines: list[str]) -> None:
    """Remember what is said of a field, which napoleon would cut at its first colon."""
    if what in ("attribute", "property") and not any(
        line.strip() in ("Args:", "Raises:", "Returns:") for line in lines
    ):
        _KEPT[name] = lines[:]


def restore(app: Sphinx, what: str, name: str, thing: object, options: object, lines: list[str]) -> None:
    """Put back what `keep` remembers."""
    lines[:] = _KEPT.pop(name, lines)


def setup(app: Sphinx) -> None:
    """Called by Sphinx."""
    for name in ("csv", "ecsv"):
        app.add_lexer(name, TextLexer)
    app.connect("autodoc-process-docstring", keep, priority=100)
    app.connect("autodoc-process-docstring", restore, priority=900)
    app.connect("source-read", show_results)
