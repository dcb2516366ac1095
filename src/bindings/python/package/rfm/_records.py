"""What functions return besides arrays: tuples whose parts have names."""

from collections import namedtuple

Diagnostic = namedtuple(
    "Diagnostic", ["severity", "code", "message", "file", "line", "column", "end_line", "end_column", "help"]
)
Diagnostic.__module__ = "rfm"
Diagnostic.__doc__ = """A message of the compiler.

``severity`` is "error" or "warning"; lines and columns count from 1, columns in characters; ``help`` says what
would be accepted, or is None. ``rfm explain CODE`` has more about a code.
"""

Param = namedtuple("Param", ["value", "low", "high", "doc", "unit"])
Param.__module__ = "rfm"
Param.__doc__ = """A param: its value, the range that the file states (or None), and the text behind it (or None).

Numbers are in SI units; ``unit`` is the one in which the file writes the value, such as ``"mm"``, or None.
"""

Contact = namedtuple("Contact", ["distance", "normal", "curvature"])
Contact.__module__ = "rfm"
Contact.__doc__ = """The surface as seen from points of shape (...).

``distance`` (...), m, is positive outside; ``normal`` (..., 3) is the outward unit normal; ``curvature`` (...), 1/m,
is the mean curvature, positive where the solid is convex.
"""

Entry = namedtuple("Entry", ["part", "point", "normal", "certain"])
Entry.__module__ = "rfm"
Entry.__doc__ = """Where paths first meet a solid.

``part`` (...) is the part of the path before the entry, 0 to 1, or NaN if there is none; ``point`` (..., 3), m;
``normal`` (..., 3) is the outward unit normal; ``certain`` (...) is False where a path may only graze the surface.
"""

Collisions = namedtuple("Collisions", ["hits", "stuck", "undefined"])
Collisions.__module__ = "rfm"
Collisions.__doc__ = """What became of particles.

``hits`` were inside, or on the surface, and have been put back; ``stuck`` are inside without a way out within reach;
``undefined`` are not finite, or ω has no value there. The last two stay as they are.
"""

Audit = namedtuple(
    "Audit",
    [
        "energy_excess",
        "unjudged",
        "wall_work",
        "volume_change",
        "compression_mean",
        "compression_p99",
        "compression_max",
        "crowded",
        "max_speed",
        "findings",
    ],
)
Audit.__module__ = "rfm"
Audit.__doc__ = """What a simulation has shown since its start; the worst figures, as parts, and speeds in m/s.

``energy_excess`` is None if the energy is not judged; ``unjudged`` then says why. ``wall_work`` is the
work of walls that move on the fluid, in J, None if the energy is not judged; with ``gradients:
differences`` it is known to a tenth. ``crowded`` is the part of the particles, beyond that at the start, that
were closer to another one than half a spacing. ``findings`` are sentences about what a user must know.
"""

Stats = namedtuple(
    "Stats",
    [
        "particles",
        "kinetic_energy",
        "potential_energy",
        "momentum",
        "max_speed",
        "max_density_error",
        "inside",
        "lost",
        "non_finite",
    ],
)
Stats.__module__ = "rfm"
Stats.__doc__ = """Figures of a state: energies in J, momentum in kg·m/s, the largest speed in m/s.

``max_density_error`` is the largest compression (ρ − ρ₀)/ρ₀. ``inside``, ``lost`` and ``non_finite`` count particles
in obstacles, outside the box, and without finite values.
"""
