"""What the commands do: each reads its options, calls the library and returns its answer; contains no physics.

`arguments.COMMANDS` says in words what each of them is for.
"""

import argparse
import math
import time
import warnings
import webbrowser
from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import fem_impact as fi

from . import answers
from ._base.explained import lines_of_notes
from ._base.files import staged_folder
from .display import ANNOUNCED, Display
from .replies import (
    Answer,
    answer,
    as_table,
    file_of,
    folder_of,
    page_of,
    picture_of,
    progress_of,
    remark,
    title_of,
)
from .show import FORMATS


def run_strike(options: argparse.Namespace) -> Answer:
    from ._base import check  # imported only when needed
    from .impact import promise
    from .model.target import Stages
    from .show.painter import Painter

    began = time.perf_counter()
    if options.duration is not None:
        check.positive("--duration", options.duration, "s")
    scene = fi.load_scene(options.scene)
    if options.listener is not None:
        scene = scene.heard_from(*options.listener)
    if options.band:
        from .scenes import band  # loads libraries that no other strike needs

        band.check_known(scene)
    if options.film:
        check.extra("imageio_ffmpeg", "film", "an MP4 file")
    if scene.stroke:
        return _strike_in_turn(options, scene)
    folder, display = folder_of(options), progress_of(options, announces=True)
    with staged_folder(folder, "strike") as staging, Painter() if options.pictures else nullcontext() as painter:
        place = folder.resolve()  # "." has no name of its own
        keep = place.parent / f"{place.name}.modes.npz"  # not in the folder: an interrupted run leaves that alone
        motion = options.pictures or options.vtk or options.film
        before = partial(_announce, options, display, options.verify, True)
        run = scene.run(display, before=before, verify=options.verify, motion=motion, keep=keep, **_choices(options))
        display.predict(run.plan.ringing or None)
        if options.strict:
            promise.warn_if_missed(run.response, strict=True)
        stages = Stages(display)
        data = _write(staging, scene, run, options, stages, painter)
    keep.unlink(missing_ok=True)
    if options.band:
        with display("blows"):
            found = band.band_around(scene, run)
    seconds = {**run.seconds, **stages.seconds, "total": time.perf_counter() - began}
    said: list[str | Sequence[str]] = [title_of(scene), run.response.summary()]
    if options.band:
        data |= {"band": found.data()}
        said.append(found.summary().splitlines())
    if not run.rings:
        why = run.plan.reasons[0]
        said.append(f"Model: {why}; no modes and no sound (use --target modal or --quantity sound=5000)")
    if run.verified is not None and run.finer is not None:
        coarse = run.finer.target in ("rigid", "infinite")
        tested = f" (which also treats the body as {run.finer.target}: it has too many modes)" if coarse else ""
        differences = ", ".join(f"{name} {value:.1e}" for name, value in run.verified.items())
        said.append(f"Verified by a finer run{tested}: {differences}")
    said += describe_sounds(data.get("sounds", ()))
    said.append("Time: " + ", ".join(f"{name} {value:.2f} s" for name, value in seconds.items()))
    return answer(data, *said, folder=folder, files=data["files"], missed=not run.response.tolerance_met)


def _announce(options: argparse.Namespace, display: Display, verify: bool, files: bool, plan: Any) -> None:
    """Warn of a long run before it starts, and let its prediction set the time left; ``files`` may take modes."""
    display.predict(None if verify else plan.seconds)  # the plan of the second, finer run is not known yet
    more = f", and {plan.ringing:.0f} s for the modes of its files" if files and plan.ringing > ANNOUNCED else ""
    if plan.costly or more:
        text = f"{plan.cost}{more}; Ctrl-C stops it, and the same command later reuses the modes already found"
        remark(options, f"{text} (`fem-impact plan` explains why)")


