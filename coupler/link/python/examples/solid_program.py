"""What a solid in Python needs around its physics: command line, case, and the loop over orders.

A solid is an object with vertices [n, 3], triangles [m, 3], stable_step, and
    advance(load_before, load, width, steps) -> position, velocity [n, 3], work, impulse [3]
    state() -> dict of arrays;  set_state(dict)
"""

import argparse
import copy
import os
import sys
import tomllib
from pathlib import Path
from time import perf_counter

ROOT = Path(__file__).resolve().parents[4]
sys.path.insert(0, os.path.join(os.environ.get("OCU_BUILD") or ROOT / "build" / "release", "python"))

import numpy as np

from ocublast_link import Participant


def arguments():
    """The command line as the coupler gives it."""
    parser = argparse.ArgumentParser()
    parser.add_argument("case", type=Path)
    parser.add_argument("--set", action="append", default=[])
    parser.add_argument("--mesh-dir", type=Path)
    parser.add_argument("--out", type=Path)
    parser.add_argument("--resume", type=Path)
    parser.add_argument("--threads")
    parser.add_argument("--check", action="store_true")
    return parser.parse_args()


def read_case(options):
    with open(options.case, "rb") as file:
        return tomllib.load(file)


def serve(name, solid, options, mass_per_area, takes_force=False):
    """Couples the solid until the coupler says it is over; checkpoints, rewinds, resumes. `takes_force`: where the
    flow has a mesh of its own, loads may be forces [n, 3]. OCU_SCATTERED: the mesh is sent without its triangles."""
    coupler = Participant("solid", name, int(os.environ["OCUBLAST_CASE_HASH"], 16))
    scattered = bool(os.environ.get("OCU_SCATTERED"))
    coupler.send_mesh(name, solid.vertices, np.zeros((0, 3), int) if scattered else solid.triangles)
    window, time, load = 0, 0.0, np.zeros(len(solid.vertices))
    if options.resume:
        newest = max(p for p in (options.resume / "checkpoint").iterdir() if p.suffix != ".part")
        kept = dict(np.load(newest / "solid.npz"))
        window, time, load = int(kept.pop("window")), float(kept.pop("time")), kept.pop("load")
        solid.set_state(kept)
    coupler.ready(solid.stable_step, window, time, takes_force=takes_force)
    begin = None
    for order in coupler.orders():
        if order.kind == "checkpoint":
            np.savez(os.path.join(order.checkpoint, "solid.npz"), window=window, time=time, load=load, **solid.state())
            coupler.checkpoint_written()
            continue
        if order.iteration == 1:
            begin = copy.deepcopy(solid.state()), load
        if order.iteration > 1:
            solid.set_state(copy.deepcopy(begin[0]))
            load = begin[1]
        given = order.force if order.force is not None else order.overpressure
        after = np.zeros_like(load) if order.idle else given.copy()
        if load.ndim < after.ndim:  # nothing so far but zeros
            load = np.zeros_like(after)
        before = load if order.load_linear else after
        clock = perf_counter()
        x, v, work, impulse = solid.advance(before, after, order.t_end - order.t_begin, order.steps)
        window, time, load = order.window, order.t_end, after
        coupler.send(position=x, velocity=v, stable_step=solid.stable_step, steps_taken=order.steps, work=work,
                     impulse=impulse, mass_per_area=mass_per_area, compute_seconds=perf_counter() - clock)
    coupler.goodbye()


def forces(x, triangles, load):
    """Force [n, 3] on each vertex by an overpressure [n] on the triangles of the surface at x."""
    corner = x[triangles]
    area = 0.5 * np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    total = np.zeros_like(x)
    # A third of the triangle's load to each corner: total and mean are right.
    share = -area * load[triangles].mean(axis=1)[:, None] / 3.0
    for k in range(3):
        np.add.at(total, triangles[:, k], share)
    return total
