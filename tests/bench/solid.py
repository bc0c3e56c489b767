"""Speed of the solid: element updates per core-second of every element, beside CalculiX on the same block.

The block: a cube of 0.1 m, neo-Hookean, nu = 0.49 (G 335 570 Pa, K 16.667 MPa), rho 1000, bottom clamped,
half-sine pressure of 50 kPa / 1 ms on top, central difference. CalculiX (Debian's calculix-ccx, where
installed) runs it with C3D8, *HYPERELASTIC and *DYNAMIC, EXPLICIT; its rate is the difference of two
numbers of steps. Cycles per element come from a clock measured beside each block of work, so they hold on
a machine shared with others.
"""

import json
import os
import re
import resource
import shutil
import subprocess
import tempfile

import reports

# Counted per update: flops, numbers of reference data, nodes, passes over them; bounds of one core of
# 28.9 GB/s and 123 Gflop/s.
ROOFLINE = {"hex8_q1p0": (2469, 80, 8, 1), "hex8_one_point": (740, 38, 8, 1), "tet4_anp": (330, 10, 4, 2)}


def bytes_per_update(numbers, nodes, passes, rows):
    """Bytes that an update moves: reference data and places of nodes in each pass, constants, viscosity and
    its memory (read and written) in the last, and for each of the chunk's rows the displacement, the force
    (read and written) and two indices; a pass over nodal pressures adds the sums of one number."""
    element = passes * (8 * numbers + 2 * nodes) + 8 * 2 + 8 * 2 + 2 * 8 * 2
    row = 32 + 2 * 32 + 2 * 4 + (passes - 1) * (32 + 2 * 8 + 3 * 4)
    return element + rows * row


def own_records(build, quick):
    command = [os.path.join(build, "bin", "solid_speed"), "--repeats", "3" if quick else "15"]
    output = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    return [json.loads(line) for line in output.splitlines()]


# What Open MPI needs to start as root and to leave binding to the system.
MPI = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
       "OMPI_MCA_rmaps_base_oversubscribe": "1", "OMPI_MCA_btl": "self,vader"}


def rank_records(build, quick):
    """Two ranks against one on the block, in alternating runs; the load of the machine beside it."""
    program = [os.path.join(build, "bin", "solid_rank_speed"), "16" if quick else "40", "10" if quick else "30"]
    environment = {**os.environ, **MPI, "OMP_NUM_THREADS": "1"}
    ratios, bests = [], {}
    for _ in range(2 if quick else 5):
        walls = {}
        for ranks in (1, 2):
            done = subprocess.run(["mpirun", "-n", str(ranks), *program], check=True, capture_output=True, text=True,
                                  env=environment)
            walls[ranks] = json.loads(done.stdout)["wall_step"]
            bests[ranks] = min(bests.get(ranks, 1e9), walls[ranks])
        ratios.append(walls[1] / walls[2])
    ratios.sort()
    return [reports.record("solid_speed", "block_40", "hex8_q1p0_two_ranks", ratios[len(ratios) // 2], "speed-up",
                           target=1.8, better="higher"),
            reports.record("solid_speed", "block_40", "hex8_q1p0_two_ranks_best_runs", bests[1] / bests[2], "speed-up",
                           target=1.8, better="higher"),
            reports.record("solid_speed", "block_40", "load_of_the_machine", os.getloadavg()[0], "processes",
                           better="lower")]


def write_block(path, cells, steps, step):
    """CalculiX input of the block with `cells` hexes along each edge."""
    edge = cells + 1
    size = 0.1 / cells
    number = lambda i, j, k: 1 + i + edge * (j + edge * k)
    with open(path, "w", encoding="ascii") as file:
        file.write("*NODE, NSET=ALL\n")
        for k in range(edge):
            for j in range(edge):
                for i in range(edge):
                    file.write(f"{number(i, j, k)}, {i * size:.9g}, {j * size:.9g}, {k * size:.9g}\n")
        file.write("*ELEMENT, TYPE=C3D8, ELSET=BLOCK\n")
        element = 0
        for k in range(cells):
            for j in range(cells):
                for i in range(cells):
                    element += 1
                    corners = [number(i + a, j + b, k + c) for c in (0, 1)
                               for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))]
                    file.write(f"{element}, " + ", ".join(map(str, corners)) + "\n")
        file.write("*NSET, NSET=BOTTOM\n")
        file.writelines(f"{number(i, j, 0)},\n" for j in range(edge) for i in range(edge))
        first = cells * cells * (cells - 1) + 1
        # W = C10 (I1 - 3) + 1/D1 (J - 1)^2 with C10 = G/2, D1 = 2/K.
        file.write(f"*MATERIAL, NAME=TISSUE\n*HYPERELASTIC, NEO HOOKE\n{335570.47 / 2:.6g}, {2 / 16.6667e6:.6g}\n"
                   "*DENSITY\n1000.\n*SOLID SECTION, ELSET=BLOCK, MATERIAL=TISSUE\n*BOUNDARY\nBOTTOM, 1, 3\n"
                   f"*AMPLITUDE, NAME=PULSE\n0., 0., 1.e-3, 1.\n*STEP, INC=1000000\n*DYNAMIC, EXPLICIT\n"
                   f"{step:g}, {steps * step:g}, {step:g}, {step:g}\n*DLOAD, AMPLITUDE=PULSE\n")
        file.writelines(f"{e}, P2, 5.e4\n" for e in range(first, first + cells * cells))
        file.write("*END STEP\n")