def _write(
    folder: Path, scene: Any, run: Any, options: argparse.Namespace, stages: Any, painter: Any
) -> dict[str, Any]:
    """Write every file of a strike; return the contents of response.json."""
    from .scenes import results  # imported only when needed
    from .show import sampling
    from .show.canvas import NAMES

    response = run.response
    if run.plan.target == "vectors" and response.ringing is None:
        with stages("modes"):
            # not `on`: a coarser mesh than theirs serves a soft contact, and under a point a membrane yields less by it
            response = replace(response, ringing=response.target, rings=None, vectors=None)
    drawn = painter is not None and run.rings
    if drawn:
        painter.begin(folder, response, options.format)
    files, sounds = _write_force_and_sounds(folder, scene, response, options, stages, rings=run.rings)
    extra: dict[str, Any] = {}
    if run.rings:
        first = {"at": "sound", "listener": "radiated"}  # the keys of the first point and listener
        for sound in reversed(sounds):
            extra.update({first[name]: sound for name in first if name in sound})
        extra["sounds"] = sounds
        if options.vtk:
            end = sampling.end_of(response)
            with stages("motion"):  # 100 instants are four seconds at 25 per second
                times = [end * i / 99 for i in range(100)]
                fi.export.write_vtk(folder / "motion.pvd", response.target, response, times)
            files.append("motion.pvd")
        if options.film:
            with stages("film"):
                fi.slow_motion.write(folder / "slow_motion.mp4", response)
            files += ["slow_motion.mp4", "slow_motion.vtt"]
        if drawn:
            with stages("pictures"):
                missing = painter.finish()
            if missing:
                remark(options, f"pictures are drawn in two dimensions; {missing}")
            files += [*(f"{name}.{options.format}" for name in NAMES), "wave.gif"]
    if run.verified is not None:
        extra["verified"] = run.verified
    changes = {name: value for name, value in run.plan.changes.items() if name in ("tolerance", "quantity")}
    tables, copies = scene.kept(folder, **changes)
    with stages("assumptions"):
        numbers = fi.export.run_data(run, tables)
    data = numbers | fi.export.plain({**extra, "files": files + copies})
    results.save_response(folder, response, scene.points, data)
    return data


def _write_force_and_sounds(
    folder: Path, scene: Any, response: Any, options: argparse.Namespace, stages: Any, rings: bool = True
) -> tuple[list[str], list[dict[str, Any]]]:
    """Write the force and, of modes that ring, shapes and sounds; returns the names of all files, and the sounds."""
    from .scenes import hearing, results  # imported only when needed

    files = ["response.json", results.SAVED, "force.csv", f"force.{options.format}"]
    with stages("files"):
        fi.export.write_force(folder / "force.csv", response)
        fi.figures.save(folder / f"force.{options.format}", fi.figures.force(response))
        if rings:  # `modes --vtk` writes any number of shapes
            fi.export.write_vtk(folder / "modes.pvd", response.target.truncated(n_modes=24))
    if not rings:
        return files, []
    with stages("sound"):
        sounds = hearing.write_sounds(folder, scene, response, duration=options.duration, normalise=options.normalise)
    return [*files, "modes.pvd", *(each["file"] for each in sounds)], sounds


def _strike_in_turn(options: argparse.Namespace, scene: Any) -> Answer:
    """Play the strokes of a scene and write what they did."""
    from .model.target import Stages  # imported only when needed
    from .scenes import results, sequence

    given = {name: getattr(options, name) for name in ("verify", "pictures", "film", "vtk", "target")}
    wrong = next((name for name, value in given.items() if value), None)
    if wrong:
        raise ValueError(f"--{wrong} must be left out for a scene with strokes")
    began = time.perf_counter()
    folder, display = folder_of(options), progress_of(options)
    with staged_folder(folder, "strike") as staging, warnings.catch_warnings():
        warnings.simplefilter("ignore", fi.ToleranceWarning)  # the first line of the summary says it
        stages = Stages(display)
        found = scene.play(watch=display, strict=options.strict, **_choices(options))
        files, sounds = _write_force_and_sounds(staging, scene, found, options, stages)
        tables, copies = scene.kept(staging, tolerance=found.tolerance)
        seconds = {**stages.seconds, "total": time.perf_counter() - began}
        data = {**sequence.sequence_numbers(found, tables, seconds), "sounds": sounds, "files": files + copies}
        results.save_response(staging, found, scene.points, data)
    said = [title_of(scene), found.summary(), *describe_sounds(sounds), f"Time: {seconds['total']:.2f} s"]
    return answer(data, *said, folder=folder, files=data["files"], missed=not found.tolerance_met)


