"""The module as a whole: programs, meshes, slices, pickles, processes and threads, stubs."""

import base64
import copy
import html
import json
import multiprocessing
import os
import pickle
import pydoc
import re
import subprocess
import sys
import threading
import time
import xml.etree.ElementTree
import zlib
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import rfm
from conftest import EXAMPLES, ROOT

POINTS = np.random.default_rng(3).uniform(0.5, 2.5, (50_000, 3))


def test_a_program_says_what_it_has():
    program = rfm.load(EXAMPLES / "pawn.rfm", cx=1.25)
    assert program.solids == ["pawn"] == list(program) and program.scenes == ["drop"] and len(program) == 1
    assert "pawn" in program and "queen" not in program
    assert program.params["cx"] == (1.25, 0.5, 2.5, "axis of the pawn, x", None)
    assert rfm.load("rfm 1\nparam d = 8 mm\nsolid s = sphere(d)").params["d"] == (0.008, None, None, None, "mm")
    assert program.params["cy"].value == 1.5 and list(program.params) == ["cx", "cy", "particles"]
    assert program.path == str(EXAMPLES / "pawn.rfm") and program.text.startswith("rfm 1\n")
    assert rfm.load("rfm 1\nparam a = 1 mm\nsolid s = sphere(a)", a="5 cm")["s"](0, 0, 0) == pytest.approx(0.025)
    moved = program.with_params(cy=2.0)
    assert (moved.params["cx"].value, moved.params["cy"].value) == (1.25, 2.0)
    assert moved["pawn"](1.25, 2.0, 0.5) == program["pawn"](1.25, 1.5, 0.5)
    assert program["pawn"].program.text == program.text and repr(program["pawn"]) == "<rfm.Solid pawn>"
    assert "1 solid, 1 scene" in repr(program)
    warned = rfm.load("rfm 1\nlet unused = 1\nsolid a = sphere(1)")
    assert [found.severity for found in warned.warnings] == ["warning"] and warned.path is None
    assert warned.solid()(0.0, 0.0, 0.0) > 0.0


def test_meshes_are_arrays(pawn, tmp_path):
    mesh = pawn.mesh(32)
    assert mesh.closed and mesh.vertices.dtype == np.float64 and mesh.triangles.dtype == np.uint32
    assert mesh.vertices.shape == mesh.normals.shape and mesh.triangles.max() + 1 == len(mesh.vertices)
    assert np.abs(pawn.contact(mesh.vertices).distance).max() < 1e-9
    a, b, c = (mesh.vertices[mesh.triangles[:, k]] for k in range(3))
    assert np.einsum("ij,ij->", a, np.cross(b, c)) / 6 == pytest.approx(mesh.volume)
    assert np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2 == pytest.approx(mesh.area)
    assert mesh.volume == pytest.approx(pawn.volume(), rel=0.02)
    one = pawn.mesh(32, threads=1)
    assert np.array_equal(one.vertices, mesh.vertices) and np.array_equal(one.triangles, mesh.triangles)
    assert pawn.mesh(32, method="mc").closed and pawn.mesh(cell=0.1, no_slivers=True).closed
    for ending in ("stl", "ply", "obj", "vtp", "glb", "3mf", "html"):
        path = tmp_path / f"pawn.{ending}"
        mesh.save(path)
        assert path.stat().st_size > 1000
    mesh.save(str(tmp_path / "text.stl"), ascii=True)
    assert (tmp_path / "text.stl").read_text().startswith("solid rfm")


def test_a_sheet_too_thin_for_cells_has_its_volume():
    sheet = rfm.load("rfm 1\nsolid sheet = box([0, 0, 0], [10, 10, 0.01])\n")["sheet"]
    assert sheet.volume() == pytest.approx(1.0, rel=2e-3)
    # cells show a little of these, or some of their parts
    shell = rfm.load("rfm 1\nsolid shell = sphere(1).shell(0.001)\n")["shell"]
    assert shell.volume() == pytest.approx(4 * np.pi * 0.001, rel=0.01)
    wing = rfm.load("rfm 1\nsolid wing = sphere(0.5) or box([0, 0, 0], [4, 4, 0.001])\n")["wing"]
    assert wing.volume() == pytest.approx(0.5236 + 0.0158, rel=0.01)


