"""A particle loop of your own around a compiled obstacle, as in examples/embed.rs.

    python examples/python/particle_loop.py
"""

from pathlib import Path

import numpy as np

import rfm

pawn = rfm.load(Path(__file__).parents[1] / "pawn.rfm", cx=1.25)["pawn"]

k = np.arange(1000)
x = np.column_stack([0.75 + k % 10 / 10, 1.0 + k // 10 % 10 / 10, 1.6 + k // 100 / 10])
v = np.zeros_like(x)
dt, hits = 0.001, 0
for _ in range(1000):
    v[:, 2] -= 9.81 * dt
    ahead = x + dt * v
    ahead[:, 2] = ahead[:, 2].clip(min=0.0)
    inside = np.flatnonzero(pawn.omega(ahead) > 0.0)
    x = ahead
    if len(inside):
        hits += len(inside)
        distance, normal, _ = pawn.contact(x[inside])
        approach = np.einsum("ij,ij->i", v[inside], normal).clip(max=0.0)
        v[inside] -= 1.5 * approach[:, None] * normal  # half of the normal speed returns
        while len(inside):
            distance, normal, _ = pawn.contact(x[inside])  # negative inside
            x[inside] += (1e-9 - distance)[:, None] * normal
            inside = inside[pawn.omega(x[inside]) > 0.0]

print(f"{hits} hits, {(pawn.omega(x) > 0.0).sum()} of 1000 particles inside the pawn")
