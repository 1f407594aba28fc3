"""Progress bars: an interrupt ends the work even where Python loses the exception."""

import gc
import signal

import pytest

from coverdrive.progress import stages


def interrupt(phase: str, info: dict[str, int]) -> None:
    """A callback of the garbage collector in which the interrupt arrives."""
    if phase == "start":
        signal.raise_signal(signal.SIGINT)


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_an_interrupt_that_python_drops_ends_the_stage_at_its_next_report() -> None:
    with pytest.raises(KeyboardInterrupt), stages() as bars:
        bars.report("work", 0.1)
        gc.callbacks.append(interrupt)
        gc.collect()
        gc.callbacks.remove(interrupt)
        bars.report("work", 0.2)
        pytest.fail("the interrupt was lost")
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_without_an_interrupt_the_work_goes_on() -> None:
    with stages() as bars:
        count = bars.count("trials")
        for trial in range(3):
            count(trial, 3)
