"""Runs an input script of LAMMPS with a solid of rfm as obstacle, on as many ranks as `mpiexec -n` says.

    python run.py drop.in ../pawn.rfm:pawn --box 0,0,0,3,3,3 --seconds 0.75
"""

import argparse
import pathlib
import time

import numpy as np
from lammps import lammps

import rfm
from obstacle import Obstacle


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("script", help="input script with `fix obstacle all external pf/callback 1 1`")
    parser.add_argument("solid", help="FILE.rfm:SOLID; the solid may be left out where the file has one")
    parser.add_argument("-D", dest="params", action="append", default=[], metavar="NAME=VALUE", help="param of the file")
    parser.add_argument("--box", help="x0,y0,z0,x1,y1,z1: walls around the fluid, m")
    parser.add_argument("--var", action="append", default=[], metavar="NAME=VALUE", help="variable of the script")
    parser.add_argument("--seconds", type=float, default=0.5, help="simulated time, s")
    parser.add_argument("--restitution", type=float, default=0.5)
    parser.add_argument("--friction", type=float, default=0.0)
    parser.add_argument("--reach", type=float, default=0.2, help="farthest that a particle is put back, m")
    parser.add_argument("-o", "--output", help="table .npz of the particles at the end, by their IDs")
    return parser.parse_args()


def load(solid, box, params):
    """The solid of a file, together with all that is outside a box."""
    path, _, name = solid.rpartition(":") if ":" in solid else (solid, "", "")
    program = rfm.load(pathlib.Path(path), **params)
    name = name or program.solid().name
    if name not in program.solids:
        raise SystemExit(f"{path} has no solid {name}: there is {', '.join(program.solids) or 'none'}")
    if box is None:
        return program[name]
    corners = [float(number) for number in box.split(",")]
    if len(corners) != 6:
        raise SystemExit(f"--box has {len(corners)} numbers, expected x0,y0,z0,x1,y1,z1")
    walls = f"not box({corners[:3]}, {corners[3:]})"
    text = f"{program.text}\nsolid {name}_and_walls = {name} or {walls}\n"
    return rfm.load(text, path, **params)[f"{name}_and_walls"].within(corners)


def main():
    options = arguments()
    if not options.seconds > 0.0:
        raise SystemExit("--seconds is the time to simulate, above 0")
    if wrong := [pair for pair in options.params if "=" not in pair]:
        raise SystemExit(f"-D {wrong[0]}: expected NAME=VALUE")
    try:
        solid = load(options.solid, options.box, dict(pair.split("=", 1) for pair in options.params))
    except (rfm.RfmError, OSError) as error:
        raise SystemExit(f"{options.solid}: {error}") from None
    variables = [word for pair in options.var for word in ("-var", *pair.split("=", 1))]
    lmp = lammps(cmdargs=["-log", "none", *variables])
    lmp.file(options.script)
    answer = {"restitution": options.restitution, "friction": options.friction, "reach": options.reach}
    obstacle = Obstacle(lmp, solid, **answer)
    steps = round(options.seconds / lmp.extract_global("dt"))
    started = time.perf_counter()
    lmp.command(f"run {steps}")
    seconds = time.perf_counter() - started
    rank, ranks = lmp.extract_setting("world_rank"), lmp.extract_setting("world_size")
    print(
        f"rank {rank} of {ranks}: {obstacle.hits} hits, {obstacle.stuck} stuck, {obstacle.undefined} undefined; "
        f"the obstacle took {1e3 * obstacle.seconds / obstacle.calls:.3f} of {1e3 * seconds / steps:.3f} ms per step",
        flush=True,
    )
    # all ranks take part, and each gets all particles
    x, v = (np.array(lmp.gather_atoms(name, 1, 3)).reshape(-1, 3) for name in ("x", "v"))
    if rank == 0:
        inside = int((obstacle.now().omega(x) > 0.0).sum())
        print(f"{len(x)} particles, {steps} steps, {seconds:.2f} s; {inside} inside the obstacle", flush=True)
        if options.output:
            np.savez(options.output, x=x, v=v)
    lmp.close()


if __name__ == "__main__":
    main()
