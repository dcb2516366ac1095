"""A solid of rfm as an obstacle in LAMMPS: particles that enter it are put back to its surface and reflected."""

import os
import time
import traceback


class Obstacle:
    """Acts on the particles of each rank after the forces of every step.

    The input script must have ``fix ID all external pf/callback 1 1``; ``fix`` is its ID. The counts and the time that the
    obstacle took are those of this rank.
    """

    def __init__(self, lammps, solid, *, reach, restitution=0.0, friction=0.0, fix="obstacle"):
        self.lammps, self.solid = lammps, solid
        self.answer = {"reach": reach, "restitution": restitution, "friction": friction, "threads": 1}
        self.calls = self.hits = self.stuck = self.undefined = 0
        self.seconds = 0.0
        lammps.set_fix_external_callback(fix, self._act, None)

    def _act(self, _, step, count, tags, positions, forces):
        try:
            started = time.perf_counter()
            velocities = self.lammps.numpy.extract_atom("v")[:count]
            found = self.at_step(step).collide(positions, velocities, **self.answer)
            self.hits += found.hits
            self.stuck += found.stuck
            self.undefined += found.undefined
            self.calls += 1
            self.seconds += time.perf_counter() - started
        except BaseException:
            # C cannot pass an exception on, and the other ranks would wait for this one for ever
            traceback.print_exc()
            os._exit(1)

    def now(self):
        """The solid at the time of the last step."""
        return self.at_step(self.lammps.extract_global("ntimestep"))

    def at_step(self, step):
        """The solid at the time of a step."""
        if not self.solid.moves:
            return self.solid
        begin, since, dt = (self.lammps.extract_global(name) for name in ("atime", "atimestep", "dt"))
        return self.solid.at(begin + (step - since) * dt)
