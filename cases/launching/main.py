"""cases/run: sets a case up, makes its meshes, checks it, runs it, and sums it up."""

from __future__ import annotations

import argparse
import os
import shlex
import shutil
import signal
import sys
import tempfile
import time
from datetime import datetime, timezone
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from launching import library, programs, summary  # noqa: E402
from launching.case_file import CaseError, read_case  # noqa: E402
from launching.report_keys import read_report_keys, report_table  # noqa: E402
from meshing.recipes import effective_entries, make_meshes  # noqa: E402


def parse_arguments(arguments: list[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="cases/run", description="Runs a case from start to report.")
    parser.add_argument("case", nargs="?", help="a name out of --list, or PATH/case.toml")
    parser.add_argument("--list", action="store_true", help="cases with their run time, end")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE",
                        help="overrides a key of the case, as in flow.numerics.cfl=0.5")
    parser.add_argument("--resolution", help="preset of the case: short for --set case.resolution=")
    parser.add_argument("--out", type=Path, help="results (default results/CASE/UTC-TIME)")
    parser.add_argument("--resume", type=Path, metavar="DIR", help="goes on with a stopped run")
    for side in ("flow", "solid"):
        parser.add_argument(f"--ranks-{side}", type=int, default=1, metavar="N",
                            help=f"processes of the {side} solver, under mpirun")
        parser.add_argument(f"--threads-{side}", type=int, metavar="N")
        parser.add_argument(f"--{side}", metavar="CMD", action="append", default=[],
                            help=f"another {side} solver" + ("; of several solids NAME=CMD" if side == "solid" else ""))
    parser.add_argument("--quiet", action="store_true", help="no progress line")
    parser.add_argument("--no-report", action="store_true", help="no report.html")
    chosen = parser.parse_args(arguments)
    if not chosen.list and chosen.case is None and chosen.resume is None:
        parser.error("which case? Give a name (cases/run --list) or a case file")
    return chosen


def check_ranks(chosen: argparse.Namespace) -> None:
    for side in ("flow", "solid"):
        ranks = getattr(chosen, f"ranks_{side}")
        if ranks < 1:
            raise CaseError(f"--ranks-{side}: is {ranks}, accepted 1 or more")
        if ranks > 1 and shutil.which("mpirun") is None:
            raise CaseError(f"--ranks-{side} {ranks}: needs mpirun (Debian: openmpi-bin)")


def results_folder(chosen: argparse.Namespace, name: str) -> Path:
    if chosen.resume:
        if chosen.out and chosen.out.resolve() != chosen.resume.resolve():
            raise CaseError("--out: a resumed run goes on in its own folder; leave --out away")
        if not (chosen.resume / "checkpoint").is_dir():
            raise CaseError(f"--resume {chosen.resume}: no checkpoint in it")
        return chosen.resume.resolve()
    if chosen.out:
        if chosen.out.exists() and any(chosen.out.iterdir()):
            raise CaseError(f"--out {chosen.out}: is not empty; choose another folder, or --resume it")
        return chosen.out.resolve()
    stamp = datetime.now(timezone.utc).strftime("%Y%m%dT%H%M%SZ")
    folder = programs.ROOT / "results" / name / stamp
    # Two runs in one second must not share a folder.
    for number in range(2, 100):
        if not folder.exists():
            break
        folder = folder.with_name(f"{stamp}-{number}")
    return folder


def resumed_case(chosen: argparse.Namespace) -> tuple[Path, list[str]]:
    """Case file and overrides of the run that is resumed; they may not change."""
    record = chosen.resume / "run.json"
    if not record.is_file():
        raise CaseError(f"--resume {chosen.resume}: no run.json in it; it was not made by cases/run")
    kept = summary.read_json(record)
    case_file = Path(kept["case_file"])
    given = overrides_of(chosen)
    if chosen.case and library.find_case(chosen.case) != case_file:
        raise CaseError(f"--resume {chosen.resume}: holds a run of {case_file}, not of {chosen.case}")
    if given and given != kept["overrides"]:
        raise CaseError("--resume: a run goes on with the settings it was started with; leave --set "
                        "and --resolution away")
    return case_file, kept["overrides"]


def overrides_of(chosen: argparse.Namespace) -> list[str]:
    extra = [f"case.resolution={chosen.resolution}"] if chosen.resolution else []
    return extra + chosen.set


def make_launch(chosen: argparse.Namespace, case_file: Path, overrides: list[str], mesh_folder: Path,
                out: Path) -> programs.Launch:
    sides = ("flow", "solid")
    return programs.Launch(
        case_file=case_file, overrides=overrides, mesh_folder=mesh_folder, out=out,
        resume=chosen.resume is not None, quiet=chosen.quiet,
        threads={s: getattr(chosen, f"threads_{s}") for s in sides if getattr(chosen, f"threads_{s}")},
        ranks={s: getattr(chosen, f"ranks_{s}") for s in sides if getattr(chosen, f"ranks_{s}") > 1},
        commands={s: getattr(chosen, s) for s in sides if getattr(chosen, s)},
    )


