"""scipy.optimize over a param: the radius with which a bowl with a hole holds one litre.

    python examples/python/optimise.py
"""

from scipy.optimize import brentq

import rfm

BOWL = rfm.load("""rfm 1
param r = 0.1 in 0.01 .. 1   "radius of the bowl, m"

solid content = sphere(r) and z <= 0 \\ cylinder(0.2*r, 2*r).move([0, 0, -r])
""")


def volume(r):
    return BOWL.with_params(r=r)["content"].volume(cells=48)


r = brentq(lambda r: volume(r) - 1e-3, 0.02, 0.5, xtol=1e-6)
print(f"r = {1e3 * r:.2f} mm holds {1e3 * volume(r):.4f} litres")
