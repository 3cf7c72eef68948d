"""Imports only go down the floors of the house, and each library has its one floor."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

SOURCE = Path(__file__).parent.parent / "src" / "impact"
FLOORS = {
    "": 0, "errors": 0, "text": 0, "formatting": 0, "ode": 1, "contact": 2, "config": 3, "engine": 4, "results": 5,
    "comparison": 6, "plots": 7, "reporting": 8, "api": 9, "cli": 10, "__main__": 11, "atomic": 0,
}  # fmt: skip
# where each library may be imported
LIBRARIES = {
    "typer": {"cli"}, "rich": {"cli"}, "matplotlib": {"plots"}, "pandas": {"plots"}, "jinja2": {"reporting"},
    "markupsafe": {"reporting"}, "xarray": {"results", "comparison"},
    "h5py": {"results"}, "h5netcdf": {"results"}, "tomllib": {"config"}, "pydantic": {"config", "results"},
    "pydantic_core": {"config"},
    "pint": {"config"}, "filelock": {"engine"}, "numba": {"contact"},
    "dask": {"engine"}, "distributed": {"engine"},
}  # fmt: skip
MODULES = sorted(SOURCE.rglob("*.py"))


def floor_of(path: Path) -> str:
    """The floor that a module belongs to: the first part of its path."""
    parts = path.relative_to(SOURCE).with_suffix("").parts
    return "" if parts == ("__init__",) else parts[0]


def imports(path: Path) -> list[tuple[str, bool]]:
    """What a module imports, as absolute names, and whether for type checking only."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    typing_only = {
        id(inner)
        for node in ast.walk(tree)
        if isinstance(node, ast.If) and getattr(node.test, "id", "") == "TYPE_CHECKING"
        for inner in ast.walk(node)
    }
    package = ["impact", *path.relative_to(SOURCE).parts[:-1]]
    found = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found += [(alias.name, id(node) in typing_only) for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) + 1 - node.level] if node.level else []
            stem = ".".join([*base, *([node.module] if node.module else [])])
            names = [f"{stem}.{alias.name}" for alias in node.names] if stem == "impact" else [stem]
            found += [(name, id(node) in typing_only) for name in names]
    return found


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(SOURCE)))
def test_imports_go_down(path: Path) -> None:
    own = FLOORS[floor_of(path)]
    for name, typing_only in imports(path):
        if name.split(".")[0] == "impact":
            part = name.split(".")[1] if "." in name else ""
            target = FLOORS.get(part, 0)
            # the package itself loads the floors below it lazily, on first use
            assert target <= own or floor_of(path) == "", f"{path.name} imports {name}, which is above it"
        elif not typing_only and name.split(".")[0] in LIBRARIES:
            assert floor_of(path) in LIBRARIES[name.split(".")[0]], f"{path.name} imports {name}"


def test_every_module_has_a_floor_and_a_docstring() -> None:
    for path in MODULES:
        assert floor_of(path) in FLOORS
        text = path.read_text(encoding="utf-8")
        assert not text or ast.get_docstring(ast.parse(text)), f"{path.name} does not say what it holds"
