"""Values: the bits of the program `rfm`, in every layout, type and number of threads."""

import json
import timeit

import numpy as np
import pytest

import rfm
from conftest import EXAMPLES

RNG = np.random.default_rng(5)
POINTS = RNG.uniform(0.0, 3.0, (257, 3))


def same(a, b):
    """Whether two arrays have the same bits; all NaN are one."""
    a, b = np.asarray(a), np.asarray(b)
    return a.shape == b.shape and a.dtype == b.dtype and np.array_equal(a, b, equal_nan=True)


def evaluated(program, file, points, what, *options, precision=None):
    """Figures of `rfm eval` at points, as columns."""
    table = "x,y,z\n" + "".join(f"{float(x)!r},{float(y)!r},{float(z)!r}\n" for x, y, z in points)
    precisions = ["--precision", precision] if precision else []
    out = program("eval", file, "--points", "-", "--what", what, *precisions, *options, input=table).stdout
    rows = np.array([[float(cell) for cell in line.split(",")] for line in out.splitlines()[1:]])
    return rows[:, 3:]



@pytest.mark.parametrize(
    ("file", "solid", "options"),
    [
        ("pawn.rfm", "pawn", []),
        ("bishop.rfm", "bishop", []),
        ("cube.rfm", "cube", []),
        ("gate.rfm", "gate", ["--time", "0.7"]),
        ("paddle.rfm", "paddle", ["--time", "1.25"]),
    ],
)
def test_values_are_those_of_the_program(program, file, solid, options):
    path = EXAMPLES / file
    asked = rfm.load(path)
    assert solid in asked
    found = asked[solid]
    if options:
        found = found.at(float(options[1]))
    arguments = ["-s", solid, *options]
    expected = evaluated(program, path, POINTS, "value,gradient,sign,distance", *arguments)
    assert same(found.omega(POINTS), expected[:, 0].copy())
    assert same(found.gradient(POINTS), expected[:, 1:4].copy())
    assert same(found.sign(POINTS), expected[:, 4].copy())
    # the program searches for the nearest point; a contact is an estimate, on the same side
    assert np.all(np.sign(found.contact(POINTS).distance) == np.sign(expected[:, 5]))
    assert [found(*p) for p in POINTS[:20]] == list(expected[:20, 0])
    single = POINTS.astype("f4")
    expected = evaluated(program, path, single, "value,gradient", *arguments, precision="f32")
    assert same(found.omega(single), expected[:, 0].astype("f4"))
    assert same(found.gradient(single), expected[:, 1:4].astype("f4"))


def test_a_tolerance_of_the_file_is_kept_as_the_program_keeps_it(program, tmp_path):
    path = tmp_path / "lens.rfm"
    path.write_text("rfm 1\n@tolerance(1e-5)\nsolid lens = sphere(1) and sphere(1).move([0.5, 0, 0])\n")
    lens = rfm.load(path)["lens"]
    points = RNG.uniform(-1.0, 1.0, (100, 3))
    expected = evaluated(program, path, points, "value")[:, 0].copy()
    assert same(lens.omega(points), expected)
    assert [lens(*p) for p in points] == list(expected)
    exact = lens.omega_gradient(points)[0]
    assert 0 < np.abs(exact - expected).max() < 1e-5


def layouts(points):
    """The same points in many layouts, each with a name."""
    wide = np.zeros((len(points), 7), dtype=points.dtype)
    wide[:, 1::2] = points
    every_other = np.repeat(points, 2, axis=0)
    backwards = points[::-1].copy()
    unaligned = np.frombuffer(b"\0" + points.tobytes(), dtype="u1")[1:].view("u1")
    unaligned = np.ndarray(points.shape, points.dtype, buffer=bytearray(b"\0" + unaligned.tobytes()), offset=1)
    columns = np.ascontiguousarray(points.T)
    yield "rows", (points,)
    yield "fortran", (np.asfortranarray(points),)
    yield "wide", (wide[:, 1::2],)
    yield "every other", (every_other[::2],)
    yield "backwards", (backwards[::-1],)
    yield "unaligned", (unaligned,)
    yield "read-only", (np.frombuffer(points.tobytes(), points.dtype).reshape(-1, 3),)
    yield "foreign order", (points.astype(points.dtype.newbyteorder()),)
    yield "three columns", tuple(columns)
    yield "columns of rows", tuple(points.T)
    yield "columns backwards", tuple(np.ascontiguousarray(column[::-1])[::-1] for column in columns)
    yield "mixed columns", (columns[0], points[:, 1], wide[:, 5])


