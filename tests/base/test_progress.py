"""Loops report to whoever listens, and to nobody else."""

from fem_impact._base import progress


def test_reports_go_to_the_innermost_listener():
    heard = []
    progress.report("modes", 1, 2)  # nobody listens
    with progress.heard(lambda *told: heard.append(("outer", *told))):
        progress.report("modes", 1, 2)
        with progress.heard(lambda *told: heard.append(("inner", *told))):
            progress.report("vectors", 3, 4)
        with progress.heard(None):
            progress.report("vectors", 4, 4)
        progress.report("modes", 2, 2)
    progress.report("modes", 1, 2)
    assert heard == [("outer", "modes", 1, 2), ("inner", "vectors", 3, 4), ("outer", "modes", 2, 2)]


def test_silence_returns_after_a_failure():
    heard = []
    try:
        with progress.heard(lambda *told: heard.append(told)):
            raise RuntimeError
    except RuntimeError:
        progress.report("modes", 1, 2)
    assert heard == []
