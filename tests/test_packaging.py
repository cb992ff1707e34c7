"""What is built from the repository: an sdist and a wheel that install and strike elsewhere, at old versions, too."""

import os
import re
import subprocess
import tarfile
import tomllib
import venv
import zipfile
from email import message_from_bytes
from pathlib import Path

import pytest
import yaml
from scenes import ROOT

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
LICENCE = (ROOT / "LICENSE").read_text(encoding="utf-8")
AUTHORS = "the fem_impact authors"
LOWEST = [re.match(r"([\w-]+)>=([\d.]+)", each).groups() for each in PROJECT["dependencies"]]
UNAVAILABLE = re.compile(r"No matching distribution|Could not find a version|Connection|Temporary failure|timed out")


def test_the_licence_is_the_one_the_package_declares():
    assert PROJECT["license"] == "BSD-3-Clause" and PROJECT["license-files"] == ["LICENSE"]
    assert LICENCE.startswith(f"BSD 3-Clause License\n\nCopyright (c) {AUTHORS}\n")
    assert all(words in LICENCE for words in ("Redistributions in binary form", "Neither the name", '"AS IS"'))
    assert PROJECT["license"] in (ROOT / "README.md").read_text(encoding="utf-8")


def test_the_citation_is_that_of_this_version():
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert {"cff-version", "message", "title", "authors"} <= set(citation)  # what format 1.2.0 requires
    assert citation["cff-version"] == "1.2.0" and citation["type"] == "software"
    assert citation["version"] == PROJECT["version"] and citation["license"] == PROJECT["license"]
    assert citation["authors"] == [{"name": AUTHORS}] and PROJECT["authors"] == [{"name": AUTHORS}]
    assert not {"url", "repository", "repository-code", "doi"} & set(citation) and "urls" not in PROJECT


def test_the_changelog_has_this_version_and_every_dependency_a_lower_bound():
    assert f"\n## {PROJECT['version']}\n" in (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    assert len(LOWEST) == len(PROJECT["dependencies"])


def environment(folder):
    """The Python of a new environment."""
    if os.name != "posix":
        pytest.skip("environments have another layout here")
    venv.create(folder, with_pip=True, symlinks=True)
    return folder / "bin" / "python"


def run(*words, folder):
    return subprocess.run([*map(str, words)], cwd=folder, capture_output=True, text=True, timeout=1800)


def install(python, *what):
    """Install by pip, or skip where packages cannot be had."""
    done = run(python, "-m", "pip", "install", "--quiet", *what, folder=ROOT)
    if done.returncode and UNAVAILABLE.search(done.stderr):
        pytest.skip(f"not to be had here: {done.stderr.strip().splitlines()[-1]}")
    assert done.returncode == 0, done.stderr


def strike_elsewhere(python, folder):
    """Use the installed package from a folder that knows nothing of the repository."""
    folder.mkdir()
    (folder / "first_use.py").write_text((ROOT / "tests" / "first_use.py").read_text(encoding="utf-8"))
    where = run(python, "-P", "-c", "import fem_impact; print(fem_impact.__file__)", folder=folder).stdout
    assert where and not Path(where).is_relative_to(ROOT)
    done = run(python, "-P", "first_use.py", folder, folder=folder)
    assert done.returncode == 0 and f"fem_impact {PROJECT['version']} works" in done.stdout, done.stdout + done.stderr


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """The sdist, and the wheel made from it."""
    folder = tmp_path_factory.mktemp("built")
    python = environment(folder / "venv")
    install(python, "hatchling>=1.27")
    done = run(python, "-m", "hatchling", "build", "-t", "sdist", "-d", folder, folder=ROOT)
    assert done.returncode == 0, done.stderr
    (sdist,) = folder.glob("*.tar.gz")
    words = ("wheel", "--quiet", "--no-deps", "--no-build-isolation", "--wheel-dir", folder, sdist)
    done = run(python, "-m", "pip", *words, folder=folder)
    assert done.returncode == 0, done.stderr
    return sdist, next(folder.glob("*.whl"))


@pytest.mark.slow
def test_sdist_and_wheel_hold_what_they_should(built):
    with tarfile.open(built[0]) as sdist:
        top = {name.split("/")[1] for name in sdist.getnames()}
    assert {"LICENSE", "README.md", "CHANGELOG.md", "CITATION.cff", "fem_impact", "tests", "studies", "meshes"} <= top
    assert not {".ci", ".git", ".venv", "out"} & top
    with zipfile.ZipFile(built[1]) as wheel:
        names = wheel.namelist()
        info = next(name.split("/")[0] for name in names if ".dist-info/" in name)
        assert wheel.read(f"{info}/licenses/LICENSE").decode() == LICENCE
        about = message_from_bytes(wheel.read(f"{info}/METADATA"))
    assert {name.split("/")[0] for name in names} == {"fem_impact", info}
    assert about["Author"] == AUTHORS and about["License-Expression"] == "BSD-3-Clause"
    assert "all" in about.get_all("Provides-Extra") and about["Project-URL"] is None and about["Home-page"] is None


@pytest.mark.slow
def test_the_wheel_strikes_outside_the_repository_at_the_lowest_versions_of_all_dependencies(built, tmp_path):
    python = environment(tmp_path / "venv")
    install(python, "--only-binary=:all:", built[1], *(f"{name}=={version}" for name, version in LOWEST))
    strike_elsewhere(python, tmp_path / "elsewhere")
    found = run(python, "-m", "pip", "list", "--format=freeze", folder=tmp_path).stdout.lower()
    for name, version in LOWEST:
        assert re.search(rf"^{name}=={re.escape(version)}(\.0)*$", found, re.MULTILINE), name