def test_the_volume_is_the_one_that_check_finds(program, tmp_path):
    # a solid of triangles has the volume of these; coarse meshes of ten plates do not tell how many there are
    part = EXAMPLES / "parts" / "bracket.stl"
    (tmp_path / "bracket.stl").write_bytes(part.read_bytes())
    comb = "any i in 0..10: box([0, 0, i], [9, 9, i + 0.35])"
    (tmp_path / "s.rfm").write_text(f'rfm 1\nsolid bracket = mesh("bracket.stl", 1 mm)\nsolid comb = {comb}\n')
    facts = json.loads(program("check", tmp_path / "s.rfm", "--json").stdout)["solids"]
    solids = rfm.load(tmp_path / "s.rfm")
    assert solids["bracket"].volume() == pytest.approx(facts[0]["volume"], rel=1e-12)
    assert solids["comb"].volume() == pytest.approx(10 * 81 * 0.35, rel=0.01)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes with names here")
def test_a_mesh_takes_the_place_of_no_pipe_and_no_link(pawn, tmp_path):
    mesh, pipe, link = pawn.mesh(16), tmp_path / "pipe.stl", tmp_path / "link.stl"
    os.mkfifo(pipe)
    link.symlink_to("part.stl")
    (tmp_path / "part.stl").write_text("old")
    with ThreadPoolExecutor() as pool:
        read = pool.submit(pipe.read_bytes)
        mesh.save(pipe)
    mesh.save(link)
    assert pipe.is_fifo() and link.is_symlink()
    assert read.result() == (tmp_path / "part.stl").read_bytes() and len(read.result()) > 84


def test_a_saved_mesh_is_that_of_the_program(pawn, program, tmp_path):
    program("mesh", EXAMPLES / "pawn.rfm", "--cells", "24", "-o", tmp_path / "theirs.ply")
    pawn.mesh(24).save(tmp_path / "ours.ply")
    assert (tmp_path / "ours.ply").read_bytes() == (tmp_path / "theirs.ply").read_bytes()


def test_meshes_become_those_of_other_packages(pawn):
    mesh = pawn.mesh(24)
    trimesh = pytest.importorskip("trimesh")
    found = mesh.to_trimesh()
    assert isinstance(found, trimesh.Trimesh) and found.is_watertight and found.volume == pytest.approx(mesh.volume)
    meshio = pytest.importorskip("meshio")
    found = mesh.to_meshio()
    assert isinstance(found, meshio.Mesh) and np.array_equal(found.cells[0].data, mesh.triangles)
    assert np.array_equal(found.point_data["normals"], mesh.normals)


def test_a_mesh_becomes_one_of_pyvista(pawn):
    pyvista = pytest.importorskip("pyvista")
    mesh = pawn.mesh(24)
    found = mesh.to_pyvista()
    assert isinstance(found, pyvista.PolyData) and found.is_all_triangles and found.n_open_edges == 0
    assert found.volume == pytest.approx(mesh.volume) and np.array_equal(found.points, mesh.vertices)


def test_trimesh_reads_saved_meshes_as_closed(pawn, tmp_path):
    trimesh = pytest.importorskip("trimesh")
    mesh = pawn.mesh(32)
    # with its normals a vertex at a crease is several, unless trimesh is told to keep those of the file
    for ending, how in (("stl", {}), ("ply", {}), ("obj", {"maintain_order": True})):
        mesh.save(tmp_path / f"pawn.{ending}")
        found = trimesh.load(tmp_path / f"pawn.{ending}", force="mesh", **how)
        assert found.is_watertight and len(found.vertices) == len(mesh.vertices), ending
        assert found.volume == pytest.approx(mesh.volume, rel=1e-5), ending


def test_normals_of_an_obj_are_those_of_each_face_at_a_crease(pawn, tmp_path):
    trimesh = pytest.importorskip("trimesh")
    pawn.mesh(32).save(tmp_path / "pawn.obj")
    found = trimesh.load(tmp_path / "pawn.obj", force="mesh")
    foot = found.faces[(found.vertices[found.faces][..., 2] < 1e-9).all(axis=1)]
    assert len(foot) > 100 and np.allclose(found.vertex_normals[foot], [0, 0, -1], atol=1e-6)
    # the rim of the foot is also that of its side, whose normals are level or point up
    side = found.faces[(found.vertices[found.faces][..., 2] < 0.05).all(axis=1)]
    on_rim = (found.vertices[side][..., 2] < 1e-9) & ~(found.face_normals[:, 2] < -0.99)[
        (found.vertices[found.faces][..., 2] < 0.05).all(axis=1)
    ][:, None]
    assert on_rim.any() and (found.vertex_normals[side][on_rim][:, 2] > -0.5).all()


