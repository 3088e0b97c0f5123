"""The manual keeps its word: its examples run, its links lead somewhere, and nothing public is left out of it."""

import re
import runpy
import shlex
import sys
from pathlib import Path

import pytest
from typer.main import get_command

import fiberplan as fp
from fiberplan.cli.app import app

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
PAGES = sorted(DOCS.glob("*.md"))
NOTES = sorted((ROOT / "design").glob("*.md"))
EXAMPLES = runpy.run_path(str(DOCS / "examples.py"))
RUN = [page for page in PAGES if EXAMPLES["blocks"](page.read_text())]
COMMANDS = get_command(app).commands
INDEX = (DOCS / "index.md").read_text()


@pytest.mark.parametrize("page", RUN, ids=lambda page: page.stem)
def test_every_example_runs(page, tmp_path, monkeypatch):
    monkeypatch.setattr(sys, "path", [*sys.path])
    monkeypatch.setenv("MPLBACKEND", "agg")
    found, done = EXAMPLES["blocks"](page.read_text()), list(EXAMPLES["results"](page, tmp_path))
    assert len(done) == len(found)


def test_a_block_that_fails_is_noticed(tmp_path):
    page = tmp_path / "page.md"
    page.write_text("```python\nprint(1)\n```\n\n```sh run\nfiberplan instruments nobody\n```\n")
    results = EXAMPLES["results"](page, tmp_path)
    assert next(results).printed == "1\n"
    with pytest.raises(RuntimeError, match=r"page.md:6: exit code 2 of: fiberplan instruments nobody"):
        next(results)


@pytest.mark.small
def test_toctrees_hold_every_page():
    listed = re.findall(r"^[\w./-]+$", "\n".join(re.findall(r"```{toctree}(.*?)```", INDEX, re.S)), re.M)
    assert len(listed) == len(set(listed))
    assert len(PAGES) >= 25
    pages = {path.relative_to(DOCS).with_suffix("").as_posix() for path in PAGES if path.stem != "index"}
    assert {name for name in listed if not name.startswith("../")} == pages
    assert {f"../design/{path.stem}" for path in NOTES} <= set(listed)
    assert [name for name in listed if not (DOCS / f"{name}.md").exists()] == []


def slug(heading):
    """The anchor of a heading, as GitHub and the built manual make it."""
    return re.sub(r"[^\w -]", "", heading.strip().lower().replace("`", "")).replace(" ", "-")


@pytest.mark.small
@pytest.mark.parametrize("page", [*PAGES, *NOTES, ROOT / "README.md"], ids=lambda page: page.stem)
def test_links_to_headings_lead_to_one(page):
    for link, anchor in re.findall(r"\]\(([\w./-]*)#([\w-]+)\)", page.read_text()):
        text = (page.parent / link).read_text() if link else page.read_text()
        assert anchor in {slug(heading) for heading in re.findall(r"^#+ (.*)$", text, re.M)}, f"{link}#{anchor}"


@pytest.mark.small
@pytest.mark.parametrize("page", [*PAGES, ROOT / "README.md"], ids=lambda page: page.stem)
def test_commands_that_prose_shows_are_commands(page):
    """Each line in a fenced block that begins with `fiberplan` is one that the command line takes."""
    for block in re.findall(r"^```[^\n]*\n(.*?)^```$", page.read_text(), re.S | re.M):
        for line in re.findall(r"^fiberplan .*$", block, re.M):
            _, *words = shlex.split(line.partition(" #")[0])
            if words[0] in COMMANDS:
                COMMANDS[words[0]].make_context(words[0], words[1:])  # or it raises
            else:
                assert words[0].startswith("--") or words[0] == "COMMAND", line


def test_the_page_of_commands_is_the_apps():
    made = runpy.run_path(str(DOCS / "commands.py"))
    text = (DOCS / "command-line.md").read_text()
    assert made["written"](text) == text, "run: python docs/commands.py"
    listed = re.findall(r"^fiberplan (\w+)", text.split("```")[1], re.M)
    assert set(listed) == set(COMMANDS)


@pytest.mark.small
def test_every_public_name_has_an_example_that_is_run():
    code = "\n".join(
        block.code for page in PAGES for block in EXAMPLES["blocks"](page.read_text()) if block.kind == "python"
    )
    assert [name for name in fp.__all__ if not re.search(rf"\bfp\.{name}\b", code)] == []


@pytest.mark.small
def test_docstrings_of_public_names_say_shapes_units_and_errors():
    found = runpy.run_path(str(DOCS / "docstrings.py"))["lacking"]()
    assert len(found) > 100
    assert {name: missing for name, missing in found.items() if missing} == {}


def test_drawings_and_pages_of_the_reference_are_there():
    assert {f"fiberplan.{name}" for name in fp.__all__ if isinstance(getattr(fp, name), type)} <= set(
        re.findall(r"auto\w+:: ([\w.]+)", "\n".join(page.read_text() for page in PAGES))
    )
