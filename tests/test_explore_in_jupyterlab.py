"""The controls of `impact.explore` in JupyterLab, in a real browser: widths, and what a slider does."""

from __future__ import annotations

import base64
import json
import shutil
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any
from urllib.request import urlopen

import pytest

from .conftest import ROOT

# a server, a kernel and a browser: `make test-faults` runs them
pytestmark = pytest.mark.slow

SETUP = """\
import json
import impact
config = {
    "models": ["hertz", "hunt-crossley-1975", "lankarani-nikravesh-1990"],
    "sweep": {
        "e": {"linspace": [0.05, 0.95, 41]},
        "v1": {"geomspace": [0.01, 10.0, 4]},
        "m1": 1.0,
        "m2": [1.0, 4.0, 10.0],
        "K": 1e9,
    },
}
box = impact.explore(impact.sweep(config), kind="final-velocities", sel={"m2": 4.0})
box"""
# the picture of another sweep, at values that the controls are at
EXPECTED = """\
import base64, io
sweep = {**config["sweep"], "m2": M2}
buffer = io.BytesIO()
other = impact.plot(impact.sweep({**config, "sweep": sweep}), kind="final-velocities", sel={"m2": M2}, width=5.5)
other.savefig(buffer, dpi=150)
shot = impact.run({**config, "sweep": sweep}, model="hunt-crossley-1975", at={"e": 0.05})
print("expected", base64.b64encode(buffer.getvalue()).decode())"""
START_S, CHANGE_S = 25.0, 60.0
# of the window, and of the output of the cell
MIN_CONTROL_PX, MIN_TRACK_PX, MIN_LABEL_PX = 240, 60, 20
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
    parts: [...output.querySelectorAll('label, select, .noUi-target, .widget-readout, img')].map(box),
    tracks: [...output.querySelectorAll('.noUi-target')].map(box),
    cut: [...output.querySelectorAll('label')].filter(one => one.scrollWidth > one.clientWidth + 1).map(text),
    scrolls: output.scrollWidth > output.clientWidth + 1,
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
            if time.monotonic() >= end: self.screenshot(Path("/tmp/dbg.png"))
            assert time.monotonic() < end, f"{expression} is {value} after {limit_s} s"
            time.sleep(every_s)
        return value

    def resize(self, width: int, height: int) -> None:
        self.call(
            "Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False
        )
        time.sleep(1.0)

    def screenshot(self, path: Path) -> None:
        path.write_bytes(base64.b64decode(self.call("Page.captureScreenshot")["data"]))

    def press(self, key: str, code: int, text: str = "") -> None:
        for kind in ("keyDown", "keyUp"):
            typed = {"text": text} if text and kind == "keyDown" else {}
            self.call("Input.dispatchKeyEvent", type=kind, key=key, windowsVirtualKeyCode=code, **typed)


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


@pytest.fixture(scope="module")
def page(chromium: str, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Page]:
    """JupyterLab with a notebook whose cells have run, in a browser."""
    pytest.importorskip("jupyterlab", reason="no JupyterLab here: how controls look in it is not tested")
    folder = tmp_path_factory.mktemp("lab")
    code = {"cell_type": "code", "metadata": {}, "outputs": [], "execution_count": None}
    cells = [{**code, "id": f"cell-{number}", "source": text} for number, text in enumerate((SETUP, "pass"))]
    kernel = {"name": "python3", "display_name": "Python", "language": "python"}
    notebook = {"cells": cells, "metadata": {"kernelspec": kernel}, "nbformat": 4, "nbformat_minor": 5}
    (folder / "work").mkdir()
    (folder / "work" / "explore.ipynb").write_text(json.dumps(notebook), encoding="utf-8")
    # without the question about news, which covers a corner
    settings = folder / "settings" / "@jupyterlab" / "apputils-extension" / "notification.jupyterlab-settings"
    settings.parent.mkdir(parents=True)
    settings.write_text('{"fetchNews": "false"}', encoding="utf-8")
    ports = free_port(), free_port()
    lab = [
        *(sys.executable, "-m", "jupyterlab", "--no-browser", "--allow-root", f"--port={ports[0]}"),
        *("--IdentityProvider.token=", "--LabApp.expose_app_in_browser=True", f"--ServerApp.root_dir={folder}/work"),
        *(f"--LabApp.user_settings_dir={folder}/settings", f"--LabApp.workspaces_dir={folder}/workspaces"),
    ]
    browser = [
        *(chromium, "--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage"),
        *(f"--remote-debugging-port={ports[1]}", f"--user-data-dir={folder}/profile", "about:blank"),
    ]
    with ExitStack() as stack:
        log = stack.enter_context((folder / "log.txt").open("w"))
        for command in (lab, browser):
            process = stack.enter_context(subprocess.Popen(command, stdout=log, stderr=log, cwd=folder))
            stack.callback(process.terminate)
        answer_of(f"http://127.0.0.1:{ports[0]}/api")
        targets = json.loads(answer_of(f"http://127.0.0.1:{ports[1]}/json"))
        page = Page(next(one["webSocketDebuggerUrl"] for one in targets if one["type"] == "page"))
        stack.callback(page.socket.close)
        page.resize(1280, 900)
        page.call("Page.navigate", url=f"http://127.0.0.1:{ports[0]}/lab/tree/explore.ipynb")
        page.wait_for(READY, START_S)
        page.wait_for(RUN, START_S, every_s=3.0)
        page.wait_for(f"!!{PICTURE}?.naturalWidth", START_S)
        yield page
