"""Bad input: exceptions that say what is wrong, and never the end of the process."""

import pickle

import numpy as np
import pytest

import rfm
from conftest import EXAMPLES

N3 = np.zeros((4, 3))


def test_mistakes_in_a_file_have_places():
    with pytest.raises(rfm.RfmError) as raised:
        rfm.load("rfm 1\nsolid post = spere(1)\n")
    [found] = raised.value.diagnostics
    assert (found.severity, found.code, found.file) == ("error", "E0201", "<text>")
    assert (found.line, found.column, found.end_line, found.end_column) == (2, 14, 2, 19)
    assert found.help == "did you mean `sphere`?" and "spere" in found.message
    assert "error[E0201]" in str(raised.value) and "^^^^^" in str(raised.value)
    assert isinstance(raised.value, ValueError)
    again = pickle.loads(pickle.dumps(raised.value))
    assert str(again) == str(raised.value) and again.diagnostics == raised.value.diagnostics


@pytest.mark.parametrize(
    ("wrong", "error", "words"),
    [
        (lambda: rfm.load("no/such.rfm"), FileNotFoundError, "no/such.rfm"),
        (lambda: rfm.load(EXAMPLES), IsADirectoryError, "examples"),
        (lambda: rfm.load(3), TypeError, None),
        (lambda: rfm.load(b"rfm 1\nsolid a = sphere(1)"), TypeError, r"`text\.decode\(\)`"),
        (lambda: rfm.load("rfm 1\nparam a = 1 in 0 .. 2", a=3), rfm.RfmError, "param"),
        (lambda: rfm.load("rfm 1\nparam a = 1", b=3), rfm.RfmError, "no param `b`|`b`"),
        (lambda: rfm.load("rfm 1\nparam a = 1", a="x"), ValueError, "param `a`"),
        (lambda: rfm.load("rfm 1\nparam a = 1", a=[1]), TypeError, "param `a`"),
        (lambda: rfm.load("rfm 1\nparam a = 1 mm", a="3 kg"), rfm.RfmError, "the unit that `a` is given in does not fit"),
        (lambda: rfm.load("rfm 1\nparam a = 1 mm").with_params(a="3 kg"), rfm.RfmError, "does not fit"),
        (lambda: rfm.load("rfm 1\nparam a = 1", a=float("nan")), rfm.RfmError, None),
        (lambda: rfm.load("rfm 1\nsolid a = sphere(1)")["post"], KeyError, "no solid `post`"),
        (lambda: rfm.load("rfm 1\nsolid post = sphere(1)").solid("pst"), rfm.RfmError, "did you mean `post`"),
        (lambda: rfm.load("rfm 1\n"), rfm.RfmError, "defines nothing"),
        (lambda: rfm.load("rfm 1\nsolid a = sphere(1)").scene(), rfm.RfmError, "no scene"),
        (lambda: rfm.load("rfm 1\nsolid post = sphere(1)").scene("x"), rfm.RfmError, "no scene `x`"),
        (
            lambda: rfm.load("rfm 1\n@tolerance(1e-30)\nsolid a = sphere(1)")["a"],
            rfm.RfmError,
            "no program of `a` is certified",
        ),
    ],
)
def test_bad_files_params_and_names(wrong, error, words):
    with pytest.raises(error, match=words):
        wrong()


def test_a_program_has_only_names():
    program = rfm.load("rfm 1\nsolid a = sphere(1)")
    assert "a" in program and "b" not in program
    assert not any(other in program for other in (3, None, b"a", ["a"]))


