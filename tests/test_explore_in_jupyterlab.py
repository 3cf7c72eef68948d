"""The controls of `impact.explore` in JupyterLab, in a real browser: widths, and what a slider does."""

from __future__ import annotations

import base64
import io
import json
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any
from urllib.request import urlopen

import numpy as np
import pytest
from matplotlib import image

import impact
from impact.plots.explore import DPI, WIDTH_INCHES

# a server, a kernel and a browser: `make test-faults` runs them
pytestmark = pytest.mark.slow

CONFIG: dict[str, Any] = {
    "models": ["hertz", "lankarani-nikravesh-1990", "kuwabara-kono-1987"],
    "sweep": {
        "e": {"linspace": [0.05, 0.95, 41]},
        "v1": {"geomspace": [0.01, 10.0, 4]},
        "m1": 1.0,
        "m2": [1.0, 4.0, 10.0],
        "K": 1e9,
    },
    "model": {"kuwabara-kono-1987": {"A": [1e-6, 1e-5]}},
}
CELL = f"import impact\nimpact.explore(impact.sweep({CONFIG}), kind='restitution', sel={{'m2': 4.0}})"
# a window with the file browser, and a phone, on which it is closed
WINDOWS = {"phone": (400, 800), "notebook": (1280, 900), "desktop": (1600, 900)}
START_S, CHANGE_S = 120.0, 60.0
MIN_CONTROL_PX, MIN_TRACK_PX = 240, 60
SLIDERS = ["e", "v1 [m/s]", "m2 [kg]", "A [s], kuwabara-kono-1987"]
MEASURE = """
(() => {
  const box = element => { const r = element.getBoundingClientRect(); return [r.left, r.top, r.right, r.bottom] };
  const text = element => element.textContent.trim();
  const output = document.querySelector('.jp-OutputArea-output .widget-box');
  const controls = [...output.querySelectorAll('.widget-dropdown, .widget-select-multiple, .widget-slider')];
  return {
    output: box(output),
    picture: box(output.querySelector('img')),
    controls: controls.map(element => [text(element.querySelector('label')), box(element)]),
    parts: [...output.querySelectorAll('label, select, .noUi-target, .widget-readout, img')]
      .filter(part => part.offsetParent).map(part => [part.className || part.tagName, box(part)]),
    tracks: [...output.querySelectorAll('.noUi-target')].map(box),
    // how far lists are scrolled, and how much they hide
    lists: [...output.querySelectorAll('select[multiple]')].filter(list => list.offsetParent)
      .map(list => [list.scrollTop, list.scrollHeight - list.clientHeight]),
    // whose content is wider: cut labels, and boxes with a scroll bar
    cut: [output, ...output.querySelectorAll('label, .widget-box')]
      .filter(part => part.scrollWidth > part.clientWidth + 1).map(part => part.title || part.className),
  };
})()
"""
# JupyterLab asks for the kernel instead where that is not ready
READY = """
fetch('/api/kernels').then(answer => answer.json()).then(
  kernels => kernels.some(kernel => kernel.connections > 0 && kernel.execution_state === 'idle')
)
"""
RUN = """
(() => {
  const prompt = document.querySelector('.jp-Notebook .jp-InputPrompt')?.textContent;
  if (prompt === '[ ]:') jupyterapp.commands.execute('notebook:run-all-cells');
  return !!prompt && prompt !== '[ ]:';
})()
"""
# the messages and the pictures from now on
WATCH = """
(() => {
  window.messages = [];
  window.pictures = 0;
  const output = document.querySelector('.jp-OutputArea-output .widget-box');
  const message = output.querySelector('img').parentElement.querySelector('.widget-html-content');
  new MutationObserver(() => messages.push(message.textContent)).observe(message, {childList: true});
  new MutationObserver(() => pictures++).observe(output.querySelector('img'), {attributeFilter: ['src']});
})()
"""
KEY_CODES = {"ArrowRight": 39, "Enter": 13}
PICTURE = "document.querySelector('.jp-OutputArea-output .widget-box img')"


