"""Judge the built manual, page by page, by axe: ``python docs/accessibility.py docs/_build/html [PAGE...]``.

Every page is opened in Chromium in light and in dark. Told are violations of WCAG 2 A and AA and of axe's best
practices, errors on the console, and requests to anywhere but the folder; exit code 1 if there are any.
"""

import os
import shutil
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from axe_core_python.sync_playwright import Axe
from playwright.sync_api import Page, sync_playwright

NOT_PAGES = ("genindex.html", "search.html", "py-modindex.html")  # made by Sphinx, judged last and named as such
CHROME = os.environ.get("CHROME") or next(
    filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None
)


def judged(page: Page, path: Path, axe: Any) -> Iterator[tuple[str, str]]:
    """What is wrong with a page: a rule, and where it is broken."""
    heard: list[str] = []
    page.on("console", lambda message: heard.append(message.text) if message.type == "error" else None)
    page.on("request", lambda request: heard.append(request.url) if not request.url.startswith("file:") else None)
    page.goto(path.resolve().as_uri())
    for violation in axe.run(page)["violations"]:
        for node in violation["nodes"]:
            yield violation["id"], str(node["target"][0])
    for text in heard:
        if not text.startswith("data:"):
            yield "console or network", text


def main(folder: Path, names: list[str]) -> int:
    """Judge the pages `names` of a folder, or all of them."""
    paths = [folder / name for name in names] or sorted(
        (path for path in folder.rglob("*.html") if "_static" not in path.parts), key=lambda p: (p.name in NOT_PAGES, p)
    )
    counts: Counter[str] = Counter()
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=CHROME, args=["--no-sandbox", "--disable-gpu"])
        for scheme in ("light", "dark"):
            context = browser.new_context(color_scheme=scheme, viewport={"width": 1280, "height": 900})  # type: ignore[arg-type]
            for path in paths:
                page = context.new_page()
                for rule, where in judged(page, path, Axe()):
                    counts[rule] += 1
                    print(f"{path.relative_to(folder)} ({scheme}): {rule}: {where}")
                page.close()
        browser.close()
    print(f"{len(paths)} pages, light and dark: {counts.total()} violations {dict(counts) or ''}")
    return 1 if counts else 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]), sys.argv[2:]))
