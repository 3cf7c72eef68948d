"""Run a Python function as an adapter: `python serve.py FILE.py:FUNCTION [DESCRIPTOR]`.

It answers each line of JSON on stdin by one on stdout, or on another descriptor. It needs nothing but Python, so
that the interpreter of an engine can run it. What the function or the engine prints goes to stderr.
"""

from __future__ import annotations

import importlib.util
import json
import os
import sys
from collections.abc import Callable
from typing import Any


def load_function(word: str) -> Callable[[dict[str, Any]], dict[str, Any]]:
    """Load the function of FILE.py:FUNCTION; modules next to the file come last in the search."""
    path, _, name = word.rpartition(":")
    sys.path.append(os.path.dirname(os.path.abspath(path)))
    spec = importlib.util.spec_from_file_location("_impact_adapter", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    function: Callable[[dict[str, Any]], dict[str, Any]] = getattr(module, name)
    return function


def main(word: str, descriptor: str = "1", *_: str) -> None:
    """Answer the lines on stdin until it ends; further words are of the adapter."""
    answers = os.fdopen(os.dup(int(descriptor)), "w", encoding="utf-8")
    # also what a library prints by itself
    os.dup2(2, 1)
    function = load_function(word)
    for line in sys.stdin:
        # numbers of numpy are no numbers of JSON
        print(json.dumps(function(json.loads(line)), default=float), file=answers, flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