def describe_sounds(sounds: Sequence[dict[str, Any]]) -> list[str]:
    """A line for each sound: its peak without rigid motions, and what a sample of 1 in its file means."""
    lines = []
    for each in sounds:
        where = "Point" if "at" in each else "Listener" if "listener" in each else "Both listeners"
        if each.get("bound") == "low":  # the other one's line states both
            continue
        level = each["stated"] if "bound" in each else f"audible peak {each['stated']}"
        if each["level"] is None or each["level"] == -math.inf:
            level = "silence"
        files = f"{each['file'].replace('_high', '_low')} and {each['file']}" if "bound" in each else each["file"]
        lines.append(f"{where}: {level}; full scale of {files} is {each['full_scale']:.4g} {each['unit']}")
    return lines


def run_plan(options: argparse.Namespace) -> Answer:
    scene = fi.load_scene(options.scene)
    plan = (scene.plan_strokes if scene.stroke else scene.plan)(watch=progress_of(options), **_choices(options))
    return answer(plan.data(), title_of(scene), str(plan))


def run_map(options: argparse.Namespace) -> Answer:
    from .scenes import maps  # imported only when needed

    began = time.perf_counter()
    chosen = {word in FORMATS: word for word in options.format}  # of pictures and of numbers
    form, picture = maps.can_write(chosen.get(False, "nc"), options.out), chosen.get(True, FORMATS[0])
    scene = fi.load_scene(options.scene)
    folder = folder_of(options)
    with staged_folder(folder, "map") as staging:
        display = progress_of(options)
        with display("cells"):
            table = maps.map_scene(
                scene, tolerance=options.tolerance, workers=options.workers, client=options.cluster,
                store=options.store, watch=partial(display.report, "cells"), max_cells=options.max_cells,
                tell=partial(remark, options), stage=display, cells=options.cells,
                borders=True if options.borders else None, refine=False if options.every_cell else None,
            )  # fmt: skip
        with display("files"):
            names = maps.write_map(staging, table, form, picture)
    axes = {str(name): size for name, size in table.n_impacts.sizes.items()}
    single, failed = int((table.n_impacts == 1).sum()), int((table.n_impacts < 0).sum())
    data: dict[str, Any] = {"n_blows": table.n_impacts.size, "axes": axes, "n_single": single, "n_failed": failed}
    over = ", ".join(f"{name} ({size})" for name, size in axes.items())
    blows = f"{table.n_impacts.size} blow{'s' * (table.n_impacts.size != 1)}"
    said = [title_of(scene), f"{blows} over {over}: {single} hit once, {failed} failed"]
    for name in ("cells", "borders"):
        if name in table.attrs:
            data[name] = table.attrs[name]
            said.append(f"{name.capitalize()}: {table.attrs[name]}")
    if "model_error" in table:
        unknown = table.model_error.attrs["not_known"]
        low, high = float(table.model_error.min()), float(table.model_error.max())
        data["model_error"] = {"low": low, "high": high, "not_known": unknown}
        not_known = f"; not known: {unknown}" if unknown else ""
        said.append(f"Model error: {low:.1g} to {high:.1g}{not_known}")
    data |= {"notes": table.attrs["notes"].splitlines(), "seconds": {"total": time.perf_counter() - began}}
    said += [*lines_of_notes(data["notes"]), f"Time: {data['seconds']['total']:.2f} s"]
    return answer(data, *said, folder=folder, files=names)


def run_spread(options: argparse.Namespace) -> Answer:
    from .scenes import uncertainty  # imported only when needed

    began = time.perf_counter()
    folder = folder_of(options)
    scene = fi.load_scene(options.scene)
    vary = dict(_split("--vary", text) for text in options.vary)
    pairs = [_split("--correlate", text) for text in options.correlate]
    try:
        correlation = {tuple(name.strip() for name in names.split(",")): float(value) for names, value in pairs}
    except ValueError:
        raise ValueError("--correlate must look like contact.stiffness,striker.mass=0.5") from None
    with staged_folder(folder, "spread") as staging:
        display = progress_of(options)
        with display("blows"):
            found = uncertainty.spread(
                scene, vary, n=options.blows, correlation=correlation or None, seed=options.seed,
                sobol=False if options.no_sobol else None, tolerance=options.tolerance,
                max_frequency=options.max_frequency, workers=options.workers, client=options.cluster,
                store=options.store, watch=partial(display.report, "blows"),
            )  # fmt: skip
        with display("files"):
            names = uncertainty.write_spread(staging, found, options.format)
    seconds = time.perf_counter() - began
    said = [title_of(scene), found.summary().splitlines(), f"Time: {seconds:.2f} s"]
    return answer({**found.data(), "seconds": {"total": seconds}}, *said, folder=folder, files=names)


