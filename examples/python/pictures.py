"""Pictures: a slice as SVG, and the pawn with its drop in pyvista.

    python examples/python/pictures.py             # writes pawn.svg and pawn.vtp; `--show` opens a window
"""

import sys
from pathlib import Path

import pyvista

import rfm

program = rfm.load(Path(__file__).parents[1] / "pawn.rfm", particles=2000)
program["pawn"].slice(y=1.5).save("pawn.svg")

pawn = program["pawn"].mesh(cells=48).to_pyvista()
pawn.save("pawn.vtp")
simulation = program.scene("drop")
simulation.advance(0.3, progress=True)
drop = pyvista.PolyData(simulation.positions)
drop["speed"] = (simulation.velocities**2).sum(axis=1) ** 0.5
print(f"{pawn.n_cells} triangles, {drop.n_points} particles up to {drop['speed'].max():.1f} m/s")

if "--show" in sys.argv:
    plotter = pyvista.Plotter()
    plotter.add_mesh(pawn, color="white", smooth_shading=True)
    plotter.add_mesh(drop, scalars="speed", point_size=6, render_points_as_spheres=True)
    plotter.show()
