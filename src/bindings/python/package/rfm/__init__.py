"""Obstacles for fluid simulations, written as R-functions and compiled to machine code.

>>> import numpy as np, rfm
>>> post = rfm.load("rfm 1\\nsolid post = cylinder(0.5, 1)")["post"]
>>> post(0.0, 0.0, 0.5) > 0.0
True
>>> post.omega(np.zeros((1000, 3))).shape
(1000,)

ω > 0 inside a solid, 0 on its surface and < 0 outside. Lengths are in metres, times in seconds.
"""

from ._rfm import Mesh, Program, RfmError, Simulation, Slice, Solid, __version__, load

_RECORDS = ("Audit", "Collisions", "Contact", "Diagnostic", "Entry", "Param", "Stats")

__all__ = ["Mesh", "Program", "RfmError", "Simulation", "Slice", "Solid", "__version__", "load", *_RECORDS]


def __getattr__(name):
    # imported when first asked for, because named tuples take longer to make than all the rest
    if name in _RECORDS:
        from . import _records

        return getattr(_records, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
