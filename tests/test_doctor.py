"""The examination finds this very installation sound, and says so when it is not."""

from fem_impact import cli, doctor
from fem_impact.show import pictures


def test_this_installation_is_sound(monkeypatch):
    monkeypatch.setattr(pictures, "can_render", lambda: True)  # takes long, and may fail on a sound installation
    findings = doctor.examine()
    assert [finding.name for finding in findings if not finding.works] == []
    assert all(finding.remedy == "" for finding in findings)


def test_what_fails_comes_with_its_remedy_and_reason(monkeypatch, capsys):
    def fail():
        raise OSError("no font")

    monkeypatch.setattr(doctor, "_picture", fail)
    monkeypatch.setattr(pictures, "can_render", lambda: False)
    assert cli.main(["doctor"]) == 1
    captured = capsys.readouterr()
    assert "reinstall matplotlib (OSError: no font)" in " ".join(captured.out.split())
    assert captured.err == "fem-impact: pictures: not working; see above\n"


def test_missing_rendering_is_no_failure(monkeypatch, capsys):
    monkeypatch.setattr(pictures, "can_render", lambda: False)
    assert cli.main(["doctor"]) == 0
    assert "3-D rendering          missing" in capsys.readouterr().out


def test_wrong_numbers_are_a_failure(monkeypatch):
    monkeypatch.setattr(doctor, "SQUARE", 20.0)
    assert doctor._tried("x", doctor._finite_elements, "do").remedy == "do"
