"""Pickles and copies of meshes and slices: they hold what was found, and nothing is found again."""

import copy
import multiprocessing
import pickle

import numpy as np
import pytest

import rfm
from rfm import _rfm
from conftest import EXAMPLES

WAYS = [
    *[lambda made, protocol=protocol: pickle.loads(pickle.dumps(made, protocol)) for protocol in range(2, 6)],
    copy.copy,
    copy.deepcopy,
]


def with_buffers(made):
    """Through a pickle whose arrays lie beside it."""
    buffers = []
    kept = pickle.dumps(made, 5, buffer_callback=buffers.append)
    return pickle.loads(kept, buffers=[bytes(buffer) for buffer in buffers])


def same_meshes(twin, mesh):
    for name in ("vertices", "normals", "triangles"):
        again, array = getattr(twin, name), getattr(mesh, name)
        assert np.array_equal(again, array) and again.dtype == array.dtype and not again.flags.writeable
    for name in ("volume", "area", "closed", "max_distance", "thin_cells"):
        assert getattr(twin, name) == getattr(mesh, name)
    assert repr(twin) == repr(mesh)


@pytest.mark.parametrize("way", [*WAYS, with_buffers])
def test_a_mesh_keeps_all_that_it_has(pawn, tmp_path, way):
    mesh = pawn.mesh(24)
    twin = way(mesh)
    same_meshes(twin, mesh)
    for ending in ("stl", "ply", "obj", "vtp", "glb", "3mf"):
        for name, made in (("twin", twin), ("mesh", mesh)):
            made.save(tmp_path / f"{name}.{ending}", unit="m")
        assert (tmp_path / f"twin.{ending}").read_bytes() == (tmp_path / f"mesh.{ending}").read_bytes()
    same_meshes(way(twin), mesh)


def test_a_mesh_is_kept_with_its_solid_until_its_thin_cells_are_counted():
    fan = rfm.load("rfm 1\nsolid fan = sphere(1) or box([1, -0.002, -1], [2, 0.002, 1])")["fan"]
    mesh = fan.mesh(24)
    uncounted = pickle.dumps(mesh)
    assert mesh.thin_cells > 0
    counted = pickle.dumps(mesh)
    assert b"rfm 1" in uncounted and b"rfm 1" not in counted
    assert pickle.loads(uncounted).thin_cells == pickle.loads(counted).thin_cells == mesh.thin_cells
    boxed = fan.mesh(24, box=[[-2, -2, 0], [2, 2, 2]])
    assert pickle.loads(pickle.dumps(boxed)).thin_cells == boxed.thin_cells


def test_an_empty_mesh_stays_empty(tmp_path):
    empty = rfm.load("rfm 1\nsolid none = sphere(1) and x >= 2")["none"].mesh(16)
    twin = pickle.loads(pickle.dumps(empty))
    same_meshes(twin, empty)
    with pytest.raises(rfm.RfmError, match="empty"):
        twin.save(tmp_path / "none.stl")


@pytest.mark.parametrize("way", [*WAYS, with_buffers])
def test_a_slice_keeps_all_that_it_has(tmp_path, way):
    gate = rfm.load(EXAMPLES / "gate.rfm", width=0.5)["gate"].at(0.75)
    for cut in (gate.slice(y=0.25, samples=50), gate.slice(z=0.5, samples=31, window=(0, 0, 2, 1))):
        twin = way(cut)
        for name in ("omega", "u", "v"):
            assert np.array_equal(getattr(twin, name), getattr(cut, name), equal_nan=True)
        assert (twin.axes, twin.extent, repr(twin)) == (cut.axes, cut.extent, repr(cut))
        assert twin.svg() == cut.svg()
        for name, made in (("twin", twin), ("cut", cut)):
            made.save(tmp_path / f"{name}.png")
        assert (tmp_path / "twin.png").read_bytes() == (tmp_path / "cut.png").read_bytes()


def test_a_slice_by_a_cheaper_program_keeps_its_bits():
    post = rfm.load("rfm 1\n@tolerance(1e-6)\nsolid post = x^2 + y^2 <= 0.25 and 0 <= z <= 1")["post"]
    cut = post.slice(z=0.5, samples=40)
    twin = pickle.loads(pickle.dumps(cut))
    assert np.array_equal(twin.omega, cut.omega) and twin.svg() == cut.svg()


def made_of(solid):
    return solid.mesh(16), solid.slice(z=0.5, samples=20)