def test_meshio_reads_what_has_one_normal_for_a_vertex(pawn, tmp_path):
    meshio = pytest.importorskip("meshio")
    mesh = pawn.mesh(32)
    for ending in ("stl", "ply"):
        mesh.save(tmp_path / f"pawn.{ending}")
        found = meshio.read(tmp_path / f"pawn.{ending}")
        assert len(found.points) == len(mesh.vertices), ending
        assert found.cells_dict["triangle"].shape == mesh.triangles.shape, ending
    # meshio has no normals of corners, so it reads the OBJ of a mesh without creases only
    ball = rfm.load("rfm 1\nsolid ball = sphere(1)")["ball"].mesh(16)
    ball.save(tmp_path / "ball.obj")
    found = meshio.read(tmp_path / "ball.obj")
    assert np.allclose(found.point_data["obj:vn"], found.points, atol=1e-6)
    assert np.array_equal(found.cells_dict["triangle"], ball.triangles)


def test_vtk_reads_saved_meshes(pawn, tmp_path):
    pyvista = pytest.importorskip("pyvista")
    mesh = pawn.mesh(32)
    for ending in ("stl", "ply", "obj", "vtp"):
        mesh.save(tmp_path / f"pawn.{ending}")
        found = pyvista.read(tmp_path / f"pawn.{ending}")
        assert found.n_cells == len(mesh.triangles), ending
        # corners with normals of their own are points of their own, in the same place
        closed = found.clean() if ending == "obj" else found
        assert closed.n_open_edges == 0 and closed.volume == pytest.approx(mesh.volume, rel=1e-5), ending
        if ending != "stl":
            normals = np.asarray(found.point_data.active_normals)
            assert np.allclose(np.linalg.norm(normals, axis=1), 1, atol=1e-6), ending


def test_a_package_that_is_not_there_is_named(pawn, monkeypatch):
    for name in ("trimesh", "pyvista", "meshio"):
        monkeypatch.setitem(sys.modules, name, None)
        with pytest.raises(ImportError, match=f"pip install {name}"):
            getattr(pawn.mesh(8), f"to_{name}")()


def test_slices_are_samples_and_pictures(pawn, program, tmp_path):
    found = pawn.slice(y=1.5, samples=61)
    assert found.axes == ("x", "z") and found.extent == (0.0, 3.0, 0.0, 3.0) and found.omega.shape == (61, 61)
    assert np.array_equal(found.omega, pawn.omega(found.u, 1.5, found.v[:, None]))
    xml.etree.ElementTree.fromstring(found.svg())
    found = pawn.slice(z=0.5, window=(1, 1, 2, 1.5), samples=21)
    assert found.omega.shape == (11, 21) and found.u[0] == 1.0 and found.v[-1] == 1.5
    for ending in ("svg", "png"):
        pawn.slice(y=1.5).save(tmp_path / f"ours.{ending}")
    assert (tmp_path / "ours.png").read_bytes().startswith(b"\x89PNG")
    options = ("--slice", "y=1.5", "--window", "0,0,3,3", "-o", tmp_path / "theirs.svg")
    program("check", EXAMPLES / "pawn.rfm", *options)
    assert (tmp_path / "ours.svg").read_bytes() == (tmp_path / "theirs.svg").read_bytes()


def test_notebooks_see_a_picture(pawn):
    assert pawn._repr_svg_().startswith("<svg") and "<svg" in pawn._repr_html_() and "pawn" in pawn._repr_html_()
    assert pawn.slice(z=0.5)._repr_svg_().startswith("<svg")


def pages(shown):
    """The viewer's pages in a text for a notebook, and the heads of their blocks."""
    found = re.findall(r'<iframe sandbox="allow-scripts allow-downloads" style="[^"]*" srcdoc="([^"]*)"></iframe>', shown)
    pages = [html.unescape(page) for page in found]
    groups = [re.findall(r'<script type="application/octet-stream">([^<]*)</script>', page) for page in pages]
    heads = [[head for group in page for head in heads_of(zlib.decompress(base64.b64decode(group), -15))] for page in groups]
    return pages, heads


