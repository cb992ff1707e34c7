"""What the commands of a test with a hammer do: choose one, plan where it taps, and judge each tap."""

import argparse
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

import fem_impact as fi

from . import replies
from ._base import check
from ._base.explained import lines_of_notes
from ._base.files import staged_folder
from .scenes.sentences import tip_notes

MASSES = [m * 10.0**e for e in (-3, -2, -1) for m in (1.0, 2.0, 5.0)] + [1.0]  # [kg] of hammers from 1 g to 1 kg


def run_hammer(options: argparse.Namespace) -> replies.Answer:
    scene = fi.load_scene(options.scene)
    masses = options.masses or MASSES
    notes = tip_notes(scene)
    if options.catalogue is not None:
        return _sheets(options, scene, notes)
    if options.rove is not None:
        return _rove(options, scene, masses, notes)
    drawn = replies.picture_of(options, "hammers.png")
    with replies.progress_of(options, announces=True)("hammers"):
        body, at = scene.built.target, scene.blow.values["at"]  # its own striker and contact are ignored
        hammers = fi.hammers.choose_on(body, at, options.bandwidth, masses, drop=options.drop, between=True)
        if drawn is not None:
            from .show import plots  # imported only when needed, as matplotlib takes a second

            drawn.parent.mkdir(parents=True, exist_ok=True)
            fi.figures.save(drawn, plots.hammers(hammers, options.bandwidth, options.drop))
    notes = (*notes, *hammers[0].notes)
    rows = [
        (f"{1e3 * hammer.mass:.4g} g{' *' * hammer.border}", f"{hammer.softest:.3g} N/m" if hammer.softest else "none",
         f"{'> ' * hammer.unlimited}{hammer.hardest:.3g} N/m" if hammer.hardest else "none",
         f"{hammer.reach:.4g} Hz" if hammer.reach else "-")
        for hammer in hammers
    ]  # fmt: skip
    said: list[str | Sequence[str]] = [
        replies.title_of(scene),
        *lines_of_notes(notes),
        f"Linear tips that reach {options.bandwidth:g} Hz (spectrum at most {options.drop:g} dB down) and hit once:",
        replies.as_table(rows, ("mass", "softest tip", "hardest tip", "its reach")),
    ]
    for hammer in (each for each in hammers if len(each.working) > 1):
        ranges = ", ".join(f"{low:.3g} to {high:.3g} N/m" for low, high in hammer.working)
        said.append(f"{1e3 * hammer.mass:.4g} g: every range that works: {ranges}")
    if any(hammer.unlimited for hammer in hammers):
        said.append(">: still a single hit with the hardest tip that the model resolves")
    if any(hammer.border for hammer in hammers):
        said.append("*: the last mass that works between two that were asked for, found to half a per cent")
    idle = ", ".join(f"{1e3 * hammer.mass:.4g} g" for hammer in hammers if not hammer.works)
    if idle:
        said.append(f"{idle}: no tip reaches {options.bandwidth:g} Hz and hits once; try lighter hammers")
    data = {"bandwidth": options.bandwidth, "drop": options.drop, "hammers": [hammer.data() for hammer in hammers]}
    return replies.answer({**data, "notes": notes}, *said, path=drawn)


def _rove(options: argparse.Namespace, scene: Any, masses: Sequence[float], notes: Sequence[str]) -> replies.Answer:
    """Plan a test with a roving hammer."""
    from .taps import roving  # imported only when needed

    number, drawn = check.count("--rove", options.rove), replies.picture_of(options, "rove.png")
    with replies.progress_of(options, announces=True)("points"):
        plan = roving.of_scene(scene, masses, options.bandwidth, options.drop, number)
        if drawn is not None:
            with staged_folder(drawn.parent) as staging:
                fi.figures.save(staging / drawn.name, plan.figure())
                plan.write_csv((staging / drawn.name).with_suffix(".csv"))
    files = [] if drawn is None else [drawn.name, drawn.with_suffix(".csv").name]
    return _answer_of_plan(scene, plan, notes, folder=drawn and drawn.parent, files=files)


def _answer_of_plan(scene: Any, plan: Any, notes: Sequence[str], **files: Any) -> replies.Answer:
    data = {"table": plan.table(), "verdicts": plan.verdicts, "resolution": plan.resolution}
    said = [replies.title_of(scene), *lines_of_notes(notes), plan.summary()]
    return replies.answer({**data, "notes": [*notes, *plan.notes]}, *said, **files)


def _sheets(options: argparse.Namespace, scene: Any, notes: Sequence[str]) -> replies.Answer:
    """Which hammers of the catalogue suit a scene, as one sheet per point."""
    from .pages import hammer_sheet  # imported only when needed
    from .taps import roving

    if options.masses:
        raise ValueError("--masses must be left out beside --catalogue, whose hammers have their own")
    number = None if options.rove is None else check.count("--rove", options.rove)
    path = replies.page_of(options, "hammers.html")
    with replies.progress_of(options, announces=True)("points"):
        heaviest = scene.built.target.mass  # heavier ones load a panel so that its modes are others
        kit = roving.hammers_known(options.catalogue, options.bandwidth, options.drop, heaviest)
        plan = roving.of_scene(scene, kit, options.bandwidth, options.drop, number)
    with staged_folder(path.parent) as staging:
        hammer_sheet.write_sheets(staging / path.name, plan, title=replies.title_of(scene), notes=tuple(notes))
    return _answer_of_plan(scene, plan, notes, path=path)


