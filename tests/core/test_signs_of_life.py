"""Work on arrays beside a window: its signs of life, its result, what it raises, and that it ends when it is closed."""

import time

import pytest

from pdm_core.signs_of_life import finish, in_thread


def test_work_in_a_thread_gives_its_result_and_signs_of_life_meanwhile():
    signs = []
    assert finish(in_thread(lambda: time.sleep(0.1) or 7), signs.append) == 7
    assert len(signs) >= 2


def test_what_work_in_a_thread_raises_is_raised():
    with pytest.raises(ZeroDivisionError):
        finish(in_thread(lambda: 1 // 0))


def test_steps_in_a_thread_are_driven_to_their_end():
    def steps():
        for _ in range(3):
            yield
        return 5

    assert finish(in_thread(steps)) == 5


def test_steps_in_a_thread_end_at_the_next_when_closed():
    done = []

    def steps():
        try:
            for k in range(1000):
                time.sleep(0.01)
                done.append(k)
                yield
        finally:
            done.append("closed")

    work = in_thread(steps)
    next(work)
    work.close()
    assert done[-1] == "closed" and len(done) < 100
