"""Run the notebooks of the documentation and store their outputs.

python scripts/notebooks.py
"""

from __future__ import annotations

import re
from base64 import b64decode, b64encode
from io import BytesIO
from pathlib import Path

import nbformat
from nbclient import NotebookClient
from nbformat import NotebookNode
from PIL import Image

NOTEBOOKS = Path(__file__).parents[1] / "docs" / "notebooks"
TIMEOUT_S = 300
# of a picture that is stored
COLOURS = 48
# controls, which need a running notebook
CONTROLS = "application/vnd.jupyter.widget-view+json"


def executed(path: Path) -> NotebookNode:
    """The notebook with the outputs of a run in its folder.

    Raises
    ------
    CellExecutionError : a cell fails
    """
    notebook = nbformat.read(path, as_version=4)
    # a time in the metadata of a cell would change with each run
    client = NotebookClient(
        notebook,
        timeout=TIMEOUT_S,
        record_timing=False,
        coalesce_streams=True,
        store_widget_state=False,
        resources={"metadata": {"path": str(path.parent)}},
    )
    client.execute()
    return notebook


def texts(notebook: NotebookNode) -> list[list[str]]:
    """The outputs of each cell but controls, as text with numbers of four digits; of a picture, that it is one."""
    return [
        [_text(output) for output in cell.outputs if CONTROLS not in output.get("data", {})]
        for cell in notebook.cells
        if cell.cell_type == "code"
    ]


def _text(output: NotebookNode) -> str:
    data = output.get("data", {})
    if "image/png" in data:
        return "picture"
    # a smaller number is a residual, whose digits depend on the machine
    return re.sub(
        r"-?\d+\.\d*(e[-+]\d+)?",
        lambda match: f"{float(match[0]):.4g}" if abs(float(match[0])) > 1e-8 else "0",
        str(data["text/plain"] if data else output.text),
    )


def as_stored(notebook: NotebookNode) -> NotebookNode:
    """The notebook without controls, and with pictures of few colours, a fourth of their size.

    MyST-NB reads the text for screen readers from the cell, and not from the picture.
    """
    for cell in notebook.cells:
        if "outputs" in cell:
            cell.outputs = [output for output in cell.outputs if CONTROLS not in output.get("data", {})]
        for output in cell.get("outputs", ()):
            data = output.get("data", {})
            if "image/png" in data:
                if alt := output.metadata.get("image/png", {}).get("alt"):
                    cell.metadata["mystnb"] = {"image": {"alt": alt}}
                small = BytesIO()
                picture = Image.open(BytesIO(b64decode(data["image/png"]))).convert("RGB")
                picture.quantize(COLOURS, dither=Image.Dither.NONE).save(small, "png", optimize=True)
                data["image/png"] = b64encode(small.getvalue()).decode()
    return notebook


def main() -> None:
    for path in sorted(NOTEBOOKS.glob("*.ipynb")):
        nbformat.write(as_stored(executed(path)), path)


if __name__ == "__main__":
    main()
