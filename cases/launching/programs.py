"""The three programs: where they are, how a case is checked with them, started and stopped."""

from __future__ import annotations

import ctypes
import os
import re
import shlex
import signal
import subprocess
from dataclasses import dataclass, field
from pathlib import Path

from launching.case_file import CaseError

ROOT = Path(__file__).resolve().parents[2]
# Exit codes of all programs.
DONE, OTHER, CASE, LINK, NUMERICS = 0, 1, 2, 3, 4
MEANING = {OTHER: "an unexpected fault", CASE: "the case", LINK: "a file or a partner",
           NUMERICS: "the numerics"}
PR_SET_PDEATHSIG = 1  # linux/prctl.h
PROGRAMS = {"flow": "flow_solver", "solid": "solid_solver", "coupling": "coupler"}
HEADER = re.compile(r"\s*\[\[?\s*([A-Za-z0-9_-]+)[^=]*\]\s*$")


def programs_folder() -> Path:
    return Path(os.environ.get("OCUBLAST_BIN") or ROOT / "build" / "release" / "bin")


def program(name: str) -> str:
    file = programs_folder() / name
    if not file.is_file():
        raise RuntimeError(f"{file} is missing; run cases/setup")
    return str(file)


@dataclass
class Launch:
    """One run of a case: what every program is told."""

    case_file: Path
    overrides: list[str]
    mesh_folder: Path
    out: Path
    resume: bool = False
    quiet: bool = False
    threads: dict[str, int] = field(default_factory=dict)   # "flow", "solid"
    ranks: dict[str, int] = field(default_factory=dict)     # more than one
    commands: dict[str, list[str]] = field(default_factory=dict)  # replacing "flow", "solid"

    def case_arguments(self) -> list[str]:
        arguments = [str(self.case_file)]
        for text in self.overrides:
            arguments += ["--set", text]
        return [*arguments, "--mesh-dir", str(self.mesh_folder)]

    def side_options(self) -> list[str]:
        """What the coupler is told about the solvers that it starts."""
        options = []
        for side, commands in self.commands.items():
            for command in commands:
                options += [f"--{side}", command]
        for side, count in self.ranks.items():
            options += [f"--ranks-{side}", str(count)]
        for side, count in self.threads.items():
            options += [f"--threads-{side}", str(count)]
        return options

    def program_command(self, part: str) -> list[str]:
        """A single solver, or a replacement of it, with its threads."""
        if part in self.commands:
            command = shlex.split(self.commands[part][-1])
        else:
            command = [program(PROGRAMS[part])]
        command += self.case_arguments()
        if part in self.threads:
            command += ["--threads", str(self.threads[part])]
        return command

    def main_command(self, parts: list[str]) -> list[str]:
        """The command that runs the case: the coupler for a coupled one, else the one solver."""
        rest = ["--out", str(self.out)]
        if self.resume:
            rest += ["--resume", str(self.out)]
        if self.quiet:
            rest.append("--quiet")
        if "coupling" in parts:
            return [program("coupler"), *self.case_arguments(), *self.side_options(), *rest]
        mpirun = ["mpirun", "-n", str(self.ranks[parts[0]]), "--bind-to", "none"] if parts[0] in self.ranks else []
        return [*mpirun, *self.program_command(parts[0]), *rest]

    def environment(self) -> dict[str, str]:
        """For mpirun: Open MPI refuses root and more ranks than cores unless told; ranks that wait
        give their core away. The coupler tells its own children."""
        told = ("OMPI_ALLOW_RUN_AS_ROOT", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "OMPI_MCA_rmaps_base_oversubscribe",
                "OMPI_MCA_mpi_yield_when_idle")
        return {**{name: "1" for name in told if self.ranks}, **os.environ}


def solid_names(case: dict) -> list[str]:
    """Names of several solids; none for a single one."""
    tables = case.get("solid")
    return [str(table.get("name", "")) for table in tables] if isinstance(tables, list) else []


def parts_of(case: dict, case_file: Path) -> list[str]:
    """Which of flow, solid, coupling a case has."""
    parts = [name for name in ("flow", "solid", "coupling") if name in case]
    if "coupling" in parts and len(parts) < 3:
        raise CaseError(f"{case_file}: [coupling] needs both [flow] and [solid]; there is only "
                        f"{', '.join(p for p in parts if p != 'coupling') or 'neither'}")
    if "coupling" not in parts and len(parts) == 2:
        raise CaseError(f"{case_file}: [flow] and [solid] without [coupling]: add the table, even "
                        "empty, or remove one of them")
    if not parts:
        raise CaseError(f"{case_file}: neither [flow] nor [solid]: nothing to run")
    return parts


