"""Trace which modules of the package a call of `impact.sweep` visits, and how often a call goes back up.

The call sweeps configs/figure6.toml into a file. It is made twice and traced the second time, so that imports do
not count. What counts is a call from a function of one module to a function of another, once for each pair of
functions, so that loops do not matter; a lambda or a comprehension is a part of its module. A call goes back up if
the module that is called imports the calling one, directly or through others (a callback, or a generator that goes
on), or if it re-enters a module that is on the stack. The numerics (`contact` and `ode`), which turn arrays into
arrays, and what has no subject of the config (`atomic`, `errors`, `text` ...) are counted apart.

    python scripts/trace_call.py                  this source
    python scripts/trace_call.py --src OTHER/src  another one
"""

from __future__ import annotations

import argparse
import ast
import sys
import tempfile
from pathlib import Path
from types import CodeType, FrameType
from typing import NamedTuple

ROOT = Path(__file__).parent.parent
APART = ("contact", "ode", "atomic", "errors", "text", "formatting", "array_types", "_version")


class Call(NamedTuple):
    """A call from a function to another, each with the name of its module."""

    caller: str
    called: str
    function: str
    is_reentry: bool


def imported_modules(package: Path) -> dict[str, set[str]]:
    """Collect by module all modules that it imports, directly or through others."""
    names = {module_name(path, package): path for path in package.rglob("*.py")}
    direct: dict[str, set[str]] = {name: set() for name in names}
    for name, path in names.items():
        parts = [*path.relative_to(package).parts[:-1]]
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom) and node.level:
                base = parts[: len(parts) + 1 - node.level] + (node.module.split(".") if node.module else [])
                targets = [".".join(base), *(".".join([*base, alias.name]) for alias in node.names)]
                direct[name] |= {target for target in targets if target in names}
    while True:
        larger = {name: targets.union(*(direct[target] for target in targets)) for name, targets in direct.items()}
        if larger == direct:
            return direct
        direct = larger


def module_name(path: Path, package: Path) -> str:
    """Name a module without the package, "" for the package itself."""
    return ".".join(path.relative_to(package).with_suffix("").parts).removesuffix("__init__").removesuffix(".")


def trace(package: Path, config: Path) -> list[Call]:
    """Sweep a config into a file, and list the distinct calls between modules in order."""
    import impact

    calls: list[Call] = []
    seen: set[tuple[CodeType, CodeType]] = set()
    names: dict[CodeType, str | None] = {}

    def name_of(code: CodeType) -> str | None:
        if code not in names:
            path = Path(code.co_filename)
            names[code] = module_name(path, package) if package in path.parents else None
        return names[code]

    def on_event(frame: FrameType, event: str, _: object) -> None:
        called = name_of(frame.f_code) if event == "call" else None
        caller = frame.f_back
        while called is not None and caller is not None and name_of(caller.f_code) is None:
            caller = caller.f_back
        if called is None or caller is None or (caller.f_code, frame.f_code) in seen:
            return
        seen.add((caller.f_code, frame.f_code))
        if name_of(caller.f_code) == called:
            return
        above, stack = caller.f_back, set()
        while above is not None:
            stack.add(name_of(above.f_code))
            above = above.f_back
        calls.append(Call(str(name_of(caller.f_code)), called, frame.f_code.co_qualname, called in stack))

    with tempfile.TemporaryDirectory() as folder:
        impact.sweep(config, output=f"{folder}/first.h5")
        sys.setprofile(on_event)
        try:
            impact.sweep(config, output=f"{folder}/second.h5")
        finally:
            sys.setprofile(None)
    return calls


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--src", type=Path, default=ROOT / "src", help="folder of the package")
    parser.add_argument("--list", action="store_true", help="print the modules and the calls back up")
    args = parser.parse_args()
    package = args.src.resolve() / "impact"
    sys.path.insert(0, str(package.parent))
    imported = imported_modules(package)
    calls = trace(package, ROOT / "configs" / "figure6.toml")
    modules = dict.fromkeys(call.called for call in calls)
    inner = [name for name in modules if name.partition(".")[0] not in APART]
    back_up = [call for call in calls if call.is_reentry or call.caller in imported[call.called]]
    inner_back_up = [call for call in back_up if call.called in inner and call.caller in inner]
    print(f"all: {len(modules)} modules, {len(calls)} calls between them, {len(back_up)} of these back up")
    print(
        f"of config, engine, results and the interface: {len(inner)} modules, {len(inner_back_up)} calls back up"
    )
    if args.list:
        print("modules:", ", ".join(name or "impact" for name in modules))
        for call in back_up:
            print(f"  {call.caller} -> {call.called} {call.function}{' (re-enters)' if call.is_reentry else ''}")


if __name__ == "__main__":
    main()
