"""A browser without a window, with the patience that a busy machine needs."""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest

_CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
IN_A_BROWSER = pytest.mark.skipif(
    _CHROMIUM is None, reason="there is no Chromium to open the page with"
)
PATIENCE_S = 600.0


@contextmanager
def chromium() -> Iterator[Any]:
    """Start the browser."""
    playwright = pytest.importorskip("playwright.sync_api")
    with playwright.sync_playwright() as play:
        browser = play.chromium.launch(
            executable_path=_CHROMIUM,
            timeout=1e3 * PATIENCE_S,
            args=["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"],
        )
        yield browser
        browser.close()


def new_tab(browser: Any, **options: Any) -> Any:
    """Open a tab of a browser or context."""
    tab = browser.new_page(**options)
    tab.set_default_timeout(1e3 * PATIENCE_S)
    return tab