def heads_of(group):
    """The heads of the blocks of a group, each of which stands behind its length."""
    while group:
        end = 4 + int.from_bytes(group[:4], "little")
        block, group = group[4:end], group[end:]
        yield json.loads(block[4 : 4 + int.from_bytes(block[:4], "little")])


def test_notebooks_see_the_viewer(pawn):
    [page], [[mesh]] = pages(pawn._repr_html_())
    assert page.startswith("<!doctype html>") and page.rstrip().endswith("</html>")
    assert mesh["kind"] == "mesh" and mesh["triangles"] > 1000
    assert mesh["min"] == pytest.approx(pawn.bounds[0], abs=0.01) and mesh["max"] == pytest.approx(pawn.bounds[1], abs=0.01)
    simulation = rfm.load(EXAMPLES / "pawn.rfm", particles=500).scene()
    simulation.advance(0.02)
    shown = simulation._repr_html_()
    assert "scene drop · paper · 500 particles · t = 0.0200 s" in shown
    [page], [[mesh, frame]] = pages(shown)
    assert (mesh["kind"], frame["kind"], frame["count"], frame["mesh"]) == ("mesh", "frame", 500, 0)
    assert frame["time"] == pytest.approx(0.02) and frame["ranges"][0]["high"] > 0.1
    # what has no mesh is shown without one
    nothing = rfm.load("rfm 1\nsolid none = sphere(1) and x >= 2")["none"]
    assert pages(nothing._repr_html_()) == ([], []) and "empty" in nothing._repr_html_()


def test_pickles_keep_the_files_that_a_program_reads(tmp_path, monkeypatch):
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "ball.rfm").write_text("rfm 1\nparam r = 50 cm\nsolid ball = sphere(r)\n")
    (tmp_path / "main.rfm").write_text('rfm 1\nimport "parts/ball.rfm" as parts\nsolid s = parts.ball\n')
    monkeypatch.chdir(tmp_path)
    program = rfm.load("main.rfm")
    kept = pickle.dumps(program)
    (tmp_path / "parts" / "ball.rfm").write_text("rfm 1\nsolid ball = sphere(1)\n")
    monkeypatch.chdir("/")
    again = pickle.loads(kept)
    assert again["s"](0, 0, 0) == program["s"](0, 0, 0) == 0.25
    assert pickle.loads(pickle.dumps(again))["s"](0, 0, 0) == 0.25


def test_no_number_of_threads_is_that_of_the_default(pawn):
    points = POINTS[:100]
    assert np.array_equal(pawn.omega(points, threads=None), pawn.omega(points))
    assert pawn.program.scene(threads=None).time == 0.0


def test_pickles_keep_source_params_and_time():
    program = rfm.load(EXAMPLES / "gate.rfm", width=0.5)
    again = pickle.loads(pickle.dumps(program))
    assert again.text == program.text and again.params == program.params and again.path == program.path
    gate = program["gate"].at(0.75)
    for twin in (pickle.loads(pickle.dumps(gate)), copy.copy(gate), copy.deepcopy(gate)):
        assert (twin.name, twin.time) == ("gate", 0.75)
        assert np.array_equal(twin.omega(POINTS - 1), gate.omega(POINTS - 1))
    contact = pickle.loads(pickle.dumps(gate.contact(POINTS[:5])))
    assert isinstance(contact, rfm.Contact) and contact.normal.shape == (5, 3)


def in_child(pawn, queue):
    points = np.random.default_rng(3).uniform(0.5, 2.5, (50_000, 3))
    queue.put((pawn.omega(points, threads=2), len(pawn.mesh(16).vertices), pawn.slice(z=0.5).omega.sum()))


