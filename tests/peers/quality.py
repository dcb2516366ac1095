"""What a flow is worth, from the places and velocities of its particles alone, so that solvers are told by one measure.

Densities: Σ V W with Wendland's kernel C2 and a support of three spacings, over its sum on a cubic lattice. Walls of the box
mirror the particles, which continues the lattice that a fluid at rest has half a spacing from them. It is the kernel of none of
the solvers but rfm's `wcsph`, and looks at more neighbours than those that a solver keeps even.
"""

import numpy as np
from scipy.spatial import cKDTree

SUPPORT = 3.0  # spacings
LAYER = 0.05  # of the column's height: a thinner layer is not the front


def kernel(q):
    """Wendland C2 but for its factor, which the lattice takes away."""
    return np.where(q < 1, (1 - q) ** 4 * (1 + 4 * q), 0.0)


def mirrored(places, box, reach):
    """The particles within `reach` of a wall, mirrored at it: also at edges and corners, one axis after the other."""
    cloud = places
    for axis in range(3):
        below = cloud[cloud[:, axis] < reach].copy()
        below[:, axis] *= -1
        above = cloud[cloud[:, axis] > box - reach].copy()
        above[:, axis] = 2 * box - above[:, axis]
        cloud = np.concatenate([cloud, below, above])
    return cloud


def excess(places, spacing, box):
    """How far the density of each particle is above that at rest, as a part of it; below zero at surfaces."""
    reach = SUPPORT * spacing
    n = np.arange(-3, 4)
    lattice = np.stack(np.meshgrid(n, n, n), -1).reshape(-1, 3)
    full = kernel(np.linalg.norm(lattice, axis=1) / SUPPORT).sum()
    inside = np.clip(places, 0, box)
    tree = cKDTree(mirrored(inside, box, reach))
    found = np.empty(len(inside))
    for first in range(0, len(inside), 20_000):
        chunk = inside[first : first + 20_000]
        near = cKDTree(chunk).sparse_distance_matrix(tree, reach, output_type="coo_matrix")
        weights = kernel(near.data / reach)
        found[first : first + 20_000] = np.bincount(near.row, weights, len(chunk))
    return found / full - 1


def front(places, spacing, column):
    """Where the layer on the floor becomes thinner than a part of the column's height, m."""
    width = column[1]
    bins = np.bincount((places[:, 0] / spacing).astype(int).clip(0))
    thickness = bins * spacing**3 / (spacing * width)
    thick = np.flatnonzero(thickness >= LAYER * column[2])
    return (thick[-1] + 1) * spacing if len(thick) else 0.0


def energy(places, velocities, gravity):
    """Of motion and height, J/kg."""
    return float((0.5 * (velocities**2).sum(1)).mean() + gravity * places[:, 2].mean())


def of(instants, spacing, box, column, gravity):
    """The figures of all instants, of (time, places, velocities) each. The median is that of the depth of the fluid."""
    rows = []
    for time, places, velocities in instants:
        excesses = excess(places, spacing, box)
        above = np.maximum(excesses, 0)
        rows.append(
            {
                "time": time,
                "median": float(np.median(excesses)),
                "mean": float(above.mean()),
                "p99": float(np.quantile(above, 0.99)),
                "most": float(above.max()),
                "front": float(front(places, spacing, column)),
                "energy": energy(places, velocities, gravity),
                "outside": int(((places < -0.5 * spacing) | (places > box + 0.5 * spacing)).any(1).sum()),
            }
        )
    return rows
