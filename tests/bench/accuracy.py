#!/usr/bin/python3
"""Error against cells and against processor time: the compact schemes and muscl, and rhoCentralFoam of
Debian's OpenFOAM where it is installed, all on the same problems from the same starting values."""

import glob
import os
import shutil
import subprocess
import sys
import tempfile

import matplotlib
matplotlib.use("Agg")
import matplotlib.pyplot as plt

import reports

SCHEMES = ("compact6", "compact8", "muscl")
SIZES = {"sod": (100, 200, 400, 800), "shu_osher": (100, 200, 400), "vortex": (32, 64, 128), "burst": (32, 48, 64)}
QUICK = {"sod": (100, 200), "shu_osher": (200,), "vortex": (32, 64), "burst": (32,)}
# Figures of the issue that ask for this scheme; the vortex is 2-D, the others as named.
TARGETS = {("sod", "compact6", 200): 1.85e-3, ("sod", "compact6", 400): 0.93e-3,
           ("shu_osher", "compact6", 200): 2.0e-2, ("shu_osher", "compact6", 400): 8.7e-3}
# Beyond these sizes rhoCentralFoam takes minutes a run.
FOAM_LARGEST = {"sod": 800, "shu_osher": 400, "vortex": 64, "burst": 64}
LONG_RUN = 2.0  # s; longer ones scatter little and are not repeated
QUANTITY = {"sod": "L1 of density", "shu_osher": "L1 of density in the waves", "vortex": "L1 of density",
            "burst": "L1 of pressure, r < 1"}
# Box, end time and boundary of each problem for OpenFOAM; absent directions are one cell of unit size.
DOMAIN = {"sod": ((-0.5, 0, 0), (0.5, 1, 1), 0.2), "shu_osher": ((-1, 0, 0), (1, 1, 1), 0.47),
          "vortex": ((-5, -5, 0), (5, 5, 1), 10.0), "burst": ((0, 0, 0), (1, 1, 1), 0.08)}


def ask(program, *words):
    return subprocess.run([program, *map(str, words)], check=True, capture_output=True, text=True).stdout


class References:
    """The reference of each problem and size, computed once (that of Shu and Osher costs a hundred of the runs
    compared with it), as files."""

    def __init__(self, program, folder):
        self.program, self.folder = program, folder

    def file(self, problem, n):
        path = os.path.join(self.folder, f"{problem}_{n}.txt")
        if not os.path.exists(path):
            text = ask(self.program, "reference", problem, n)
            with open(path, "w", encoding="utf-8") as file:
                file.write(text)
        return path

    def values(self, problem, n):
        with open(self.file(problem, n), encoding="utf-8") as file:
            return [tuple(map(float, line.split())) for line in file]