@pytest.mark.parametrize("dtype", ["f8", "f4"])
@pytest.mark.parametrize("count", [0, 1, 2, 15, 16, 17, 255, 256, 257, 20_000, 70_001])
def test_layouts_and_threads_change_no_bit(pawn, dtype, count):
    points = RNG.uniform(0.5, 2.5, (count, 3)).astype(dtype)
    omega, gradient = pawn.omega_gradient(points, threads=1)
    values, sign, contact = pawn.omega(points, threads=1), pawn.sign(points, threads=1), pawn.contact(points, threads=1)
    assert omega.dtype == gradient.dtype == sign.dtype == contact.normal.dtype == np.dtype(dtype)
    assert gradient.shape == contact.normal.shape == (count, 3) and gradient.flags.c_contiguous
    if count:
        assert values[0] == pawn.omega(points[:1])[0]
    for name, given in layouts(points):
        for threads in (None, 1, 2):
            options = {} if threads is None else {"threads": threads}
            assert same(pawn.omega(*given, **options), values), name
            assert same(pawn.gradient(*given, **options), gradient), name
            assert same(pawn.sign(*given, **options), sign), name
            both = pawn.omega_gradient(*given, **options)
            assert same(both[0], omega) and same(both[1], gradient), name
            found = pawn.contact(*given, **options)
            assert all(same(a, b) for a, b in zip(found, contact, strict=True)), name
            if len(given) == 3:
                assert both[1][:, 0].flags.c_contiguous, name


def test_shapes_follow_those_of_the_points(pawn):
    flat = RNG.uniform(0.5, 2.5, (24, 3))
    grid = flat.reshape(2, 3, 4, 3)
    values, gradient = pawn.omega(flat), pawn.gradient(flat)
    assert same(pawn.omega(grid), values.reshape(2, 3, 4))
    assert same(pawn.gradient(grid), gradient.reshape(2, 3, 4, 3))
    x, y, z = np.moveaxis(grid, -1, 0)
    assert same(pawn.omega(x, y, z), values.reshape(2, 3, 4))
    assert same(pawn.gradient(x, y, z), gradient.reshape(2, 3, 4, 3))
    assert same(pawn.contact(x, y, z).normal, pawn.contact(grid).normal)
    # lists, and arrays that broadcast
    assert same(pawn.omega(flat.tolist()), values)
    u = np.linspace(0.0, 3.0, 5)
    plane = pawn.omega(u[:, None], u, 0.5)
    assert plane.shape == (5, 5) and plane[1, 2] == pawn(u[1], u[2], 0.5)
    # a number beside arrays of single precision is one of single precision
    assert pawn.omega(u.astype("f4"), u.astype("f4"), 0.5).dtype == np.float32
    assert pawn.omega(u.astype("f4"), u, 0.5).dtype == np.float64
    assert pawn.omega(np.array([1, 2]), np.array([1, 2]), np.array([0, 1])).dtype == np.float64
    # a single point
    assert isinstance(pawn(1.5, 1.5, 0.5), float) and pawn(1.5, 1.5, 0.5) == pawn([1.5, 1.5, 0.5])
    assert pawn.gradient(1.5, 1.5, 0.5).shape == (3,)
    assert same(pawn.gradient([1.5, 1.4, 0.5]), pawn.gradient(1.5, 1.4, 0.5))
    assert pawn.omega(np.array([1.5, 1.5, 0.5], dtype="f4")).dtype == np.float32
    assert pawn.contact(1.5, 1.5, 1.7).normal.shape == (3,)
    assert pawn.sign(1.5, 1.5, 0.5) == 1.0 and pawn.sign(0.0, 0.0, 0.5) == -1.0