def _split(option: str, text: str) -> tuple[str, str]:
    """What stands before and after the equals sign of an option."""
    name, equals, value = text.partition("=")
    if not equals or not name.strip() or not value.strip():
        raise ValueError(f"{option} must have a name, an equals sign and a value, got {text!r:.100}")
    return name.strip(), value.strip()


def run_tune(options: argparse.Namespace) -> Answer:
    from .designs import tuning  # imported only when needed

    picture, wanted = picture_of(options, "tuning.png"), tuning.parse_pitches(options.pitch)
    names = ("match", "depth", "radius", "mirror", "patches", "tolerance")
    with progress_of(options)("modes"), warnings.catch_warnings():
        warnings.simplefilter("ignore", fi.ToleranceWarning)  # the first line of the summary says it
        found = fi.tune(options.scene, wanted, **{name: getattr(options, name) for name in names})
    if picture is not None:
        with staged_folder(picture.parent, "tune") as staging:
            fi.figures.save(staging / picture.name, found.figure())
    verdict, *lines = found.summary().splitlines()
    return answer(found.data(), verdict, lines, path=picture, missed=not found.met)


def run_report(options: argparse.Namespace) -> Answer:
    scene = fi.report.read(options.scene)
    path = page_of(options, "report.html")
    changes = {} if options.tolerance is None else {"tolerance": options.tolerance}
    with staged_folder(path.parent) as staging:
        display = progress_of(options, announces=True)
        before = partial(_announce, options, display, False, False)
        if scene.stroke:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", fi.ToleranceWarning)  # the first line of the summary says it
                run: Any = scene.run_strokes(display, before=before, **changes)
        else:
            run = scene.run(display, before=before, motion=True, **changes)
        display.predict(None)
        with display("page"):
            fi.report.write(staging / path.name, scene, run)
    data, missed = fi.report.numbers(scene, run), not run.response.tolerance_met
    return answer(data, title_of(scene), run.response.summary(), path=path, missed=missed)


def run_page(options: argparse.Namespace) -> Answer:
    scene, display = fi.load_scene(options.scene), progress_of(options)
    path = page_of(options, "page.html")
    with staged_folder(path.parent) as staging:
        found = fi.lesson.write(staging / path.name, scene, watch=display, told=partial(display.report, "blows"))
    return answer(vars(found), title_of(scene), f"{found.summary()}.", path=path)


def run_explore(options: argparse.Namespace) -> None:
    def ready(address: str) -> None:
        options.show(answer({"address": address}, [f"{address}   (Ctrl-C stops it)"]))
        if not options.no_open:
            webbrowser.open(address)

    fi.explore.serve(options.scene, port=options.port, ready=ready, watch=progress_of(options))


def run_play(options: argparse.Namespace) -> Answer:
    from ._base import check  # imports numpy, which --help and --version do not need
    from .live import command, controllers, devices
    from .model import asked

    scene = fi.load_scene(options.scene)
    path = page_of(options, "play.wav")
    # what is wrong at a glance is refused before the modes are found
    check.count("--block", options.block)
    check.positive("--duration", options.duration, "s")
    notes = [] if options.midi is None else controllers.read_midi(options.midi)
    if options.at:
        asked.checked_places(scene.built.target, "--at", options.at, nullcontext)
    with staged_folder(path.parent) as staging:
        with progress_of(options)("modes"):
            modes = scene.modes(options.n_modes)
        with progress_of(options)("preparing, and compiling if not yet done"):
            player = command.player_of(scene, modes, options)
        with command.source_of(options, player, notes) as (source, hint):
            device, missing = command.device_of(options, source.live)
            if missing:
                remark(options, missing)
            remark(options, hint)
            played = devices.perform(player, source, options.duration, device)
        (staging / path.name).write_bytes(played.sound.wav())
    counted = player.struck.counted
    happened = ", ".join(f"{count} {name}" for name, count in counted.items())
    said = [
        title_of(scene),
        *lines_of_notes(modes.notes),
        f"Played: {happened} of at most {1e6 * player.step:.3g} us, {modes.n_modes} modes",
        f"Blocks: {len(played.seconds)} of {1e3 * player.block / player.rate:.3g} ms; the 99th percentile of their "
        f"computing time is {1e3 * played.slowest:.3g} ms; {played.missed} missed their deadline",
    ]
    data = {
        "played": dict(counted), "step": player.step, "n_modes": modes.n_modes, "n_blocks": len(played.seconds),
        "slowest": played.slowest, "missed": played.missed, "notes": modes.notes,
    }  # fmt: skip
    return answer(data, *said, path=path)


