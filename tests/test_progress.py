"""Progress is heard by whom it concerns, and by nobody else."""

import threading

import pytest

from coverdrive.progress import done, heard_by, part, stage


def test_stages_report_their_begin_their_shares_and_their_end() -> None:
    heard = []
    with heard_by(lambda *each: heard.append(each)), stage("reading"):
        done(1, 4)
    assert heard == [("reading", 0.0), ("reading", 0.25), ("reading", 1.0)]


def test_parts_share_their_stage_evenly() -> None:
    heard = []
    with heard_by(lambda *each: heard.append(each)), stage("reading"):
        for number in range(2):
            with part(number, 2), part(0, 1):
                done(1, 2)
    assert [share for _, share in heard] == [0, 0, 0, 0.25, 0.5, 0.5, 0.5, 0.5, 0.75, 1, 1, 1]


def test_a_stage_within_a_stage_has_a_bar_of_its_own_and_gives_way_to_the_outer_one() -> None:
    heard = []
    with heard_by(lambda *each: heard.append(each)), stage("outer"):
        with stage("inner"):
            done(1, 2)
        done(1, 2)
    assert heard == [("outer", 0), ("inner", 0), ("inner", 0.5), ("inner", 1), ("outer", 0.5), ("outer", 1)]


def test_an_error_is_no_end_of_a_stage() -> None:
    heard = []
    with pytest.raises(ValueError, match="broken"), heard_by(lambda *each: heard.append(each)), stage("reading"):
        raise ValueError("broken")
    assert heard == [("reading", 0.0)]
    done(1)


def test_what_a_listener_raises_ends_the_work() -> None:
    def stop(name: str, share: float) -> None:
        if share > 0:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt), heard_by(stop), stage("reading"):
        done(1, 2)
        pytest.fail("went on")


def test_nobody_hears_other_threads_nor_work_outside_a_stage() -> None:
    heard = []

    def work() -> None:
        with stage("elsewhere"):
            done(1, 2)

    with heard_by(lambda *each: heard.append(each)):
        done(1, 2)
        with part(0, 2):
            done(1, 2)
        thread = threading.Thread(target=work)
        thread.start()
        thread.join()
    assert heard == []