def test_advice_about_params_is_that_of_python(tmp_path):
    text = "rfm 1\nparam d = 20 mm\nparam r = 20 mm in 1 mm .. 1 m\nsolid s = sphere(d) or sphere(r)"
    [bare] = rfm.load(text, d=8).warnings
    assert bare.help == 'write d="8000 mm", or d="8 mm" if that is meant'
    (tmp_path / "part.rfm").write_text(text)
    main = 'rfm 1\nimport "part.rfm" as part\nsolid both = part.s\n'
    for wrong, words in (
        (lambda: rfm.load(text, d="8 kg"), 'write d="20 mm"'),
        (lambda: rfm.load(text).with_params(d="8 kg"), 'write d="20 mm"'),
        (lambda: rfm.load(text, r=8), 'in SI units: write r="8 mm"'),
        (lambda: rfm.load(text, q=8), "declared params: d, r"),
        (lambda: rfm.load(text, density=8), "`param p = …` and `density: p`, and write `rfm.load(path, p=…)`"),
        (lambda: rfm.load(main, tmp_path / "main.rfm", **{"part.d": "8 kg"}), 'write **{"part.d": "20 mm"}'),
        (lambda: rfm.load("rfm 1\nsolid s = r <= 1 and x^2 + y^2 <= R^2"), "`rfm.load(path, R=2)`"),
        (lambda: rfm.load("rfm 1\nfloat a = 1"), "set from outside"),
        (lambda: rfm.load("rfm 1\nsolid s = sum i in 0..10000000: x <= i"), "shorter"),
    ):
        with pytest.raises(rfm.RfmError) as raised:
            wrong()
        advice = [found.help or "" for found in raised.value.diagnostics]
        assert any(words in help for help in advice), str(raised.value)
        assert not any(flag in help for help in advice for flag in ("-D", "--")), str(raised.value)


def test_a_param_without_a_unit_takes_any():
    assert rfm.load("rfm 1\nparam a = 1\nsolid s = sphere(a)", a="8 kg").params["a"].value == 8.0


def test_masked_elements_are_refused():
    ball = rfm.load("rfm 1\nsolid s = sphere(1)")["s"]
    whole = np.ma.masked_array(np.zeros((3, 3)))
    assert (ball.omega(whole) == ball(0.0, 0.0, 0.0)).all()
    masked = np.ma.masked_array(np.zeros((3, 3)), mask=np.eye(3))
    column = masked[:, 0]
    for question in (
        lambda: ball.omega(masked),
        lambda: ball.contact(column, 0.0, 0.0),
        lambda: ball.omega([masked[0], [0.0, 0.0, 0.0]]),
        lambda: ball.omega([0.0, np.ma.masked, 0.0]),
        lambda: ball.clearance([(masked[1], masked[2])]),
        lambda: ball.first_entry(masked, np.ones((3, 3))),
        lambda: ball.collide(masked, np.zeros((3, 3)), reach=1.0),
        lambda: ball.collide(np.zeros((3, 3)), masked, reach=1.0),
    ):
        with pytest.raises(ValueError, match="masked elements"):
            question()


def test_lists_that_hold_themselves_are_refused():
    ball = rfm.load("rfm 1\nsolid s = sphere(1)")["s"]
    endless = []
    endless.append(endless)
    with pytest.raises((ValueError, TypeError, RecursionError)):
        ball.omega(endless)


def test_a_text_names_other_files_if_it_stands_for_one(tmp_path):
    (tmp_path / "part.rfm").write_text("rfm 1\nsolid peg = cylinder(0.1, h = 1)\n")
    text = 'rfm 1\nimport "part.rfm" as part\nparam path = 1\nsolid two = part.peg or part.peg.move([path, 0, 0])\n'
    with pytest.raises(rfm.RfmError, match="cannot be read"):
        rfm.load(text)
    program = rfm.load(text, tmp_path / "board.rfm", path=2)
    assert program["two"](2.0, 0.0, 0.5) > 0.0 and program.path == str(tmp_path / "board.rfm")
    assert pickle.loads(pickle.dumps(program)).params["path"].value == 2.0
    with pytest.raises(ValueError, match="no text"):
        rfm.load(tmp_path / "part.rfm", tmp_path / "board.rfm")


def test_a_file_that_is_no_text(tmp_path):
    (tmp_path / "a.rfm").write_bytes(b"rfm 1\n\xff")
    with pytest.raises(rfm.RfmError, match="UTF-8"):
        rfm.load(tmp_path / "a.rfm")