def prepare(chosen: argparse.Namespace, case: dict, case_file: Path, overrides: list[str],
            out: Path) -> tuple[programs.Launch, list[str], float]:
    """Meshes and check. They come into being aside: a case with a fault leaves nothing behind."""
    parts = programs.parts_of(case, case_file)
    started = time.monotonic()
    if chosen.resume:
        launch = make_launch(chosen, case_file, overrides, out / "mesh", out)
        programs.check(launch, parts)
        return launch, parts, time.monotonic() - started
    with tempfile.TemporaryDirectory(prefix="ocublast-mesh-") as aside:
        meshes = make_meshes(case, case_file, Path(aside))
        mesh_seconds = time.monotonic() - started
        checked = make_launch(chosen, case_file, overrides, Path(aside), out)
        plan = programs.check(checked, parts)
        (out / "mesh").mkdir(parents=True, exist_ok=True)
        for mesh in meshes:
            for file in (mesh, mesh.with_suffix(".xmf")):
                shutil.copy2(file, out / "mesh")
    if not chosen.quiet and plan.strip():
        print(plan.strip())
    return make_launch(chosen, case_file, overrides, out / "mesh", out), parts, mesh_seconds


def finish(chosen: argparse.Namespace, case: dict, case_file: Path, out: Path, about: dict,
           wall: dict) -> None:
    """summary.json, report.html and the table."""
    result = summary.make_summary(case, case_file, out, about, wall)
    summary.write_json(out / "summary.json", result)
    print(summary.table(result))
    if not chosen.no_report:
        from reporting.report import write_report  # matplotlib is slow to load: only here

        started = time.monotonic()
        write_report(out, result)
        result["performance"]["report_s"] = round(time.monotonic() - started, 3)
        summary.write_json(out / "summary.json", result)
    print(f"results: {out}")


def say_how_it_ended(out: Path, code: int, stopped: bool) -> None:
    checkpoints = out / "checkpoint"
    if stopped and checkpoints.is_dir() and any(checkpoints.iterdir()):
        text = f"stopped on request; go on with: cases/run --resume {shlex.quote(str(out))}"
    elif code < 0:
        text = f"killed by signal {-code} ({signal.strsignal(-code)}); logs: {out / 'log'}"
    else:
        meaning = programs.MEANING.get(code, "an unexpected fault")
        text = f"ended with exit code {code} ({meaning}); logs: {out / 'log'}"
    print(f"cases/run: {text}", file=sys.stderr)


def run(arguments: list[str]) -> int:
    chosen = parse_arguments(arguments)
    if chosen.list:
        print(library.list_text())
        return programs.DONE
    check_ranks(chosen)
    if chosen.resume:
        case_file, overrides = resumed_case(chosen)
    else:
        case_file, overrides = library.find_case(chosen.case), overrides_of(chosen)
    case = read_case(case_file, overrides)
    read_report_keys(case, str(case_file))
    name = case.get("case", {}).get("name") or case_file.parent.name
    out = results_folder(chosen, name)
    started = time.monotonic()
    began = datetime.now(timezone.utc)
    launch, parts, mesh_seconds = prepare(chosen, case, case_file, overrides, out)
    if not chosen.resume:
        summary.write_json(out / "run.json", {"case_file": str(case_file), "overrides": overrides})
        effective = programs.effective_case(launch, parts, case["case"].get("resolution"),
                                            programs.solid_names(case))
        text = effective + "\n" + effective_entries(case, case_file) + report_table(case)
        (out / "case.toml").write_text(text)
    print(f"{case['case']['title']}\nresults go to {out}", flush=True)
    before = time.monotonic()
    code, stopped = programs.run(launch, parts)
    wall = {"wall_time_s": round(time.monotonic() - started, 3),
            "mesh_s": round(mesh_seconds, 3),
            "run_s": round(time.monotonic() - before, 3)}
    # A stopped run may end in good order, with code 0, but it has no result to sum up.
    if code != programs.DONE or stopped:
        say_how_it_ended(out, code, stopped)
        return code if code > 0 else programs.OTHER
    about = {"version": programs.version(), "started_utc": began.isoformat(timespec="seconds"),
             "command": shlex.join(["cases/run", *arguments]), "overrides": overrides,
             "resumed": chosen.resume is not None}
    finish(chosen, case, case_file, out, about, wall)
    return programs.DONE


def main() -> int:
    try:
        return run(sys.argv[1:])
    except CaseError as error:
        print(error, file=sys.stderr)
        return programs.CASE
    except KeyboardInterrupt:
        print("cases/run: interrupted before the run began", file=sys.stderr)
        return programs.OTHER
    except OSError as error:
        print(f"cases/run: {error}", file=sys.stderr)
        return programs.LINK
    except RuntimeError as error:
        print(f"cases/run: {error}", file=sys.stderr)
        return programs.OTHER


if __name__ == "__main__":
    os.environ.setdefault("MPLBACKEND", "Agg")
    sys.exit(main())
