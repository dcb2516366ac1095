"""Particles that have entered a solid: put back in place, with the meaning of `rfm_collide` in C."""

import pickle

import numpy as np
import pytest

import rfm

RNG = np.random.default_rng(11)
FLOOR = rfm.load("rfm 1\nsolid floor = z <= 0")["floor"]


def particles(count):
    return RNG.uniform(0.5, 2.5, (count, 3)), RNG.normal(size=(count, 3))


def test_a_floor_gives_back_what_is_asked_for():
    x = np.array([[0.0, 0.0, -0.01], [1.0, 1.0, 0.5], [2.0, 0.0, -0.02]])
    v = np.array([[3.0, 0.0, -2.0], [1.0, 1.0, -5.0], [0.1, 0.0, -4.0]])
    found = FLOOR.collide(x, v, reach=0.1, restitution=0.25, friction=0.5)
    assert found == rfm.Collisions(hits=2, stuck=0, undefined=0) and isinstance(found, rfm.Collisions)
    assert (FLOOR.sign(x) < 0).all() and np.abs(x[[0, 2], 2]).max() < 1e-12
    assert x[1].tolist() == [1.0, 1.0, 0.5] and v[1].tolist() == [1.0, 1.0, -5.0]
    # 1.25 × 2 m/s is the change of the normal speed, and half of it is lost along the floor
    assert v[0] == pytest.approx([3.0 - 1.25, 0.0, 0.5]) and v[2] == pytest.approx([0.0, 0.0, 1.0])


@pytest.mark.parametrize("count", [0, 1, 63, 64, 5000, 70_001])
def test_layouts_and_threads_change_no_bit(pawn, count):
    x0, v0 = particles(count)
    x, v = x0.copy(), v0.copy()
    found = pawn.collide(x, v, reach=0.5, restitution=0.5, friction=0.1, threads=1)
    inside = pawn.omega(x0) >= 0
    assert found == (inside.sum(), 0, 0)
    assert (x[~inside] == x0[~inside]).all() and (v[~inside] == v0[~inside]).all()
    assert (pawn.omega(x) < 0).all()
    if count > 1000:
        assert found.hits > 10 and (v[inside] != v0[inside]).any()
    records = np.zeros(count, dtype=[("id", "i4"), ("x", "f8", 3), ("v", "f8", 3)])
    columns = np.ascontiguousarray(x0.T), np.ascontiguousarray(v0.T)
    for threads in (None, 1, 2):
        options = {"reach": 0.5, "restitution": 0.5, "friction": 0.1} | ({} if threads is None else {"threads": threads})
        records["x"], records["v"] = x0, v0
        assert pawn.collide(records["x"], records["v"], **options) == found
        assert (records["x"] == x).all() and (records["v"] == v).all() and (records["id"] == 0).all()
        a, b = columns[0].copy(), columns[1].copy()
        assert pawn.collide(tuple(a), list(b), **options) == found
        assert (a.T == x).all() and (b.T == v).all()


def test_a_surface_that_moves_takes_particles_along():
    door = rfm.load("rfm 1\nsolid door = box([0, 0, 0], [0.1, 1, 1]).move([2*t, 0, 0])")["door"].at(0.5)
    x, v = np.array([[1.09, 0.5, 0.5]]), np.zeros((1, 3))
    assert door.collide(x, v, reach=0.2).hits == 1
    assert x[0] == pytest.approx([1.1, 0.5, 0.5]) and v[0] == pytest.approx([2.0, 0.0, 0.0])


def test_what_cannot_be_put_back_stays(pawn):
    x = np.array([[1.5, 1.5, 0.5], [np.nan, 0, 0], [0.0, 0.0, 0.0], [9.0, 9.0, np.inf]])
    v = np.zeros((4, 3))
    v[2, 1] = np.inf
    before = x.copy(), v.copy()
    assert pawn.collide(x, v, reach=1e-3) == (0, 1, 3)
    assert all(np.array_equal(a, b, equal_nan=True) for a, b in zip((x, v), before, strict=True))


VESSEL = "rfm 1\nsolid posts = any i in 0..12: any j in 0..10: cylinder(0.02, 0.7).move([0.1 + 0.15*i, 0.05 + 0.1*j, -0.2])"
VESSEL += "\nsolid both = posts or not box([0, 0, 0], [2, 1, 1])"


@pytest.mark.parametrize("name", ["posts", "both"])
def test_many_parts_have_the_answers_of_all(name):
    solid = rfm.load(VESSEL)[name]
    near = solid.within([0, 0, 0, 2, 1, 1])
    x0 = RNG.uniform([-0.01, -0.01, -0.01], [2.01, 1.01, 0.6], (3000, 3))
    v0 = RNG.normal(size=x0.shape)
    inside = solid.sign(x0) >= 0
    for other in (near, pickle.loads(pickle.dumps(near)), near.at(1.0)):
        x, v = x0.copy(), v0.copy()
        assert other.collide(x, v, reach=0.2, restitution=1.0) == (inside.sum(), 0, 0)
        assert (solid.omega(x) < 0).all() and (x[~inside] == x0[~inside]).all()
        # hardly any way out is longer than the radius of a post and the depth below the floor together
        moved = np.linalg.norm(x - x0, axis=1)
        assert moved.max() <= 0.2 and (moved[inside] < 0.03).mean() > 0.98
        speed, before = np.linalg.norm(v, axis=1), np.linalg.norm(v0, axis=1)
        assert (speed <= before * (1 + 1e-12)).all() and np.isclose(speed, before).mean() > 0.99
    assert (near.omega(x0) == solid.omega(x0)).all()


