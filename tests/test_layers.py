"""Imports only go down from floor to floor and one way within a floor; each library has its packages."""

from __future__ import annotations

import ast
import functools
from collections.abc import Callable
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

SOURCE = Path(__file__).parent.parent / "src" / "impact"
# the floors of docs/architecture.md, from the lowest; a part imports from those before it, and from itself
FLOORS = {
    "foundations": ("_version", "array_types", "formatting", "errors", "arguments", "atomic", "display"),
    "numerics": ("ode", "contact"),
    "config": ("config",),
    "sweeps": ("engine", "progress_display", "results"),
    "acts": ("inverse", "uncertainty", "comparison", "exporters", "plots", "reporting", "conformance"),
    # the package itself, "", hands out the public functions
    "interfaces": ("", "cli", "pytest_plugin", "__main__"),
}
ORDER = [part for parts in FLOORS.values() for part in parts]
# where each library may be imported
LIBRARIES = {
    "typer": {"cli"}, "rich": {"display", "progress_display"}, "matplotlib": {"plots"},
    "pandas": {"display", "inverse", "plots"}, "ipywidgets": {"plots"}, "jinja2": {"exporters", "reporting"},
    "markupsafe": {"reporting"},
    "xarray": {"results", "comparison", "inverse", "uncertainty", "plots", "reporting", "pytest_plugin"},
    "h5py": {"results"}, "h5netcdf": {"results"}, "tomllib": {"config"}, "pydantic": {"config", "results"},
    "pydantic_core": {"config"},
    "pint": {"config"}, "filelock": {"engine", "pytest_plugin"}, "numba": {"contact"},
    "scipy": {"config", "inverse", "results", "uncertainty"},
    "dask": {"engine"}, "distributed": {"engine"}, "pytest": {"pytest_plugin"},
}  # fmt: skip
# what a module of cli may import apart from public names, foundations and other modules of cli
CLI_IMPORTS = {
    # tables of names
    "completion": {"config", "conformance", "contact", "engine", "exporters", "plots"},
    # formats of a verdict, the picture of its differences, and functions whose keywords are deprecated for users
    "compare": {"comparison.verdict", "comparison.bless", "comparison.rerun", "plots"},
    "sweep": {"uncertainty.sensitivity"},
    # the executors, which have no public function
    "execution": {"engine", "results.sweep"},
    # a value in TOML
    "options": {"config.files"},
    "plot": {"plots.kinds"},
    # a history as CSV
    "run": {"plots.data"},
}
MODULES = sorted(SOURCE.rglob("*.py"))


def part_of(path: Path) -> str:
    """The package or module of the top level that a module belongs to; "" for the package itself."""
    parts = path.relative_to(SOURCE).with_suffix("").parts
    return "" if parts == ("__init__",) else parts[0]


@functools.cache
def imports(path: Path, *, inside_functions: bool = True) -> list[tuple[str, bool]]:
    """What a module imports, as absolute names, and whether for type checking only."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    nodes = list(ast.walk(tree))
    typing_only = nodes_inside(
        tree, lambda node: isinstance(node, ast.If) and getattr(node.test, "id", "") == "TYPE_CHECKING"
    )
    if not inside_functions:
        in_functions = nodes_inside(tree, lambda node: isinstance(node, ast.FunctionDef))
        nodes = [node for node in nodes if node not in in_functions]
    package = ["impact", *path.relative_to(SOURCE).parts[:-1]]
    names = []
    for node in nodes:
        if isinstance(node, ast.Import):
            names += [(alias.name, node in typing_only) for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) + 1 - node.level] if node.level else []
            stem = ".".join([*base, *([node.module] if node.module else [])])
            # what is imported from a package may be one of its modules
            is_package = (SOURCE.parent / stem.replace(".", "/")).is_dir()
            names += [
                (f"{stem}.{alias.name}" if is_package else stem, node in typing_only) for alias in node.names
            ]
    return names


def nodes_inside(tree: ast.AST, is_block: Callable[[ast.AST], bool]) -> set[ast.AST]:
    """The nodes inside some blocks of a tree."""
    return {inner for node in ast.walk(tree) if is_block(node) for inner in ast.walk(node)}


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(SOURCE)))
def test_imports_go_down(path: Path) -> None:
    part = part_of(path)
    for name, typing_only in imports(path):
        library, _, rest = name.partition(".")
        if library == "impact":
            target = rest.partition(".")[0]
            assert ORDER.index(target) <= ORDER.index(part), f"{path.name} imports {name}, which comes after it"
        elif not typing_only and library in LIBRARIES:
            assert part in LIBRARIES[library], f"{path.name} imports {name}"


@pytest.mark.parametrize("path", sorted((SOURCE / "cli").glob("*.py")), ids=lambda path: path.stem)
def test_a_command_imports_public_names(path: Path) -> None:
    for name, typing_only in imports(path):
        library, _, rest = name.partition(".")
        if library != "impact" or typing_only or rest.partition(".")[0] in {"", "cli", *FLOORS["foundations"]}:
            continue
        allowed = CLI_IMPORTS.get(path.stem, set())
        assert any(f"{rest}.".startswith(f"{part}.") for part in allowed), f"{path.name} imports {name}"


def test_modules_import_each_other_in_one_direction() -> None:
    names = {".".join(["impact", *path.relative_to(SOURCE).with_suffix("").parts]): path for path in MODULES}
    graph = {
        module: [
            name
            for name, typing_only in imports(path, inside_functions=False)
            if name in names and not typing_only
        ]
        for module, path in names.items()
    }
    TopologicalSorter(graph).prepare()


@pytest.mark.parametrize("package", sorted(path.parent.name for path in SOURCE.glob("*/__init__.py")))
def test_modules_of_a_package_need_no_circle_for_their_types(package: str) -> None:
    paths = {
        ".".join(["impact", *path.relative_to(SOURCE).with_suffix("").parts]): path
        for path in (SOURCE / package).rglob("*.py")
    }
    graph = {
        module: [name for name, _ in imports(path, inside_functions=False) if name in paths]
        for module, path in paths.items()
    }
    TopologicalSorter(graph).prepare()


def test_every_module_has_a_floor_and_a_docstring() -> None:
    for path in MODULES:
        assert part_of(path) in ORDER
        text = path.read_text(encoding="utf-8")
        assert not text or ast.get_docstring(ast.parse(text)), f"{path.name} does not say what it holds"