@pytest.mark.skipif(not hasattr(os, "fork"), reason="this system cannot fork")
@pytest.mark.filterwarnings("ignore:This process:DeprecationWarning")
def test_a_forked_child_does_not_wait_for_threads_that_it_has_not(pawn):
    expected = pawn.omega(POINTS, threads=2), len(pawn.mesh(16).vertices), pawn.slice(z=0.5).omega.sum()
    context = multiprocessing.get_context("fork")
    queue = context.Queue()
    child = context.Process(target=in_child, args=(pawn, queue))
    child.start()
    found = queue.get(timeout=60)
    child.join(timeout=60)
    assert child.exitcode == 0
    assert np.array_equal(found[0], expected[0]) and found[1:] == expected[1:]
    # the parent goes on with its threads
    assert np.array_equal(pawn.omega(POINTS, threads=2), expected[0])


def test_many_processes_share_a_solid(pawn):
    with multiprocessing.get_context("spawn").Pool(2) as pool:
        parts = pool.map(pawn.omega, np.array_split(POINTS, 4))
    assert np.array_equal(np.concatenate(parts), pawn.omega(POINTS))


def test_threads_of_python_share_a_solid_that_nobody_has_compiled():
    solid = rfm.load(EXAMPLES / "bishop.rfm")["bishop"]
    found = {}
    barrier = threading.Barrier(4)

    def ask(number):
        barrier.wait()
        found[number] = solid.omega_gradient(POINTS, threads=number % 2 + 1)

    threads = [threading.Thread(target=ask, args=(number,)) for number in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(timeout=60)
    assert len(found) == 4
    assert all(np.array_equal(omega, found[0][0]) and np.array_equal(g, found[0][1]) for omega, g in found.values())


def test_other_threads_go_on_while_points_are_evaluated(pawn):
    points = np.concatenate([POINTS] * 60)
    seen, done = [], threading.Event()

    def look():
        while not done.wait(0.001):
            seen.append(time.perf_counter())

    watcher = threading.Thread(target=look)
    watcher.start()
    started = time.perf_counter()
    pawn.contact(points, threads=1)
    ended = time.perf_counter()
    done.set()
    watcher.join()
    # at the ends of the call the watcher may have run before or after it
    quarter = (ended - started) / 4
    assert any(started + quarter < moment < ended - quarter for moment in seen)


def test_everything_is_described():
    for owner in (rfm, rfm.Program, rfm.Solid, rfm.Mesh, rfm.Slice, rfm.Simulation):
        for name in dir(owner):
            if not name.startswith("_"):
                text = pydoc.getdoc(getattr(owner, name))
                assert len(text) > 10, f"{owner.__name__}.{name}"


def test_the_module_imports_little():
    code = "import sys, rfm; print(sorted({'numpy', 'typing', 'collections', 'rfm._records'} & set(sys.modules)))"
    out = subprocess.run([sys.executable, "-S", "-c", f"import sys; sys.path += {sys.path!r}; {code}"],
                         capture_output=True, text=True, check=True)
    assert "numpy" not in out.stdout and "_records" not in out.stdout


def test_the_doctest_of_the_module():
    import doctest

    assert doctest.testmod(rfm).failed == 0 and doctest.testmod(rfm).attempted >= 4


def test_stubs_say_what_is_there():
    pytest.importorskip("mypy")
    run = subprocess.run(
        [sys.executable, "-m", "mypy.stubtest", "rfm", "--ignore-missing-stub"], capture_output=True, text=True
    )
    assert run.returncode == 0, run.stdout + run.stderr


def test_typed_programs_pass_and_wrong_ones_do_not(tmp_path):
    pytest.importorskip("mypy")
    config = ROOT / "src/bindings/python/pyproject.toml"
    (tmp_path / "right.py").write_text(
        "import numpy as np\nimport rfm\n\n"
        "pawn = rfm.load('a.rfm', cx=1.0)['pawn']\n"
        "value: float = pawn(1.0, 2.0, 3.0)\n"
        "distance, normal, curvature = pawn.contact(np.zeros((4, 3)), threads=2)\n"
        "simulation = rfm.load('a.rfm').scene()\nsimulation.advance(1.0, progress=True)\n"
        "height = simulation.probes['gauge']['height'].max()\n"
    )
    (tmp_path / "wrong.py").write_text("import rfm\n\nrfm.load('a.rfm').scene().step('ten')\n")
    for name, code in (("right", 0), ("wrong", 1)):
        command = [sys.executable, "-m", "mypy", "--config-file", config, "--cache-dir", tmp_path, f"{name}.py"]
        run = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
        assert run.returncode == code, run.stdout + run.stderr