def run_modes(options: argparse.Namespace) -> Answer:
    from ._base import check  # imports numpy, which --help and --version do not need

    check.count("n_modes", options.n_modes)
    scene, display = fi.load_scene(options.scene), progress_of(options)
    if options.vtk is not None:
        fi.export.vtk_ending(options.vtk)
    with nullcontext() if options.vtk is None else staged_folder(options.vtk.parent) as staging:  # or fails early
        with display("modes"):
            modes = scene.modes(options.n_modes, elastic=True)
        if staging is not None:
            fi.export.write_vtk(staging / options.vtk.name, modes)
    rows = [
        (i, f"{frequency:.5g} Hz", f"{ratio:.3g}")
        for i, (frequency, ratio) in enumerate(zip(modes.frequencies, modes.damping_ratio), 1)
        if i > modes.n_rigid
    ]
    rigid = f"Modes 1 to {modes.n_rigid} are rigid motions: nothing holds the body there"
    said: list[str | Sequence[str]] = [title_of(scene), *lines_of_notes(modes.notes)]
    said += [rigid if modes.n_rigid > 1 else "Mode 1 is a rigid motion"] if modes.n_rigid else []
    said.append(as_table(rows, ("mode", "frequency", "damping ratio")))
    data = {"frequencies": modes.frequencies, "damping_ratios": modes.damping_ratio, "n_rigid": modes.n_rigid}
    return answer({**data, "mass": modes.mass, "notes": modes.notes}, *said, path=options.vtk)


def run_new(options: argparse.Namespace) -> Answer:
    from .scenes import adapted, templates  # imported only when needed

    name = f"{options.kind if options.drawing is None else options.drawing.stem}.toml"
    path = file_of(options, name) or Path(name)
    whole, notes = adapted.text(
        options.kind, path.parent, drawing=options.drawing, unit=options.unit, material=options.material,
        mallet=options.mallet,
    )  # fmt: skip
    templates.write_scene(path, options.kind, whole)
    verb = "map" if options.kind == "map" else "strike"
    found = answer({"notes": notes}, *lines_of_notes(notes), path=path)
    return found._replace(said=[*(found.said or ()), f"Next: fem-impact {verb} {path}"])


def run_catalogue(options: argparse.Namespace) -> Answer:
    from .impact import listing  # imported only when needed

    data, said = listing.listed(" ".join(options.words))
    return answer(data, *(part if isinstance(part, str) else as_table(*part) for part in said))


def run_mesh(options: argparse.Namespace) -> Answer:
    from .mesh import edge_table  # imported only when needed

    drawn = picture_of(options, "mesh.png")
    ending = options.scene.suffix.lower()
    with progress_of(options)("mesh"):
        if ending == ".toml":
            if options.unit is not None:
                raise ValueError("--unit must be left out for a scene, which states it")
            mesh = fi.load_scene(options.scene).body()
        else:
            read = fi.mesh.outline if ending in (".svg", ".dxf") else fi.mesh.load
            mesh = read(options.scene, unit=options.unit)
        if drawn is not None:
            drawn.parent.mkdir(parents=True, exist_ok=True)
            fi.figures.save(drawn, fi.figures.edges(mesh))
    facts, edges = edge_table.rows(mesh), edge_table.edges(mesh)
    rows = [
        (edge.name, f"{edge.length:.4g} m", edge.n_facets, "curved" if edge.curved else "straight",
         f"({', '.join(f'{x:.4g}' for x in edge.middle)}) m", ", ".join(edge.twins) or "-")
        for edge in edges
    ]  # fmt: skip
    heads = ("edge", "length", "facets", "form", "half way at", "the same as")
    said = [str(options.scene), *lines_of_notes(mesh.notes), [*as_table(facts), "", *as_table(rows, heads)]]
    data = {"mesh": dict(facts), "edges": [vars(edge) for edge in edges], "notes": mesh.notes}
    return answer(data, *said, path=drawn)