def test_other_processes_return_meshes_and_slices(pawn):
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        mesh, cut = pool.apply(made_of, (pawn,))
    same_meshes(mesh, pawn.mesh(16))
    assert np.array_equal(cut.omega, pawn.slice(z=0.5, samples=20).omega)


VERTICES, TRIANGLES = np.eye(3), np.array([[0, 1, 2]], "u4")
FOUND = (0.0, 1.0, False, 0.0)


@pytest.mark.parametrize(
    ("arrays", "rest"),
    [
        ((VERTICES, VERTICES, np.array([[0, 1, 3]], "u4")), (FOUND, 0, None)),
        ((VERTICES, VERTICES, np.array([[0, 1, -1]])), (FOUND, 0, None)),
        ((VERTICES, VERTICES[:2], TRIANGLES), (FOUND, 0, None)),
        ((VERTICES[:, :2], VERTICES[:, :2], TRIANGLES), (FOUND, 0, None)),
        ((VERTICES.ravel(), VERTICES.ravel(), TRIANGLES), (FOUND, 0, None)),
        ((VERTICES * np.nan, VERTICES, TRIANGLES), (FOUND, 0, None)),
        ((VERTICES, VERTICES, np.array([["a", "b", "c"]])), (FOUND, 0, None)),
        ((None, None, None), (FOUND, 0, None)),
        ((VERTICES, VERTICES), (FOUND, 0, None)),
        ((VERTICES, VERTICES, TRIANGLES), (None, 0, None)),
        ((VERTICES, VERTICES, TRIANGLES), (FOUND, -1, None)),
        ((VERTICES, VERTICES, TRIANGLES), (FOUND, None, ("a solid", np.eye(2, 3), (2, 2, 2)))),
    ],
)
def test_no_mesh_comes_from_what_is_none(arrays, rest):
    right = _rfm._mesh((VERTICES, VERTICES, TRIANGLES), FOUND, 0, None)
    assert repr(right) == "<rfm.Mesh 3 vertices, 1 triangles, open>"
    # numbers out of a type's range warn in some versions of NumPy and are an error in others
    with np.errstate(all="ignore"), pytest.raises((ValueError, TypeError, OverflowError)):
        _rfm._mesh(arrays, *rest)


@pytest.mark.parametrize("corners", [[[0, 0, 0], [0, 0, 0]], [[0, 0, 0], [np.inf, 1, 1]], [[0, 0, 0]]])
@pytest.mark.parametrize("cells", [(2, 2, 2), (0, 2, 2), (2, 2, 10**9)])
def test_no_mesh_has_cells_that_are_none(pawn, corners, cells):
    with pytest.raises((ValueError, TypeError)):
        _rfm._mesh((VERTICES, VERTICES, TRIANGLES), FOUND, None, (pawn, corners, cells))


@pytest.mark.parametrize(
    "change",
    [
        {"axis": "w"},
        {"axis": 3},
        {"value": float("inf")},
        {"window": (0.0, 0.0, 0.0, 1.0)},
        {"window": (0.0, 0.0, np.nan, 1.0)},
        {"window": (0.0, 0.0, 1.0)},
        {"number": 1},
        {"number": 10**9},
        {"number": -4},
        {"omega": np.zeros((3, 5))},
        {"omega": np.zeros(20)},
        {"omega": "abc"},
        {"solid": None},
    ],
)
def test_no_slice_comes_from_what_is_none(pawn, change):
    right = {"solid": pawn, "axis": "z", "value": 0.5, "window": (0.0, 0.0, 1.0, 1.0), "number": 4}
    right["omega"] = np.zeros((4, 4))
    assert _rfm._slice(*right.values()).omega.shape == (4, 4)
    with pytest.raises((ValueError, TypeError, OverflowError)):
        _rfm._slice(*(right | change).values())


def test_pickles_that_were_cut_or_changed_are_errors(pawn):
    """Any exception will do; a crash of the process would end the tests."""
    random = np.random.default_rng(7)
    for made in (pawn.mesh(8), pawn.slice(z=0.5, samples=6)):
        whole = pickle.dumps(made)
        for end in range(0, len(whole), max(1, len(whole) // 50)):
            with pytest.raises(Exception):
                pickle.loads(whole[:end])
    for shapes in (((3, 3), (3, 3), (5, 3)), ((0, 3), (0, 3), (1, 3)), ((3,), (3, 3), (3, 3))):
        arrays = tuple(random.integers(0, 1000, shape) for shape in shapes)
        with pytest.raises(ValueError):
            _rfm._mesh(arrays, FOUND, None, None)