def check(launch: Launch, parts: list[str]) -> str:
    """Lets the programs check the case (the coupler asks both solvers). Returns what would run;
    CaseError with all faults."""
    if "coupling" in parts:
        command = [program("coupler"), "check", *launch.case_arguments(), *launch.side_options()]
    else:
        command = [*launch.program_command(parts[0]), "--check"]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode == CASE:
        raise CaseError(done.stderr.strip() or done.stdout.strip())
    if done.returncode != DONE:
        raise RuntimeError(f"{shlex.join(command)}\nended with exit code {done.returncode}:\n"
                           f"{done.stderr.strip()}")
    return done.stdout


def _end_with_parent() -> None:
    """A launcher that is killed outright takes the run with it."""
    ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGTERM)


def run(launch: Launch, parts: list[str]) -> tuple[int, bool]:
    """Runs to the end: exit code (minus the signal that killed it), and whether it was asked to stop.
    Ctrl-C and a request to end are passed on, and the run ends by itself, with a checkpoint."""
    # Its own process group: a Ctrl-C reaches the solvers only by the coupler, which ends them in order.
    child = subprocess.Popen(launch.main_command(parts), process_group=0,
                             preexec_fn=_end_with_parent, env=launch.environment())
    asked = []

    def pass_on(number, _) -> None:
        asked.append(number)
        child.send_signal(number)

    passed = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    previous = {number: signal.signal(number, pass_on) for number in passed}
    try:
        code = child.wait()
    finally:
        for number, handler in previous.items():
            signal.signal(number, handler)
    return code, bool(asked)


def effective_tables(launch: Launch, part: str, options: list[str]) -> dict[str, str]:
    done = subprocess.run([program(PROGRAMS[part]), *launch.case_arguments(), *options, "--effective"],
                          capture_output=True, text=True)
    if done.returncode != DONE:
        raise RuntimeError(f"{PROGRAMS[part]} --effective failed:\n{done.stderr.strip()}")
    return split_tables(done.stdout)


def effective_case(launch: Launch, parts: list[str], resolution: str | None, solids: list[str]) -> str:
    """The case with every default: each program prints the tables it reads."""
    tables: dict[str, str] = {}
    for part in parts:
        if part == "solid" and solids:
            # [solid.x] after [[solid]] belongs to the last entry of the list.
            tables["solid"] = "\n".join(
                effective_tables(launch, part, ["--name", name])["solid"].replace(
                    "[solid]", f'[[solid]]\nname = "{name}"', 1) for name in solids)
            continue
        for name, text in effective_tables(launch, part, []).items():
            tables.setdefault(name, text)
    # The preset has been applied: its name would only ask for tables that are not here any more.
    if "case" in tables:
        lines = [line for line in tables["case"].splitlines() if not line.startswith("resolution")]
        tables["case"] = "\n".join(lines)
    head = f"# Resolution preset applied: {resolution}.\n\n" if resolution else ""
    order = ["case", "time", "ambient", "coupling", "flow", "solid"]
    names_in_order = sorted(tables, key=lambda n: order.index(n) if n in order else len(order))
    return head + "\n\n".join(tables[name].strip() for name in names_in_order) + "\n"


def version() -> str:
    """What the programs say they are."""
    for name in ("coupler", "flow_solver", "solid_solver"):
        file = programs_folder() / name
        if file.is_file():
            done = subprocess.run([file, "--version"], capture_output=True, text=True)
            return done.stdout.strip().partition(" ")[2]
    return "unknown"


def split_tables(text: str) -> dict[str, str]:
    """TOML text cut by top-level table: [flow], [flow.grid] and [[flow.burst]] all belong to flow."""
    tables: dict[str, str] = {}
    current, depth = "", 0
    for line in text.splitlines():
        header = HEADER.match(line) if depth == 0 else None
        if header:
            current = header.group(1)
        else:  # brackets of arrays that run over several lines, those in texts left out
            bare = re.sub(r'"(\\.|[^"\\])*"|\'[^\']*\'', "", line)
            depth += bare.count("[") - bare.count("]")
        if current:
            tables[current] = tables.get(current, "") + line + "\n"
    return tables
