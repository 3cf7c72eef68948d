"""Threads take turns at what is not compiled: half of them at a time, but for what they do aside."""

import faulthandler
import threading
import time
from collections.abc import Iterator

import pytest

from impact.contact.turns import aside
from impact.engine.executors import team_of

THREADS = 4


@pytest.fixture(autouse=True)
def in_time() -> Iterator[None]:
    """A thread that waits for ever ends with its process only, which fails the test."""
    faulthandler.dump_traceback_later(30.0, exit=True)
    yield
    faulthandler.cancel_dump_traceback_later()


def test_half_of_the_threads_have_a_turn_at_a_time():
    here, most, lock = 0, [], threading.Lock()

    def work(_: int) -> None:
        nonlocal here
        with lock:
            here += 1
            most.append(here)
        time.sleep(0.01)
        with lock:
            here -= 1

    with team_of(threads=THREADS).executor() as executor:
        list(executor.map(work, range(20)))
    assert max(most) == THREADS // 2


def test_all_threads_may_be_aside():
    all_of_them = threading.Barrier(THREADS)

    def work(_: int) -> None:
        with aside():
            # broken after a time if one of them waits for a turn
            all_of_them.wait(timeout=10.0)

    with team_of(threads=THREADS).executor() as executor:
        list(executor.map(work, range(THREADS)))


def test_a_turn_is_given_back_by_work_that_raises():
    def work(number: int) -> int:
        with aside():
            if number % 2:
                raise ValueError(number)
        return number

    with team_of(threads=THREADS).executor() as executor:
        futures = [executor.submit(work, number) for number in range(20)]
        for number, future in enumerate(futures):
            if number % 2:
                with pytest.raises(ValueError, match=str(number)):
                    future.result(timeout=10.0)
            else:
                assert future.result(timeout=10.0) == number


def test_without_a_turn_aside_is_nothing():
    with aside():
        pass