def run_show(options: argparse.Namespace) -> Answer:
    from .scenes import results  # imported only when needed

    data, said = results.describe(options.scene)
    return answer(data, *said, folder=options.scene, files=data["files"])


def run_schema(options: argparse.Namespace) -> Answer:
    if options.of is not None:
        return Answer(answers.schema(options.of), None)
    from .scenes import editor_schema  # imported only when needed

    return Answer(editor_schema.schema(), None)


def run_doctor(options: argparse.Namespace) -> Answer:
    from . import doctor  # imported only when needed

    with progress_of(options)("checking, and compiling if not yet done"):
        findings = doctor.examine()
    said: list[str | Sequence[str]] = [as_table(list(fi.export.versions().items()))]
    for finding in findings:
        state = "works" if finding.works else "fails" if finding.vital else "missing"
        said.append(f"{finding.name:<22} {state:<8} {finding.seconds:5.2f} s  {finding.remedy}".rstrip())
    failed = [finding.name for finding in findings if finding.vital and not finding.works]
    fault = f"{', '.join(failed)}: not working; see above" if failed else ""
    return answer({"findings": [vars(finding) for finding in findings]}, *said, fault=fault)


def run_verify(options: argparse.Namespace) -> Answer:
    from . import references  # imported only when needed
    from .show import figures, plots

    if options.list:
        known = [{"name": case.name, **case.about} for case in references.select(options.names or "all")]
        listed = [(case["name"], case["title"], case["source"]) for case in known]
        return answer({"cases": known}, as_table(listed, ("case", "what it is", "source")))
    display, picture = progress_of(options), picture_of(options, "verify.png")
    with display("cases"):
        found = references.verify(options.names or "all", watch=partial(display.report, "cases"))
    rows = [
        (each.name, line.quantity, f"{line.reference:.7g} {line.unit}", f"{line.ours:.7g}", f"{line.allowed:.0e}",
         "holds" if line.holds else "FAILS")
        for each in found for line in (each.lines if options.all else (each.worst,))
    ]  # fmt: skip
    failed = [each.name for each in found if not each.holds]
    said = (
        f"{len(found) - len(failed)} of {len(found)} cases hold, with {sum(len(each.lines) for each in found)} numbers"
    )
    said += "" if options.all else "; the one nearest to what errors allow is shown of each (--all: every one)"
    fault = f"{', '.join(failed)}: ours differs by more than both errors allow; see above" if failed else ""
    if picture is not None:
        with staged_folder(picture.parent, "verify") as staging:
            figures.save(staging / picture.name, plots.verdicts(found))
    data = {"cases": [each.data for each in found], "n_failed": len(failed)}
    head = ("case", "quantity", "reference", "ours", "allowed", "so it")
    return answer(data, as_table(rows, head), said, path=picture, fault=fault)


def _choices(options: argparse.Namespace) -> dict[str, Any]:
    names = ("tolerance", "quantity", "target", "model", "n_modes", "size")
    return {name: getattr(options, name) for name in names if getattr(options, name) is not None}


def run_fit(options: argparse.Namespace) -> Answer:
    from .pages import fit_page  # imported only when needed
    from .taps import prompt  # imported only when needed

    folder, display = folder_of(options), progress_of(options)
    with staged_folder(folder, "fit") as staging:
        with display("fit"):
            found, scene, proposal = prompt.fit(options, partial(display.report, "fits"))
        data, files = prompt.write_files(staging, found, scene, proposal)
        with display("page"):
            target, at = (None, None) if scene is None else (scene.modes(), scene.blow.values["at"])
            fit_page.write_fit(staging / "fit.html", found, title=f"Taps of {options.scene.name}", target=target, at=at)
    return answer(data, (proposal or found).summary(), folder=folder, files=["fit.html", *files])