def calculix_rate(cells, steps):
    """Element updates per CPU second, from two runs; None where ccx fails."""
    times = []
    with tempfile.TemporaryDirectory(prefix="ocublast-bench-") as scratch:
        for n in steps:
            write_block(os.path.join(scratch, "block.inp"), cells, n, 2e-4 / cells)
            before = resource.getrusage(resource.RUSAGE_CHILDREN)
            done = subprocess.run(["ccx", "-i", "block"], cwd=scratch, capture_output=True, text=True, check=False,
                                  env={**os.environ, "OMP_NUM_THREADS": "1"})
            after = resource.getrusage(resource.RUSAGE_CHILDREN)
            chosen = re.search(r"SELECTED time increment:\s*([0-9.eE+-]+)", done.stdout)
            # Another step than asked for would make the number of steps, and so the rate, a guess.
            if done.returncode != 0 or not chosen or abs(float(chosen[1]) * cells / 2e-4 - 1.0) > 1e-3:
                return None
            times.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
    return cells**3 * (steps[1] - steps[0]) / (times[1] - times[0])


def roofline(records):
    rows = []
    for name, (flops, numbers, nodes, passes) in ROOFLINE.items():
        def find(end):
            return next((r["value"] for r in records if r["quantity"].startswith(name) and
                         r["quantity"].endswith(end)), None)
        rate = find("_at_full_clock")
        if rate:
            size = bytes_per_update(numbers, nodes, passes, find("_rows"))
            rows.append((name, flops, size, rate * flops * 1e-9, 100 * rate * flops / 123e9, rate * size * 1e-9,
                         100 * rate * size / 28.9e9))
    return "## Against the roofline, at the best clock seen\n\n" + reports.markdown_table(
        ("element", "flop/update", "B/update", "Gflop/s", "% of FMA peak", "GB/s", "% of triad"), rows)


def main():
    options = reports.arguments(__doc__)
    records = own_records(options.build, options.quick)
    if shutil.which("mpirun"):
        records += rank_records(options.build, options.quick)
    if shutil.which("ccx"):
        cells = 12 if options.quick else 40
        rate = calculix_rate(cells, (4, 24) if options.quick else (4, 16))
        if rate:
            records.append(reports.record("solid_speed", f"block_{cells}", "calculix_C3D8", rate, "elements/core_s",
                                          better="higher"))
    reports.write(options.out, "solid", "Solid: element updates per core-second", records, [roofline(records)])


if __name__ == "__main__":
    main()