def run_own(program, references, problem, scheme, n):
    """Error, processor seconds and steps; the time of short runs is the median of three."""
    def once():
        return ask(program, "run", problem, scheme, n, references.file(problem, n)).split()
    rows = [once()]
    if float(rows[0][1]) < LONG_RUN:
        rows += [once() for _ in range(2)]
    seconds = sorted(float(row[1]) for row in rows)[len(rows) // 2]
    return float(rows[0][0]), seconds, int(rows[0][2])


# --- rhoCentralFoam -------------------------------------------------------------------------------

def header(kind, name):
    return f"FoamFile {{ version 2.0; format ascii; class {kind}; object {name}; }}\n"


def cells_of(problem, n):
    return {"sod": (n, 1, 1), "shu_osher": (n, 1, 1), "vortex": (n, n, 1), "burst": (n // 2,) * 3}[problem]


def patch_types(problem):
    """Patch name -> kind for the six faces x- x+ y- y+ z- z+."""
    empty = "empty"
    if problem == "sod":
        return ("symmetryPlane", "symmetryPlane", empty, empty, empty, empty)
    if problem == "shu_osher":
        return ("patch", "patch", empty, empty, empty, empty)
    if problem == "vortex":
        return ("cyclic", "cyclic", "cyclic", "cyclic", empty, empty)
    return ("symmetryPlane", "patch", "symmetryPlane", "patch", "symmetryPlane", "patch")


NAMES = ("xlow", "xhigh", "ylow", "yhigh", "zlow", "zhigh")
FACES = ("(0 4 7 3)", "(1 2 6 5)", "(0 1 5 4)", "(3 7 6 2)", "(0 3 2 1)", "(4 5 6 7)")


def block_mesh(problem, n):
    low, high, _ = DOMAIN[problem]
    corners = [(low[0], low[1]), (high[0], low[1]), (high[0], high[1]), (low[0], high[1])]
    vertices = " ".join(f"({x} {y} {z})" for z in (low[2], high[2]) for x, y in corners)
    patches = ""
    for k, kind in enumerate(patch_types(problem)):
        partner = f"neighbourPatch {NAMES[k ^ 1]};" if kind == "cyclic" else ""
        patches += f"{NAMES[k]} {{ type {kind}; {partner} faces ({FACES[k]}); }}\n"
    count = " ".join(map(str, cells_of(problem, n)))
    return (header("dictionary", "blockMeshDict") + f"scale 1; vertices ({vertices});\n"
            f"blocks (hex (0 1 2 3 4 5 6 7) ({count}) simpleGrading (1 1 1)); edges ();\n"
            f"boundary ({patches}); mergePatchPairs ();\n")


def field(problem, name, dimensions, values, vector):
    kind = "vector" if vector else "scalar"
    listed = "\n".join(values)
    patches = ""
    for k, word in enumerate(patch_types(problem)):
        inlet = problem == "shu_osher" and k == 0
        bc = f"type fixedValue; value uniform {values[0]};" if inlet else "type zeroGradient;"
        patches += f"{NAMES[k]} {{ {bc if word == 'patch' else f'type {word};'} }}\n"
    return (header(f"vol{kind.capitalize()}Field", name) + f"dimensions {dimensions};\n"
            f"internalField nonuniform List<{kind}> {len(values)}\n(\n{listed}\n);\n"
            f"boundaryField {{ {patches} }}\n")


CONTROL = """application rhoCentralFoam; startFrom startTime; startTime 0; stopAt endTime; endTime {end};
deltaT 1e-5; writeControl adjustableRunTime; writeInterval {end}; purgeWrite 0; writeFormat ascii;
writePrecision 12; writeCompression off; timeFormat general; timePrecision 8; runTimeModifiable false;
adjustTimeStep yes; maxCo 0.2; maxDeltaT 1;
"""
SCHEMES_DICT = """fluxScheme Kurganov; ddtSchemes { default Euler; } gradSchemes { default Gauss linear; }
divSchemes { default none; div(tauMC) Gauss linear; } laplacianSchemes { default Gauss linear corrected; }
interpolationSchemes { default linear; reconstruct(rho) vanLeer; reconstruct(U) vanLeerV; reconstruct(T) vanLeer; }
snGradSchemes { default corrected; }
"""
SOLUTION = """solvers { "(rho|rhoU|rhoE)" { solver diagonal; } U { solver smoothSolver; smoother GaussSeidel;
nSweeps 2; tolerance 1e-9; relTol 0; } e { $U; tolerance 1e-10; relTol 0; } }
"""
# Gas constant 1: molar weight 8314.46 kg/kmol; cp = 3.5.
THERMO = """thermoType { type hePsiThermo; mixture pureMixture; transport const; thermo hConst;
equationOfState perfectGas; specie specie; energy sensibleInternalEnergy; }
mixture { specie { molWeight 8314.462; } thermodynamics { Cp 3.5; Hf 0; } transport { mu 0; Pr 1; } }
"""


def write_foam_case(folder, program, problem, n):
    for name in ("0", "system", "constant"):
        os.makedirs(os.path.join(folder, name))
    cells = [line.split() for line in ask(program, "initial", problem, n).splitlines()]
    pressure = [c[4] for c in cells]
    temperature = [f"{float(c[4]) / float(c[0]):.12e}" for c in cells]
    velocity = [f"({c[1]} {c[2]} {c[3]})" for c in cells]
    files = {"system/blockMeshDict": block_mesh(problem, n),
             "system/controlDict": header("dictionary", "controlDict") + CONTROL.format(end=DOMAIN[problem][2]),
             "system/fvSchemes": header("dictionary", "fvSchemes") + SCHEMES_DICT,
             "system/fvSolution": header("dictionary", "fvSolution") + SOLUTION,
             "constant/thermophysicalProperties": header("dictionary", "thermophysicalProperties") + THERMO,
             "constant/turbulenceProperties": header("dictionary", "turbulenceProperties") +
             "simulationType laminar;\n",
             "0/p": field(problem, "p", "[1 -1 -2 0 0 0 0]", pressure, False),
             "0/T": field(problem, "T", "[0 0 0 1 0 0 0]", temperature, False),
             "0/U": field(problem, "U", "[0 1 -1 0 0 0 0]", velocity, True)}
    for name, text in files.items():
        with open(os.path.join(folder, name), "w", encoding="utf-8") as file:
            file.write(text)


def read_scalar_field(path, count):
    with open(path, encoding="utf-8") as file:
        text = file.read()
    inside = text[text.index("internalField"):]
    if inside.split(";")[0].find("nonuniform") < 0:
        return [float(inside.split("uniform")[1].split(";")[0])] * count
    return [float(v) for v in inside[inside.index("(") + 1:inside.index(")")].split()]


def run_foam(program, references, problem, n):
    """Error, processor seconds and steps of rhoCentralFoam (Kurganov, van Leer, Euler, Co 0.2)."""
    with tempfile.TemporaryDirectory() as folder:
        write_foam_case(folder, program, problem, n)
        environment = dict(os.environ, WM_PROJECT_DIR="/usr/share/openfoam")
        subprocess.run(["blockMesh"], cwd=folder, check=True, capture_output=True, env=environment)
        log = subprocess.run(["rhoCentralFoam"], cwd=folder, check=True, capture_output=True, text=True,
                             env=environment).stdout
        last = max((d for d in glob.glob(os.path.join(folder, "[0-9]*"))), key=lambda d: float(os.path.basename(d)))
        reference = references.values(problem, n)
        p = read_scalar_field(os.path.join(last, "p"), len(reference))
        T = read_scalar_field(os.path.join(last, "T"), len(reference))
    values = p if problem == "burst" else [a / b for a, b in zip(p, T)]
    error = sum(weight * abs(v - exact) for v, (exact, weight) in zip(values, reference))
    times = [line for line in log.splitlines() if line.startswith("ExecutionTime")]
    return error, float(times[-1].split()[2]), len(times)


# --- table and plot -------------------------------------------------------------------------------

def plot(results, out):
    figure, axes = plt.subplots(2, len(SIZES), figsize=(4 * len(SIZES), 7), squeeze=False)
    for column, problem in enumerate(SIZES):
        for code in sorted({key[1] for key in results if key[0] == problem}):
            points = sorted((n, *results[key]) for key in results for n in [key[2]]
                            if key[0] == problem and key[1] == code)
            axes[0][column].loglog([p[0] for p in points], [p[1] for p in points], "o-", label=code)
            axes[1][column].loglog([max(p[2], 1e-4) for p in points], [p[1] for p in points], "o-", label=code)
        axes[0][column].set(title=problem, xlabel="cells a side", ylabel=QUANTITY[problem])
        axes[1][column].set(xlabel="processor time, s", ylabel=QUANTITY[problem])
    axes[0][0].legend()
    figure.tight_layout()
    figure.savefig(os.path.join(out, "accuracy.png"), dpi=120)


def main():
    options = reports.arguments(__doc__)
    program = os.path.join(options.build, "bin", "flow_accuracy")
    sizes = QUICK if options.quick else SIZES
    foam = shutil.which("rhoCentralFoam") is not None and shutil.which("blockMesh") is not None
    results, steps = {}, {}
    with tempfile.TemporaryDirectory() as folder:
        references = References(program, folder)
        for problem, numbers in sizes.items():
            for n in numbers:
                for scheme in SCHEMES:
                    error, seconds, steps[problem, scheme, n] = run_own(program, references, problem, scheme, n)
                    results[problem, scheme, n] = (error, seconds)
                if foam and n <= FOAM_LARGEST[problem]:
                    try:
                        error, seconds, steps[problem, "rhoCentralFoam", n] = run_foam(program, references, problem, n)
                        results[problem, "rhoCentralFoam", n] = (error, seconds)
                    except (subprocess.CalledProcessError, OSError, ValueError) as failure:
                        print(f"accuracy: rhoCentralFoam on {problem} {n}: {failure}", file=sys.stderr)
    records = []
    for (problem, code, n), (error, seconds) in results.items():
        case = f"{problem}/{code}/{n}"
        records.append(reports.record("accuracy", case, QUANTITY[problem], error, "1", TARGETS.get((problem, code, n))))
        records.append(reports.record("accuracy", case, "processor time", seconds, "s"))
    rows = [(problem, code, n, error, seconds, steps[problem, code, n])
            for (problem, code, n), (error, seconds) in results.items()]
    os.makedirs(options.out, exist_ok=True)
    plot(results, options.out)
    note = "" if foam else "rhoCentralFoam is not installed here.\n"
    table = reports.markdown_table(("problem", "code", "cells a side", "error", "processor time, s", "steps"), rows)
    reports.write(options.out, "accuracy", "Accuracy of the gas schemes", records, [note + table])
    return 0


if __name__ == "__main__":
    sys.exit(main())