def test_all_corners_of_a_vessel_have_a_way_out():
    vessel = rfm.load(VESSEL)["both"].within([0, 0, 0, 2, 1, 1])
    signs = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, -1).T
    for depth in (1e-12, 1e-6, 1e-3, 0.01):
        x = np.array([1.0, 0.5, 0.5]) + signs * (np.array([1.0, 0.5, 0.5]) + depth * np.array([1.0, 0.7, 0.1]))
        v = 2.0 * signs
        assert vessel.collide(x, v, reach=0.1, restitution=0.5) == (8, 0, 0), depth
        # reflected by all three faces
        assert (vessel.omega(x) < 0).all() and np.allclose(v, -signs), depth


READ_ONLY = np.zeros((4, 3))
READ_ONLY.setflags(write=False)
GOOD = np.zeros((4, 3))


@pytest.mark.parametrize(
    ("x", "v", "options", "error", "words"),
    [
        (GOOD, np.zeros((3, 3)), {}, ValueError, "4 positions, but 3 velocities"),
        (np.zeros((3, 4)), GOOD, {}, ValueError, r"positions have the shape \[3, 4\]"),
        (GOOD, READ_ONLY, {}, ValueError, "velocities are read-only"),
        (GOOD.astype("f4"), GOOD, {}, TypeError, "array of float32, expected a float64"),
        (GOOD, GOOD.astype(">f8"), {}, TypeError, "changed in place"),
        (GOOD.tolist(), GOOD, {}, TypeError, "positions are"),
        (None, GOOD, {}, TypeError, "NoneType"),
        ((np.zeros(4), np.zeros(4)), GOOD, {}, TypeError, "three float64 columns"),
        ((np.zeros(4), np.zeros(4), np.zeros(5)), GOOD, {}, ValueError, "4, 4 and 5 numbers"),
        (GOOD, GOOD, {"restitution": 1.5}, ValueError, "restitution is 1.5, expected 0 to 1"),
        (GOOD, GOOD, {"friction": -1.0}, ValueError, "friction is -1"),
        (GOOD, GOOD, {"reach": 0.0}, ValueError, "reach is 0"),
        (GOOD, GOOD, {"reach": float("nan")}, ValueError, "reach is NaN"),
        (GOOD, GOOD, {"threads": 0}, ValueError, "threads is 0"),
    ],
)
def test_bad_particles(pawn, x, v, options, error, words):
    with pytest.raises(error, match=words):
        pawn.collide(x, v, **{"reach": 0.1, **options})


def test_elements_that_are_one_do_no_harm(pawn):
    one = np.lib.stride_tricks.as_strided(np.array([1.5, 1.5, 0.5]), (70_000, 3), (0, 8))
    pawn.collide(one, one[:], reach=1.0, threads=2)
    with pytest.raises(ValueError):
        pawn.within([0, 0, 0, np.nan, 1, 1])


@pytest.mark.parametrize(
    ("solid", "place", "away", "reach"),
    [
        ("sphere(1)", [0.3, 0.3, 0.3], 0.4804, 0.5),
        ("ellipsoid(1, 1, 0.9)", [0.3, 0.3, 0.3], 0.46, 0.5),
        ("smooth_or(sphere(0.5), box([0, 0, 0], [1, 1, 1]), 0.2)", [0.059, 0.1036, 0.1433], 0.352, 0.5),
        ("box([-1, -1, -1], [1, 1, 1]).rotate([1, 1, 1], 0.7)", [0.1, 0.2, 0.3], 0.728, 0.8),
    ],
)
def test_a_way_out_within_reach_is_found(solid, place, away, reach):
    solid = rfm.load(f"rfm 1\nsolid s = {solid}")["s"]
    for longer in (reach, 1.5 * reach, 10.0, 1e100, np.inf):
        x = np.array([place])
        assert solid.collide(x, np.zeros((1, 3)), reach=longer) == (1, 0, 0), longer
        assert solid.sign(x)[0] < 0 and np.linalg.norm(x[0] - place) <= longer
        if longer == reach:
            assert np.linalg.norm(x[0] - place) < 1.1 * away
    x = np.array([place])
    assert solid.collide(x, np.zeros((1, 3)), reach=0.9 * away) == (0, 1, 0) and (x == [place]).all()


def test_a_reach_may_have_no_end():
    ball = rfm.load("rfm 1\nsolid s = sphere(1)")["s"]
    for reach in (1e100, np.inf):
        x = np.zeros((1, 3))
        assert ball.collide(x, np.zeros((1, 3)), reach=reach) == (1, 0, 0)
        assert np.linalg.norm(x) == pytest.approx(1.0, abs=1e-12)