def test_results_go_to_given_arrays(pawn):
    points = RNG.uniform(0.5, 2.5, (40_000, 3))
    omega, gradient = pawn.omega_gradient(points)
    values, contact = pawn.omega(points), pawn.contact(points)
    target = np.full(len(points), 7.0)
    assert pawn.omega(points, out=target) is target and same(target, values)
    # any strides
    wide = np.full((len(points), 5), 7.0)
    pawn.omega_gradient(points, out=(wide[:, 4], wide[:, :3]))
    assert same(wide[:, 4].copy(), omega) and same(wide[:, :3].copy(), gradient) and (wide[:, 3] == 7.0).all()
    backwards = np.zeros((len(points), 3))[::-1, ::-1]
    pawn.gradient(points, out=backwards)
    assert same(backwards.copy(), gradient)
    fortran = np.zeros((len(points), 3), order="F")
    assert same(pawn.gradient(points, out=fortran), gradient)
    distance, normal, curvature = np.zeros(len(points)), np.zeros((len(points), 3)), np.zeros(len(points))
    pawn.contact(*points.T, out=(distance, normal, curvature))
    assert same(distance, contact.distance) and same(normal, contact.normal) and same(curvature, contact.curvature)
    only = pawn.contact(points, out=(None, normal, None))
    assert only.normal is normal and same(only.distance, contact.distance)
    # more dimensions
    grid = np.zeros((200, 200))
    assert same(pawn.omega(points.reshape(200, 200, 3), out=grid), values.reshape(200, 200))


def test_results_may_replace_the_points(pawn):
    points = RNG.uniform(0.5, 2.5, (1000, 3))
    values, gradient = pawn.omega(points), pawn.gradient(points)
    own = points.copy()
    pawn.gradient(own, out=own)
    assert same(own, gradient)
    own = points.copy()
    pawn.omega(own, out=own[:, 1])
    assert same(own[:, 1].copy(), values) and same(own[:, 0].copy(), points[:, 0].copy())
    x, y, z = np.ascontiguousarray(points.T)
    pawn.omega(x, y, z, out=x)
    assert same(x, values)
    # shifted by one number, and two results in one array
    memory = np.zeros(3001)
    memory[:3000] = points.ravel()
    assert same(pawn.gradient(memory[:3000].reshape(-1, 3), out=memory[1:].reshape(-1, 3)), gradient)
    shared = np.zeros(4000)
    pawn.omega_gradient(points, out=(shared[:1000], shared[500:3500].reshape(-1, 3)))
    assert same(shared[500:3500].reshape(-1, 3), gradient)


def test_points_that_are_no_numbers_give_none(pawn):
    for bad in (np.nan, np.inf, -np.inf):
        for axis in range(3):
            point = np.array([[1.5, 1.5, 0.5]] * 3)
            point[1, axis] = bad
            for answer in (pawn.omega(point), pawn.sign(point), pawn.contact(point).distance):
                assert list(np.isnan(answer)) == [False, True, False]
            assert np.isnan(pawn(*point[1])) and np.isnan(pawn.gradient(point)[1]).all()


def test_first_entries_are_on_the_surface(pawn):
    start = np.column_stack([RNG.uniform(1, 2, (2000, 2)), np.full(2000, 2.5)])
    end = start - [0.0, 0.0, 3.0]
    for threads in (1, 2):
        entry = pawn.first_entry(start, end, threads=threads)
        met = ~np.isnan(entry.part)
        assert 0.7 < met.mean() < 0.85  # a disc in its square
        on_path = start + (end - start) * entry.part[:, None]
        assert np.allclose(entry.point[met], on_path[met], rtol=0, atol=1e-12)
        assert np.abs(pawn.contact(entry.point[met]).distance).max() < 1e-8
        assert np.allclose(np.linalg.norm(entry.normal[met], axis=1), 1.0) and (entry.normal[met, 2] > 0).all()
        assert entry.certain.all() and np.isnan(entry.normal[~met]).all()
    # through all of the pawn in one step, from above its head, of radius 0.05 ** 0.5
    part, point, normal, certain = pawn.first_entry([1.5, 1.5, 101.25], [1.5, 1.5, -98.75])
    assert part == pytest.approx((100 - 0.05**0.5) / 200, abs=1e-12) and certain
    assert normal == pytest.approx([0, 0, 1]) and point[2] == pytest.approx(1.25 + 0.05**0.5)
    assert np.isnan(pawn.first_entry([0, 0, 0], [0, 0, 3]).part)
    # one start, many ends
    assert pawn.first_entry([1.5, 1.5, 2.5], end).part.shape == (2000,)