def run_frf(options: argparse.Namespace) -> replies.Answer:
    from .taps import prompt  # imported only when needed

    out: Path | None = options.out
    files = [] if out is None else [out] if out.suffix else [out / "frf.csv", out / "frf.html"]
    for path in files:
        check.ending(path, ".csv", ".uff", ".html")
    if options.against is not None and not any(path.suffix.lower() == ".html" for path in files):
        raise ValueError("--against is for the page: give --out a folder, or a name that ends in .html")
    with replies.progress_of(options)("frequency responses"):
        measured = prompt.frf(options)
    peaks = prompt.peaks(measured.found)
    rows = [
        (each["response"], f"{each['frequency']:.5g} Hz", f"{each['magnitude']:.4g} {each['unit']}",
         "" if each["coherence"] is None else f"{each['coherence']:.3f}",
         "" if each["error"] is None else f"{100.0 * each['error'] / each['magnitude']:.2g} %")
        for each in peaks
    ]  # fmt: skip
    said = [
        *lines_of_notes(measured.notes),
        replies.as_table(rows, ("response", "peak at", "magnitude", "coherence", "within")),
        *([] if rows else ["No peak is larger than its error"]),
    ]
    data = {"peaks": peaks, "notes": measured.notes}
    if not files:
        return replies.answer(data, *said)
    with staged_folder(files[0].parent) as staging:
        for path in files:
            if path.suffix.lower() == ".html":
                _write_page(staging / path.name, options, measured)
            else:
                prompt.write_frf(staging / path.name, measured.found)
    return replies.answer(data, *said, folder=files[0].parent, files=[path.name for path in files])


def _write_page(path: Path, options: argparse.Namespace, measured: Any) -> None:
    """The page about frequency responses, beside the modes of the scene measured or of the one to compare with."""
    from .pages import frf_page  # imported only when needed

    scene = measured.scene if options.against is None else fi.load_scene(options.against)
    with replies.progress_of(options)("page"):
        found, computed, points = measured.found, None, None
        if scene is not None and len(scene.points) == found.sizes["channel"]:
            points, computed = np.array(scene.points, float), scene.modes(frf_page.COMPARED)
        elif options.against is not None:
            raise ValueError(
                f"--against must be a scene with one observation point for each of {found.sizes['channel']} "
                f"responses, got {len(scene.points)}; list them in [observe]"
            )
        title = f"Taps of {options.scene.name}"
        frf_page.write_responses(path, found, title=title, taps=measured.taps, computed=computed, points=points)


def run_watch(options: argparse.Namespace) -> replies.Answer | None:
    from .taps.watch import Folder  # imported only when needed

    folder, watched = Folder(options.scene), _Watched(options)
    if not options.once:
        replies.remark(options, f"watching {folder.path}; Ctrl-C stops it")
    while True:
        new = watched.judged(folder.look())
        taps = [one for each in watched.every.values() for one in each]
        n_good = sum(one.good for one in taps)
        options.last = f"stopped; {n_good} of {len(taps)} taps in {len(watched.every)} files were good"
        if new and not options.once:
            options.show(watched.report_on(new))
        if options.once and not folder.waiting:
            return watched.report_on(taps)
        time.sleep(0.5)  # a file that nobody wrote to for so long is complete


class _Watched:
    """The advice on every record of a folder so far."""

    def __init__(self, options: argparse.Namespace) -> None:
        self.options = options
        self.bandwidth = check.positive("--bandwidth", options.bandwidth, "Hz")
        self.drop = check.between("--drop", options.drop, 1.0, 40.0, "dB")
        self.path = replies.file_of(options, "watch.png") or Path("out") / options.scene.resolve().name / "watch.png"
        self.every: dict[str, list[Any]] = {}  # name of a file: `Advice` of each of its taps
        self.good: dict[str, Any] = {}  # the same: its good taps

    def judged(self, paths: Sequence[Path]) -> list[Any]:
        """Advice on every tap of some files; the picture shows the last of them."""
        from .taps import prompt  # imported only when needed
        from .taps.watch import Advice, advice

        new, last = [], None
        for path in paths:
            self.good.pop(path.name, None)  # it may have been written again
            try:
                taps = prompt.taps_of(self.options, path)
                found = [advice(path.name, taps, i, self.bandwidth, self.drop) for i in range(taps.n_taps)]
            except ValueError as error:
                found = [Advice(path.name, "", False, f"cannot be judged: {error}", None, None)]
            else:
                last = taps, found[-1]
                if any(each.good for each in found):
                    self.good[path.name] = taps.pick([each.good for each in found])
            self.every[path.name] = found
            new += found
        if last is not None:
            self._draw(*last)
        return new

    def _draw(self, last: Any, advice: Any) -> None:
        """Write the picture; of good taps those count that are sampled as the last ones are."""
        from .pages import tap_pictures  # imported only when needed
        from .taps.windows import join_tables

        alike = [each for each in self.good.values() if (each.rate, each.units) == (last.rate, last.units)]
        good = join_tables(alike) if alike else None
        self.path.parent.mkdir(parents=True, exist_ok=True)
        said = f"{advice.file}, {advice.tap}: {advice.said}"
        fi.figures.save(self.path, tap_pictures.figure_of_record(last, good, self.bandwidth, self.drop, said))

    def report_on(self, records: Sequence[Any]) -> replies.Answer:
        """The answer that lists some records."""
        lines = [f"{one.file}{', ' * bool(one.tap)}{one.tap}: {one.said}" for one in records]
        n_good = sum(each.n_taps for each in self.good.values())
        data = {"records": [each._asdict() for each in records], "n_good": n_good}
        drawn = self.path if self.path.is_file() and records else None
        return replies.answer(data, *(lines or ["no records yet"]), path=drawn)