READ_ONLY = np.zeros(4)
READ_ONLY.setflags(write=False)


@pytest.mark.parametrize(
    ("arguments", "options", "error", "words"),
    [
        ((np.zeros(4),), {}, ValueError, r"shape \(4,\), expected"),
        ((np.zeros((3, 4)),), {}, ValueError, r"shape \(3, 4\)"),
        ((1.0,), {}, ValueError, r"shape \(\)"),
        ((np.zeros((4, 3)), np.zeros(4)), {}, TypeError, "x, y and z"),
        ((1.0, 2.0), {}, TypeError, "x, y and z"),
        ((), {}, TypeError, None),
        ((np.zeros(4), np.zeros(5), np.zeros(4)), {}, ValueError, "broadcast"),
        (("pawn",), {}, TypeError, "real numbers"),
        (([1j, 0, 0],), {}, TypeError, "complex128, expected real numbers"),
        ((np.zeros((2, 3), dtype="O"),), {}, TypeError, "object, expected real numbers"),
        ((np.zeros((2, 3), dtype="M8[s]"),), {}, TypeError, "real numbers"),
        (([[1, 2, 3], [1, 2]],), {}, ValueError, None),
        ((None,), {}, TypeError, "real numbers"),
        ((N3,), {"out": np.zeros(3)}, ValueError, r"shape \[3\], expected \[4\]"),
        ((N3,), {"out": np.zeros((4, 1))}, ValueError, "shape"),
        ((N3,), {"out": np.zeros(4, dtype="f4")}, TypeError, "float32, expected float64"),
        ((N3,), {"out": [0.0] * 4}, TypeError, "expected an array"),
        ((N3,), {"out": READ_ONLY}, ValueError, "read-only"),
        ((1.0, 2.0, 3.0), {"out": np.zeros(1)}, TypeError, "single point"),
        ((N3,), {"threads": 0}, ValueError, "threads is 0"),
        ((N3,), {"threads": -1}, ValueError, "threads is -1"),
        ((N3,), {"threads": 1.5}, TypeError, None),
    ],
)
def test_bad_points(pawn, arguments, options, error, words):
    with pytest.raises(error, match=words):
        pawn.omega(*arguments, **options)


def test_bad_targets_of_several_results(pawn):
    for out in (np.zeros(4), (np.zeros(4),), (np.zeros(4), np.zeros(4)), (np.zeros(4), np.zeros((3, 4)))):
        with pytest.raises((TypeError, ValueError)):
            pawn.omega_gradient(N3, out=out)
    # an array all of whose elements are one
    one = np.lib.stride_tricks.as_strided(np.zeros(1), (4, 3), (0, 0))
    pawn.gradient(N3, out=one)


def test_numbers_of_points_that_no_memory_holds(pawn):
    many = np.broadcast_to(np.zeros(3), (1 << 58, 3))
    with pytest.raises((MemoryError, ValueError)):
        pawn.omega(many)
    with pytest.raises((MemoryError, ValueError)):
        pawn.gradient(many)
    column = np.broadcast_to(0.0, 1 << 58)
    with pytest.raises((MemoryError, ValueError)):
        pawn.omega(column, column, column)
    assert pawn.omega(np.zeros((4, 3)), threads=10**9).shape == (4,)


def test_bad_boxes_cells_and_planes(pawn):
    for box in ([0, 0, 0], [1, 1, 1, 0, 0, 0], [0, 0, 0, np.nan, 1, 1], [0, 0, 0, np.inf, 1, 1], "box", None):
        with pytest.raises((TypeError, ValueError)):
            pawn.range(box)
    for options in (
        {"cells": 1},
        {"cells": -1},
        {"cells": 10**9},
        {"cell": 0.0},
        {"cell": np.nan},
        {"method": "xx"},
        {"box": [0, 0, 0, 0, 1, 1]},
    ):
        with pytest.raises((OverflowError, ValueError)):
            pawn.mesh(**options)
    for options in (
        {},
        {"x": 1.0, "y": 1.0},
        {"z": np.nan},
        {"z": 0.5, "samples": 1},
        {"z": 0.5, "samples": 10**9},
        {"z": 0.5, "window": (0, 0, 0, 1)},
        {"z": 0.5, "window": (0, 0, np.nan, 1)},
    ):
        with pytest.raises(ValueError):
            pawn.slice(**options)
    with pytest.raises(ValueError, match="time"):
        pawn.at(np.nan)
    with pytest.raises(ValueError, match="cells"):
        pawn.volume(2)