def test_bounds_ranges_volumes(pawn, program):
    facts = json.loads(program("check", EXAMPLES / "pawn.rfm", "--json").stdout)["solids"][0]
    assert pawn.bounds.tolist() == [facts["bounds"]["min"], facts["bounds"]["max"]]
    assert pawn.volume() == facts["volume"] and pawn.volume(threads=1) == facts["volume"]
    low, high = pawn.range([[1, 1, 0], [2, 2, 1]])
    inside = pawn.omega(RNG.uniform([1, 1, 0], [2, 2, 1], (10_000, 3)))
    assert low <= inside.min() and inside.max() <= high
    assert pawn.range((5, 5, 5, 6, 6, 6))[1] < 0


def test_a_moving_solid_is_seen_at_a_time():
    door = rfm.load("rfm 1\nsolid door = box([0, 0, 0], [0.1, 1, 1]).move([t, 0, 0])")["door"]
    assert door.moves and door.time == 0.0
    later = door.at(2.0)
    assert later.time == 2.0 and door(0.05, 0.5, 0.5) > 0 > later(0.05, 0.5, 0.5) and later(2.05, 0.5, 0.5) > 0
    entry = door.between(0.0, 1.0).first_entry([1.05, 0.5, 0.5], [1.05, 0.5, 0.5])
    assert entry.part == pytest.approx(0.95) and entry.normal == pytest.approx([1, 0, 0])
    assert not rfm.load(EXAMPLES / "pawn.rfm")["pawn"].moves
    with pytest.raises(ValueError, match="ends before it begins"):
        door.between(2.0, 1.0)


def test_paths_are_rows_or_three_columns():
    ball = rfm.load("rfm 1\nsolid s = sphere(1)")["s"]
    for count in [1, 3, 5]:
        start, end = RNG.uniform(-3, 3, (count, 3)), np.zeros((count, 3))
        rows, columns = ball.first_entry(start, end), ball.first_entry(tuple(start.T), tuple(end.T))
        assert same(rows.part, columns.part) and same(rows.point, columns.point) and columns.part.shape == (count,)
    assert ball.first_entry((2, 0, 0), (0, 0, 0)).part == pytest.approx(0.5)


def test_contradictions_are_refused():
    ball = rfm.load("rfm 1\nsolid s = sphere(1)")["s"]
    points = RNG.uniform(-1, 1, (10, 3))
    with pytest.raises(ValueError, match="the same array"):
        ball.collide(points, points, reach=1.0)
    with pytest.raises(ValueError, match="expected one of them"):
        ball.mesh(cells=16, cell=0.1)


@pytest.mark.parametrize("dtype", ["f8", "f4"])
def test_velocities_and_clearances_are_those_at_single_points(dtype):
    wheel = rfm.load("rfm 1\nsolid wheel = box([-1, -1, 0], [1, 1, 1]).rotate_z(2*t).move([3*t, 0, 0])")["wheel"].at(0.5)
    points = RNG.uniform(-1, 3, (300, 3)).astype(dtype)
    found = wheel.wall_velocity(points)
    assert found.dtype == dtype and same(found, wheel.wall_velocity(*points.T, threads=2))
    x, y = points[:, 0], points[:, 1]
    assert np.allclose(found, np.stack([3 - 2 * y, 2 * (x - 1.5), 0 * x], axis=-1), atol=1e-5)
    assert (rfm.load("rfm 1\nsolid s = sphere(1)")["s"].wall_velocity(1, 0, 0) == 0).all()
    ball = rfm.load("rfm 1\nsolid s = sphere(1)")["s"]
    out = np.empty(300, dtype)
    assert ball.clearance(points, out=out) is out
    for count, threads in [(0, None), (1, 2), (2, None), (5, None), (300, 1), (300, 2)]:
        assert same(ball.clearance(points[:count], threads=threads), out[:count])
    distance = np.abs(np.linalg.norm(points.astype("f8"), axis=1) - 1)
    assert (out <= distance).all() and (out > distance * 0.99 - 1e-6).all()
    assert ball.clearance(*points[0].tolist()) == pytest.approx(out[0], rel=1e-6)
    assert np.isnan(ball.clearance(np.nan, 0, 0))


def test_a_stated_number_of_threads_costs_next_to_nothing(pawn):
    def seconds(**threads):
        runs = timeit.repeat(lambda: pawn.omega(1.5, 1.5, 0.5, **threads), number=1000, repeat=7)
        return min(runs) / 1000

    # asking the system for its processors took 29 µs in every call
    for threads in (1, 2):
        assert seconds(threads=threads) < seconds() + 5e-6
