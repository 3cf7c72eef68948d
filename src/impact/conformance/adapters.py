"""Adapters: what turns a collision of a set into an answer, a function or a program that speaks lines of JSON.

A Python function of a file is run by `serve.py` in a process of its own, so that it can neither hang nor end this
one.
"""

from __future__ import annotations

import json
import os
import re
import select
import shlex
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any, SupportsFloat

from ..contact.frictions import frictions
from ..contact.models import catalogue
from ..errors import UsageError, did_you_mean
from ..exporters.programs import MAX_OUTPUT_BYTES, POLL_INTERVAL_S, end_of, find_program, kill, start
from ..formatting import argument, number, safe_text
from .checks import KIND_TOLERANCES, Answer, Kind, balls_of
from .suite import Question

DEFAULT_TIMEOUT_S = 60.0
# what an adapter may state about its engine, as text
FACTS = ("engine", "version", "kind", "precision", "law", "model")
# the contact force where an adapter names a friction law only: a linear spring with a dashpot
DEFAULT_MODEL = "anagnostopoulos-1988"
# the longest line of an answer
MAX_LINE_BYTES = 2**16
SERVE = Path(__file__).with_name("serve.py")
PYTHON_FUNCTION = re.compile(r".+\.py:[^\W\d]\w*")
# how C and C++ print what is no number, which JSON does not have
NOT_A_NUMBER = re.compile(r"(?<=[:\s,])([-+]?(?:nan|inf))[a-z0-9()]*(?=\s*[,}])", re.IGNORECASE)

Ask = Callable[[Question], object]


@dataclass(frozen=True)
class Facts:
    """What an adapter states about its engine in its first answer.

    Parameters
    ----------
    engine, version : "" where it does not state them
    kind : whether it solves impulses or has a compliant contact
    is_float32 : it computes in single precision
    law, model, parameters : key of the friction law that it has, that of its contact force, and the parameters of
        the friction law; "" for rigid friction
    """

    engine: str
    version: str
    kind: Kind
    is_float32: bool
    law: str
    model: str
    parameters: Mapping[str, float | str]


class AdapterError(UsageError):
    """An adapter does not answer as the protocol says; the message names the argument."""

    def __init__(self, text: str) -> None:
        super().__init__(f"{argument('adapter')}: {text}")


@contextmanager
def open_adapter(adapter: object, timeout_s: float, folder: str | None = None) -> Iterator[Ask]:
    """Start an adapter, and yield the function that asks it.

    Parameters
    ----------
    adapter : a function, `FILE.py:FUNCTION`, a command line, or the words of one
    timeout_s : time that it has for an answer [s]; that of a function which is passed as such is not limited
    folder : where it runs; by default the working directory
    """
    if callable(adapter):
        yield adapter
        return
    words = _command(adapter)
    with tempfile.TemporaryFile() as errors:
        try:
            process = start(words, folder, bufsize=0, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=errors)
        except OSError as error:
            raise AdapterError(f"{words[0]}: {error.strerror}") from None
        with process:
            try:
                yield _Conversation(process, errors, timeout_s).ask
            finally:
                kill(process)


def _command(adapter: object) -> list[str]:
    """Make the words of the command of an adapter."""
    if isinstance(adapter, str) and PYTHON_FUNCTION.fullmatch(adapter):
        path = Path(adapter.rpartition(":")[0])
        if os.path.isfile(path):
            return [sys.executable, str(SERVE), str(Path(adapter).absolute())]
        # it may also be the last word of a command
        if " " not in str(path):
            raise AdapterError(f"{path}: {'is no file' if os.path.exists(path) else 'does not exist'}")
    if not isinstance(adapter, str | Sequence) or not "".join(map(str, adapter)).strip():
        raise AdapterError(f'got {adapter!r}, expected FILE.py:FUNCTION or "PROGRAM ARGUMENTS"')
    try:
        # a backslash separates folders on Windows, and escapes nothing
        text = str(adapter).replace("\\", r"\\") if os.name == "nt" else str(adapter)
        words = shlex.split(text) if isinstance(adapter, str) else [str(word) for word in adapter]
    except ValueError as error:
        raise AdapterError(f"{adapter}: {error}") from None
    program = find_program(words[0], None)
    if program is None:
        raise AdapterError(f'no executable program "{words[0]}"; expected FILE.py:FUNCTION or "PROGRAM ARGUMENTS"')
    return [program, *words[1:]]


