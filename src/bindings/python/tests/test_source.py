"""Solids as source text: C that a compiler makes a library of, and shaders."""

import ctypes
import shutil
import subprocess

import numpy as np
import pytest

import rfm

FLAGS = ["-O3", "-march=native", "-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math"]


def library(folder, text):
    (folder / "s.c").write_text(text)
    command = ["gcc", "-std=c99", *FLAGS, "-Wall", "-Wextra", "-shared", "-fPIC", "-o", "s.so", "s.c", "-lm"]
    found = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=True)
    assert found.stderr == ""
    return ctypes.CDLL(str(folder / "s.so"))


def column(array):
    return array.ctypes.data_as(ctypes.c_void_p)


def test_c_gives_the_bits_of_omega(pawn, tmp_path):
    assert shutil.which("gcc"), "gcc is not here"
    made = library(tmp_path, pawn.to_c())
    x, y, z = np.random.default_rng(5).uniform(0.5, 2.5, (3, 20_001))
    omega = np.empty_like(x)
    made.pawn_omega_many(ctypes.c_size_t(len(x)), column(x), column(y), column(z), column(omega))
    assert (omega == pawn.omega(x, y, z)).all()
    made.pawn_omega.restype = ctypes.c_double
    made.pawn_omega.argtypes = [ctypes.c_double] * 3
    assert made.pawn_omega(1.5, 1.5, 0.5) == pawn(1.5, 1.5, 0.5)


def test_params_may_stay_open(pawn, tmp_path):
    made = library(tmp_path, pawn.to_c(prefix="p", open_params=True))
    made.p_omega.restype = ctypes.c_double
    params = (ctypes.c_double * 2)(1.25, 1.75)
    at = [ctypes.c_double(value) for value in (1.2, 1.7, 0.5)]
    moved = pawn.program.with_params(cx=1.25, cy=1.75)["pawn"]
    assert made.p_omega(*at, params) == moved(1.2, 1.7, 0.5) != pawn(1.2, 1.7, 0.5)


def test_params_that_stay_constants_are_told_of(recwarn):
    program = rfm.load("rfm 1\nparam a = 0.5\nparam b = 2\nsolid s = sphere(b).scale(a)\nsolid row = sphere(a)")
    assert " * Params: a = 0.5, b = 2.0.\n" in program["s"].to_c()
    assert "Params:" not in program["row"].to_c(open_params=True)
    assert not recwarn.list
    with pytest.warns(UserWarning, match="^`a` decides how `s` is built and stays as in the file$") as warned:
        text = program["s"].to_c(open_params=True)
    assert warned[0].filename == __file__
    assert " * Params: a = 0.5.\n * `a` decides how `s` is built and stays as in the file.\n" in text


def test_texts_have_what_is_asked_for(pawn):
    assert "fn pawn_omega_gradient(p: vec3<f32>) -> vec4<f32> {" in pawn.to_wgsl()
    assert "float lady_sign(vec3 p) {" in pawn.to_glsl(prefix="lady", sign=True)
    assert "pawn_distance" in pawn.to_c(distance=True) and "pawn_distance" not in pawn.to_c()
    assert "static inline double pawn_omega(" in pawn.to_c(header=True)
    moving = rfm.load("rfm 1\nsolid wheel = box().rotate_z(t)")["wheel"]
    assert "double t" in moving.to_c() and "t: f32" in moving.to_wgsl()


def test_what_cannot_be_written_is_an_error(pawn):
    with pytest.raises(rfm.RfmError, match="names cannot begin with `2d`"):
        pawn.to_c(prefix="2d")
    with pytest.raises(rfm.RfmError, match="f32 cannot hold"):
        rfm.load("rfm 1\nsolid s = x <= 1e300*y").solid().to_glsl()
