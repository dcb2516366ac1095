"""A study over a param: how far water climbs up a wall, by the depth behind the dam, with a plot.

    python examples/python/parameter_study.py      # writes parameter_study.png
"""

import matplotlib.pyplot as plt

import rfm

DAM = rfm.load("""rfm 1
param depth = 0.3 in 0.1 .. 0.5   "depth of the water behind the dam, m"

scene dam {
  box { min: [0, 0, 0], max: [1, 0.12, 1] }
  fluid water { shape: x <= 0.3 and z <= depth, density: 1000, spacing: 3 cm, viscosity: 0.05 Pa·s }
  gravity: [0, 0, -9.81]
  method: wcsph
  run { until: 0.6 s, save_every: 0.1 s }
  probe wall { height: [0.97, 0.06], every: 10 ms }
}
""")

for depth in (0.2, 0.3, 0.4):
    simulation = DAM.with_params(depth=depth).scene()
    simulation.advance(simulation.until)
    wall = simulation.probes["wall"]
    plt.plot(wall["time"], wall["height"], label=f"depth {depth} m")
    print(f"depth {depth} m: {len(simulation)} particles, the wall is wet up to {wall['height'].max():.2f} m")
    for finding in simulation.audit.findings:
        print("  ", finding)

plt.xlabel("t [s]")
plt.ylabel("height of the water at the wall [m]")
plt.legend()
plt.savefig("parameter_study.png")
