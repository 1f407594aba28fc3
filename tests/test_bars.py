"""Progress bars: an interrupt ends the work even where Python loses the exception."""

import gc
import signal

import pytest
from rich.console import Console

from coverdrive.cli.shared import bars as module
from coverdrive.cli.shared.bars import display, report, stages, waiting
from coverdrive.progress import done, stage


def interrupt(phase: str, info: dict[str, int]) -> None:
    """A callback of the garbage collector in which the interrupt arrives."""
    if phase == "start":
        signal.raise_signal(signal.SIGINT)


def test_an_interrupt_that_python_would_drop_ends_the_stage_at_its_next_report(heeds_interrupts: None) -> None:
    with pytest.raises(KeyboardInterrupt) as stopped, stages(kept="drives"), stage("work"):
        done(0.1)
        gc.callbacks.append(interrupt)
        gc.collect()
        gc.callbacks.remove(interrupt)
        done(0.2)
        pytest.fail("the interrupt was lost")
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    assert stopped.value.__notes__ == ["drives are kept, and the same command goes on from them"]


def test_a_stage_with_known_progress_has_a_time_left() -> None:
    """Half a minute for each of four steps, three of which are done."""
    now = 0.0
    bars = display(lambda: now)
    for count in range(4):
        now = 30.0 * count
        report(bars, "trials", count / 4)
    assert bars.tasks[0].time_remaining == 30


def test_work_without_a_known_end_says_what_it_is(capsys: pytest.CaptureFixture[str], monkeypatch) -> None:
    monkeypatch.setattr(module, "console", Console(stderr=True, force_terminal=True))
    with waiting("loading"):
        pass
    assert "loading" in capsys.readouterr().err


def test_without_an_interrupt_the_work_goes_on() -> None:
    with stages(), stage("trials"):
        for trial in range(3):
            done(trial, 3)


@pytest.mark.parametrize("width", [40, 80])
def test_the_name_of_a_stage_is_no_markup(width: int) -> None:
    bars = display()
    report(bars, "[red]a=[1, 2]", 0.5)
    console = Console(width=width)
    with console.capture() as capture:
        console.print(bars.get_renderable())
    assert "[red]a=[1" in "".join(line[:14].strip() for line in capture.get().splitlines()) and " 50%" in capture.get()
