"""Ctrl-C in calls that take long: they end soon, and the next ones work."""

import numpy as np

import rfm

# a thousand posts, of which each path and point has to see those that are near
POSTS = "rfm 1\nsolid posts = any i in 0..1000: cylinder(0.01, 1).move([random(1, i), random(2, i), 0])"


def test_a_mesh_is_left_unfinished(pawn, interrupts):
    with interrupts():
        pawn.mesh(2000)
    assert pawn.mesh(24).closed
    with interrupts():
        pawn.volume(2000)
    assert pawn.volume(24) > 0.0


def test_many_points_are_left_unfinished(interrupts):
    posts = rfm.load(POSTS)["posts"]
    points = np.random.default_rng(1).uniform(0.0, 1.0, (2_000_000, 3))
    for threads in (1, 2):
        with interrupts():
            while True:
                posts.contact(points, threads=threads)
        with interrupts():
            while True:
                posts.first_entry(points, points[::-1], threads=threads)
    few = posts.contact(points[:100]).distance
    assert np.array_equal(few, [posts.contact(point).distance for point in points[:100]])


def test_a_collision_is_done_whole_or_not_at_all(interrupts):
    posts = rfm.load(POSTS)["posts"]
    before = np.random.default_rng(1).uniform(0.0, 1.0, (1_000_000, 3))
    v = np.zeros_like(before)
    after = before.copy()
    posts.collide(after, v, reach=1.0)
    assert not np.array_equal(before, after)
    x = before.copy()
    with interrupts():
        while True:
            x[:] = before
            posts.collide(x, v, reach=1.0)
    assert np.array_equal(x, before) or np.array_equal(x, after)


def test_a_slice_is_left_unfinished(interrupts):
    posts = rfm.load(POSTS)["posts"]
    with interrupts(5):
        while True:
            posts.slice(z=0.5, samples=8192, window=(-10, -10, 11, 11))
    whole = posts.slice(z=0.5, samples=50)
    with interrupts(5):
        while True:
            whole.svg()
    assert whole.omega.shape == (50, 50) and (whole.omega > 0).any()


def test_the_start_of_a_scene_is_left_unfinished(pawn, interrupts):
    with interrupts(5):
        while True:
            pawn.program.with_params(particles=800_000).scene()
