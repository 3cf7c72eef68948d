"""Run many solvers at the same time, and evaluate what they ask for in one batch.

A solver such as `scipy.optimize.least_squares` asks for one value at a time, and a vectorised function is fast
only for many. Here each solver runs in a thread, one after the other until it asks for a value; when all of them
wait, their requests are evaluated together.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import CancelledError, Future, ThreadPoolExecutor
from functools import partial
from queue import SimpleQueue
from typing import TypeVar

import numpy as np

from ..array_types import Array

T = TypeVar("T")
# rows (k, p) to values (k, n)
VectorFunction = Callable[[Array], Array]
# called by a solver: a function, and rows of its arguments
Evaluate = Callable[[VectorFunction, Array], Array]
# threads at a time
MAX_THREADS = 256


def run_together(solvers: Sequence[Callable[[Evaluate], T]]) -> list[T]:
    """Run solvers, each called with `evaluate(function, rows)`, and evaluate their requests in batches.

    A result does not depend on the other solvers, as long as the functions treat each row separately.

    >>> square = lambda rows: rows**2
    >>> def root_of(y):
    ...     def newton(evaluate):
    ...         x = np.ones(1)
    ...         for _ in range(8):
    ...             x = x - (evaluate(square, x[None, :])[0] - y) / (2 * x)
    ...         return float(x[0].round(12))
    ...     return newton
    >>> run_together([root_of(4.0), root_of(9.0)])
    [2.0, 3.0]
    """
    if len(solvers) > MAX_THREADS:
        first, others = solvers[:MAX_THREADS], solvers[MAX_THREADS:]
        return [*run_together(first), *run_together(others)]
    # the turn of the running solver ends with a request, or with its future
    turns: SimpleQueue[Future[T] | None] = SimpleQueue()
    answers: list[SimpleQueue[Array | None]] = [SimpleQueue() for _ in solvers]
    futures: list[Future[T]] = []
    requests: dict[int, tuple[VectorFunction, Array]] = {}

    def evaluate(number: int, function: VectorFunction, rows: Array) -> Array:
        requests[number] = function, rows
        turns.put(None)
        answer = answers[number].get()
        if answer is None:
            # a function or another solver failed
            raise CancelledError
        return answer

    def wait_for_turn() -> None:
        """Let a solver run alone: threads that compete for the interpreter's lock cost more time."""
        if (finished := turns.get()) is not None:
            finished.result()

    with ThreadPoolExecutor(MAX_THREADS) as executor:
        try:
            for number, solver in enumerate(solvers):
                futures.append(executor.submit(solver, partial(evaluate, number)))
                futures[-1].add_done_callback(turns.put)
                wait_for_turn()
            while requests:
                values: dict[int, Array] = {}
                # those of one function together, in the order of the solvers
                for function in dict.fromkeys(function for function, _ in requests.values()):
                    numbers = sorted(number for number in requests if requests[number][0] == function)
                    rows = [requests[number][1] for number in numbers]
                    ends = np.cumsum([len(block) for block in rows])[:-1]
                    values.update(zip(numbers, np.split(function(np.concatenate(rows)), ends), strict=True))
                requests.clear()
                for number in sorted(values):
                    answers[number].put(values[number])
                    wait_for_turn()
        finally:
            for answer in answers:
                answer.put(None)
    return [future.result() for future in futures]