class Page:
    """A page of a browser over its debugging protocol."""

    def __init__(self, address: str) -> None:
        self.socket = pytest.importorskip("websocket").create_connection(
            address, timeout=START_S, suppress_origin=True
        )
        self.count = 0

    def call(self, method: str, **params: Any) -> dict[str, Any]:
        self.count += 1
        self.socket.send(json.dumps({"id": self.count, "method": method, "params": params}))
        while True:
            answer = json.loads(self.socket.recv())
            if answer.get("id") == self.count:
                assert "error" not in answer, answer
                result: dict[str, Any] = answer["result"]
                return result

    def evaluate(self, expression: str) -> Any:
        answer = self.call("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in answer, answer
        return answer["result"].get("value")

    def wait_for(self, expression: str, limit_s: float = CHANGE_S, every_s: float = 0.02) -> Any:
        end = time.monotonic() + limit_s
        while not (value := self.evaluate(expression)):
            if time.monotonic() > end:
                messages = self.evaluate("JSON.stringify(window.messages)")
                pytest.fail(f"{expression} is {value} after {limit_s} s, with the messages {messages}")
            time.sleep(every_s)
        return value

    def resize(self, width: int, height: int) -> None:
        self.call(
            "Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False
        )

    def settled(self, expression: str) -> Any:
        """The value of an expression after it has not changed for half a second."""
        before, value = None, self.evaluate(expression)
        while value != before:
            time.sleep(0.5)
            before, value = value, self.evaluate(expression)
        return value

    def screenshot(self, path: Path) -> None:
        path.write_bytes(base64.b64decode(self.call("Page.captureScreenshot")["data"]))

    def press(self, key: str) -> None:
        for kind in ("keyDown", "keyUp"):
            self.call("Input.dispatchKeyEvent", type=kind, key=key, windowsVirtualKeyCode=KEY_CODES[key])

    def png(self) -> bytes:
        """The picture that is shown."""
        read = "r => r.arrayBuffer().then(a => btoa(String.fromCharCode(...new Uint8Array(a))))"
        return base64.b64decode(self.evaluate(f"fetch({PICTURE}.src).then({read})"))


def free_port() -> int:
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        port: int = one.getsockname()[1]
        return port


def answer_of(address: str, limit_s: float = START_S) -> bytes:
    """What a server answers as soon as it runs."""
    end = time.monotonic() + limit_s
    while True:
        try:
            with urlopen(address, timeout=5) as answer:
                content: bytes = answer.read()
                return content
        except OSError:
            assert time.monotonic() < end, f"{address} does not answer after {limit_s} s"
            time.sleep(0.1)


@contextmanager
def open_browser(chromium: str, folder: Path) -> Iterator[Page]:
    """A page of a browser of its own, whose profile and log are in a folder."""
    port = free_port()
    words = [
        *(chromium, "--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage"),
        *(f"--remote-debugging-port={port}", f"--user-data-dir={folder}/profile", "about:blank"),
    ]
    with ExitStack() as stack:
        log = stack.enter_context((folder / "browser.txt").open("w"))
        process = stack.enter_context(subprocess.Popen(words, stdout=log, stderr=log, cwd=folder))
        stack.callback(process.terminate)
        targets = json.loads(answer_of(f"http://127.0.0.1:{port}/json"))
        page = Page(next(one["webSocketDebuggerUrl"] for one in targets if one["type"] == "page"))
        stack.callback(page.socket.close)
        yield page


@pytest.fixture(scope="module")
def page(chromium: str, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Page]:
    """JupyterLab with a notebook whose cells have run, in a browser."""
    pytest.importorskip("jupyterlab", reason="no JupyterLab here: how controls look in it is not tested")
    folder = tmp_path_factory.mktemp("lab")
    cell = {"cell_type": "code", "id": "explore", "metadata": {}, "outputs": [], "execution_count": None}
    kernel = {"name": "python3", "display_name": "Python", "language": "python"}
    notebook = {
        "cells": [{**cell, "source": CELL}],
        "metadata": {"kernelspec": kernel},
        "nbformat": 4,
        "nbformat_minor": 5,
    }
    (folder / "work").mkdir()
    (folder / "work" / "explore.ipynb").write_text(json.dumps(notebook), encoding="utf-8")
    # without the question about news, which covers a corner
    settings = folder / "settings" / "@jupyterlab" / "apputils-extension" / "notification.jupyterlab-settings"
    settings.parent.mkdir(parents=True)
    settings.write_text('{"fetchNews": "false"}', encoding="utf-8")
    port = free_port()
    lab = [
        *(sys.executable, "-m", "jupyterlab", "--no-browser", "--allow-root", f"--port={port}"),
        *(
            "--IdentityProvider.token=",
            "--LabApp.expose_app_in_browser=True",
            f"--ServerApp.root_dir={folder}/work",
        ),
        *(f"--LabApp.user_settings_dir={folder}/settings", f"--LabApp.workspaces_dir={folder}/workspaces"),
    ]
    with ExitStack() as stack:
        log = stack.enter_context((folder / "log.txt").open("w"))
        process = stack.enter_context(subprocess.Popen(lab, stdout=log, stderr=log, cwd=folder))
        stack.callback(process.terminate)
        answer_of(f"http://127.0.0.1:{port}/api")
        page = stack.enter_context(open_browser(chromium, folder))
        page.resize(1280, 900)
        page.call("Page.navigate", url=f"http://127.0.0.1:{port}/lab/tree/explore.ipynb")
        page.wait_for(READY, START_S)
        page.wait_for(RUN, START_S, every_s=3.0)
        page.wait_for(f"!!{PICTURE}?.naturalWidth", START_S)
        yield page


def overlap(one: list[float], other: list[float]) -> bool:
    return all(min(one[i + 2], other[i + 2]) - max(one[i], other[i]) > 1.0 for i in (0, 1))


@pytest.mark.parametrize("window", WINDOWS)
def test_controls_are_legible_and_nothing_overlaps(page: Page, window: str, tmp_path: Path) -> None:
    page.resize(*WINDOWS[window])
    opened = page.evaluate("!!document.querySelector('.jp-FileBrowser')?.offsetParent")
    if opened == (window == "phone"):
        page.evaluate("void jupyterapp.commands.execute('application:toggle-left-area')")
    page.evaluate("document.querySelector('.jp-OutputArea-output').scrollIntoView()")
    shown = page.settled(MEASURE)
    page.screenshot(tmp_path / f"{window}.png")
    assert [name for name, _ in shown["controls"]] == ["kind", "models", "x", "y", *SLIDERS]
    assert min(right - left for _, (left, _, right, _) in shown["controls"]) >= MIN_CONTROL_PX
    assert min(right - left for left, _, right, _ in shown["tracks"]) >= MIN_TRACK_PX
    # the title under the mouse is whole
    assert shown["cut"] == SLIDERS[3:]
    # no law is hidden above or below those that are shown
    assert shown["lists"] == [[0, 0]]
    parts = shown["parts"]
    assert [(a, b) for i, a in enumerate(parts) for b in parts[:i] if overlap(a[1], b[1])] == []
    left, top, right, _ = shown["picture"]
    assert shown["output"][0] <= left < right <= shown["output"][2]
    assert right - left > 0.5 * (shown["output"][2] - shown["output"][0])
    _, (_, _, controls_right, controls_bottom) = shown["controls"][-1]
    assert (top >= controls_bottom) if window == "phone" else (left >= controls_right)


def set_field(page: Page, number: int, text: str) -> None:
    """Type a number into the field of a slider."""
    field = f"document.querySelectorAll('.widget-readout')[{number}]"
    page.evaluate(f"{field}.focus(); getSelection().selectAllChildren({field})")
    page.call("Input.insertText", text=text)
    page.press("Enter")


def pixels(png: bytes) -> Any:
    return image.imread(io.BytesIO(png))


def test_a_number_off_the_grid_is_integrated_again(page: Page) -> None:
    before = page.png()
    page.evaluate(WATCH)
    set_field(page, 2, "2.5")
    page.wait_for("pictures > 0 && messages.at(-1)?.startsWith('m2 = 2.5')")
    assert page.evaluate("messages[0]") == "computing …"
    sweep = impact.sweep({**CONFIG, "sweep": {**CONFIG["sweep"], "m2": [2.5]}})
    for model in CONFIG["models"]:
        run = impact.run(CONFIG, model=model, at={"m2": 2.5, "v1": 0.01, "e": 0.05})
        e_out = sweep["e_out"].sel(model=model, e=0.05, v1=0.01, m2=2.5).values[0]
        assert e_out == pytest.approx(run.values["e_out"], rel=1e-12)
    expected = io.BytesIO()
    impact.plot(sweep, kind="restitution", width=WIDTH_INCHES).savefig(expected, dpi=DPI)
    assert np.array_equal(pixels(page.png()), pixels(expected.getvalue()))
    assert page.png() != before


def test_a_slider_that_moves_fast_draws_its_last_value(page: Page) -> None:
    page.evaluate(WATCH)
    before = page.png()
    page.evaluate("document.querySelectorAll('.noUi-handle')[1].focus()")
    for _ in range(20):
        page.press("ArrowRight")
    # each press is a step of the slider; a picture for each would queue up
    value = float(page.evaluate("document.querySelectorAll('.widget-readout')[1].textContent"))
    assert value == pytest.approx(0.01 * 10.0**0.2, rel=1e-5)
    page.wait_for(f"pictures > 0 && messages.at(-1)?.startsWith('v1 = {value:.6g}')")
    assert page.settled("pictures") < 10
    assert page.png() != before