def test_solids_without_bounds_or_inside():
    program = rfm.load("rfm 1\nsolid floor = z <= 0\nsolid none = sphere(1) and x >= 2")
    everything, nothing = program["floor"], program["none"]
    assert np.isinf(everything.bounds).all() and nothing.bounds is None
    for use in (everything.mesh, everything.volume, lambda: everything.slice(z=0.0)):
        with pytest.raises(rfm.RfmError, match="floor"):
            use()
    assert everything._repr_svg_() is None and "none found" in everything._repr_html_()
    assert everything.mesh(16, box=[-1, -1, -1, 1, 1, 1]).closed
    empty = nothing.mesh()
    assert empty.vertices.shape == empty.triangles.shape == (0, 3) and nothing.volume() == 0.0


def test_bad_paths(pawn):
    for start, end in (([0, 0], [1, 1]), ([0, 0, 0], "abc"), (np.zeros((2, 3)), np.zeros((4, 3))), (None, N3)):
        with pytest.raises((TypeError, ValueError)):
            pawn.first_entry(start, end)
    # no numbers: an answer, or none, but an end
    pawn.first_entry([np.nan, 0, 0], [1, 1, 1])
    pawn.first_entry([np.inf, 0, 0], [-np.inf, 1, 1])


def test_files_that_cannot_be_written(pawn, tmp_path):
    mesh = pawn.mesh(16)
    with pytest.raises(ValueError, match="ending"):
        mesh.save(tmp_path / "pawn.xyz")
    with pytest.raises(ValueError, match="no text form"):
        mesh.save(tmp_path / "pawn.ply", ascii=True)
    with pytest.raises(ValueError, match="always in metres"):
        mesh.save(tmp_path / "pawn.html", unit="mm")
    with pytest.raises(FileNotFoundError):
        mesh.save(tmp_path / "none" / "pawn.stl")
    with pytest.raises(OSError):
        (tmp_path / "folder.stl").mkdir()
        mesh.save(tmp_path / "folder.stl")
    with pytest.raises(ValueError, match=".svg or .png"):
        pawn.slice(z=0.5).save(tmp_path / "pawn.gif")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["folder.stl"]
    with pytest.raises(ValueError):
        mesh.vertices[0] = 1.0


def test_classes_are_not_made_by_hand():
    for made in (rfm.Program, rfm.Solid, rfm.Mesh, rfm.Slice, rfm.Simulation):
        with pytest.raises(TypeError):
            made()


def test_meshes_of_thin_solids_say_what_they_lack(tmp_path):
    plate = rfm.load("rfm 1\nsolid plate = box([0, 0, 0], [1, 1, 0.001])\n")["plate"]
    mesh = plate.mesh(cells=64)
    assert len(mesh.triangles) == 0 and not mesh.closed and mesh.thin_cells > 0
    with pytest.raises(rfm.RfmError, match="empty"):
        mesh.save(tmp_path / "plate.stl")
    assert not (tmp_path / "plate.stl").exists()
    fine = rfm.load("rfm 1\nsolid ball = sphere(1)\n")["ball"].mesh(cells=16)
    assert fine.closed and fine.thin_cells == 0


def test_paths_from_nowhere_are_not_certain():
    ball = rfm.load("rfm 1\nsolid ball = sphere(1)\n")["ball"]
    part, point, normal, certain = ball.first_entry([[np.nan, 0, 0], [-2, 0, 0]], [[2, 0, 0], [np.inf, 0, 0]])
    assert np.isnan(part).all() and np.isnan(point).all() and np.isnan(normal).all() and not certain.any()