@dataclass
class _Conversation:
    """A program that gets a line on stdin for each line on its stdout."""

    process: subprocess.Popen[bytes]
    errors: IO[bytes]
    timeout_s: float
    received: bytes = b""

    def ask(self, question: Question) -> object:
        """Send a question, and wait for the line with the answer."""
        assert self.process.stdin is not None
        name = f"collision {question['id']}"
        # a program that has ended may have printed before
        with suppress(BrokenPipeError):
            self.process.stdin.write(json.dumps(question).encode() + b"\n")
        line = self._read_line(name)
        try:
            text = line.decode()
            try:
                return json.loads(text)
            except ValueError:
                return json.loads(NOT_A_NUMBER.sub(lambda match: json.dumps(float(match[1])), text))
        except ValueError:
            shown = safe_text(line.decode(errors="replace"), 80)
            raise AdapterError(f'{name}: got "{shown}", expected one line of JSON on stdout') from None

    def _read_line(self, name: str) -> bytes:
        assert self.process.stdout is not None
        deadline, descriptor = time.monotonic() + self.timeout_s, self.process.stdout.fileno()
        while b"\n" not in self.received:
            if time.monotonic() > deadline:
                raise AdapterError(f"{name}: no answer after {number(self.timeout_s)} s ({argument('timeout')})")
            if len(self.received) > MAX_LINE_BYTES:
                raise AdapterError(f"{name}: a line of more than {MAX_LINE_BYTES >> 10} KiB")
            if os.fstat(self.errors.fileno()).st_size > MAX_OUTPUT_BYTES:
                raise AdapterError(f"{name}: more than {MAX_OUTPUT_BYTES >> 20} MiB on stderr")
            # Windows cannot wait for a pipe, so that a silent adapter is not stopped there
            if sys.platform == "win32" or select.select([descriptor], [], [], POLL_INTERVAL_S)[0]:
                content = os.read(descriptor, MAX_LINE_BYTES)
                if not content:
                    raise self._ended(name)
                self.received += content
        line, _, self.received = self.received.partition(b"\n")
        return line

    def _ended(self, name: str) -> AdapterError:
        """Describe how the program ended, with the last line that it printed on stderr."""
        try:
            code = f"exit code {self.process.wait(self.timeout_s)}"
        except subprocess.TimeoutExpired:
            code = "its stdout closed"
        lines = end_of(self.errors).strip().splitlines()
        last = f": {safe_text(lines[-1])}" if lines else ""
        return AdapterError(f"{name}: the adapter ended with {code}{last}")


def read_answer(question: Question, answer: object) -> Answer | None:
    """Read the velocities and spins of an answer; None where the engine does not support the collision.

    A null is not a number; values of a wall are ignored.

    Raises
    ------
    AdapterError : it is no answer to the question
    """
    name = f"collision {question['id']}"
    if not isinstance(answer, Mapping):
        raise AdapterError(f"{name}: got {_shown(answer)}, expected an object of JSON")
    if answer.get("id") != question["id"]:
        raise AdapterError(f"{name}: got an answer to {_shown(answer.get('id'))}")
    if answer.get("error") is not None:
        return None
    values = {}
    for key in (f"{quantity}{ball}" for quantity in ("v", "u", "omega") for ball in balls_of(question)):
        if key not in answer:
            raise AdapterError(f"{name}: the answer has no {key}")
        value = answer[key]
        if isinstance(value, str | bool) or not isinstance(value, SupportsFloat | None):
            raise AdapterError(f"{name}: {key}: got {_shown(value)}, expected a number")
        values[key] = float("nan") if value is None else float(value)
    return values


def read_facts(answer: Any) -> Facts:
    """Read what the first answer states about the engine."""
    facts = {key: answer.get(key, "") for key in FACTS}
    for key, value in facts.items():
        if not isinstance(value, str):
            raise AdapterError(f"{key}: got {_shown(value)}, expected text")
    for key, words in (("kind", KIND_TOLERANCES), ("precision", ("float32", "float64"))):
        if facts[key] not in ("", *words):
            raise AdapterError(f"{key}: got {_shown(facts[key])}, expected {' or '.join(words)}")
    for key, noun, laws in (("law", "friction law", frictions()), ("model", "law", catalogue())):
        if facts[key] and facts[key] not in laws:
            raise AdapterError(f'{key}: no {noun} "{facts[key]}"; {did_you_mean(facts[key], list(laws))}')
    kind: Kind = "compliant" if facts["kind"] == "compliant" else "impulse"
    parameters = answer.get("parameters") or {}
    if not isinstance(parameters, Mapping):
        raise AdapterError(f"parameters: got {_shown(parameters)}, expected an object of JSON")
    return Facts(
        engine=safe_text(facts["engine"], 60),
        version=safe_text(facts["version"], 60),
        kind=kind,
        is_float32=facts["precision"] == "float32",
        law=facts["law"],
        model=facts["model"] or DEFAULT_MODEL,
        parameters=dict(parameters),
    )


def _shown(value: object) -> str:
    return safe_text(repr(value), 60)
