"""The examination finds this very installation sound, and says so when it is not."""

from types import SimpleNamespace

from fem_impact import doctor
from fem_impact.show import pictures


def test_this_installation_is_sound(monkeypatch):
    monkeypatch.setattr(pictures, "can_render", lambda: True)  # takes long, and may fail on a sound installation
    findings = doctor.examine()
    assert [finding.name for finding in findings if not finding.works] == []
    assert all(finding.remedy == "" for finding in findings)


def test_what_fails_comes_with_its_remedy_and_reason_and_missing_rendering_is_no_failure(monkeypatch, prompt):
    def fail():
        raise OSError("no font")

    monkeypatch.setattr(pictures, "can_render", lambda: False)
    said = prompt("doctor")
    assert said.status == 0 and "3-D rendering          missing" in said.out
    monkeypatch.setattr(doctor, "_picture", fail)
    said = prompt("doctor")
    assert said.status == 1 and "reinstall matplotlib (OSError: no font)" in " ".join(said.out.split())
    assert said.err == "fem-impact: pictures: not working; see above\n"


def test_wrong_numbers_are_a_failure(monkeypatch):
    monkeypatch.setattr(doctor, "find_modes", lambda *_, **__: SimpleNamespace(omega=[20.0]))
    assert doctor._tried("x", doctor._finite_elements, "do").remedy == "do"
