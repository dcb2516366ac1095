"""Simulations: those of the program `rfm`, step by step, saved, resumed and interrupted."""

import gc
import json
import os
import threading
import time

import numpy as np
import pytest

import rfm
from conftest import EXAMPLES

TANK = """rfm 1
solid post = box([0.45, -1, -1], [0.55, 1, 2])
scene tank {
  box { min: [0, 0, 0], max: [1, 0.4, 0.6] }
  fluid water { shape: x <= 0.3 and z <= 0.3, density: 1000, spacing: 4 cm, viscosity: 0.05 Pa·s }
  obstacle { solid: post }
  gravity: [0, 0, -9.81]
  method: wcsph
  run { until: 0.5 s, save_every: 0.02 s }
  probe gauge { height: [0.15, 0.2], every: 10 ms }
  probe push { force: post, every: 20 ms }
  probe joules { energy: water, every: 50 ms }
}
"""


@pytest.fixture
def drop():
    return rfm.load(EXAMPLES / "pawn.rfm", particles=500).scene("drop")


def test_steps_are_those_of_the_program(program, tmp_path, drop):
    program("run", EXAMPLES / "pawn.rfm", "-D", "particles=500", "--steps", "60", "--no-frames", "-o", tmp_path)
    drop.step(60)
    assert drop.steps == 60
    ours = open(drop.save(tmp_path / "ours"), "rb").read()
    theirs = rfm.load(EXAMPLES / "pawn.rfm", particles=500).scene(threads=1)
    theirs.resume(tmp_path)
    assert theirs.steps == 60 and theirs.time == drop.time
    assert np.array_equal(theirs.positions, drop.positions) and np.array_equal(theirs.velocities, drop.velocities)
    assert np.array_equal(theirs.density, drop.density) and np.array_equal(theirs.pressure, drop.pressure)
    assert len(ours) > 500 * 8 * 6
    # and the program goes on from ours
    program("run", EXAMPLES / "pawn.rfm", "-D", "particles=500", "--steps", "70", "--no-frames", "--resume",
            "-o", tmp_path / "ours")
    summary = json.loads((tmp_path / "ours" / "summary.json").read_text())
    assert summary["steps"] == 70 and summary["finished"]


def test_particles_are_copies_in_the_order_of_their_making(drop):
    assert len(drop) == 500 and drop.name == "drop" and drop.time == 0.0 and drop.until == 5.0
    before = drop.positions
    assert before.shape == drop.velocities.shape == (500, 3) and before.dtype == np.float64
    assert drop.density.shape == drop.pressure.shape == (500,)
    drop.step(20)
    after = drop.positions
    assert not np.array_equal(before, after)
    # a row stays the same particle: none has moved farther than its speed allows
    assert np.linalg.norm(after - before, axis=1).max() < 1.2 * drop.audit.max_speed * drop.time + 1e-3
    after[:] = 0.0
    assert drop.positions.max() > 0.0
    stats = drop.stats
    assert stats.particles == 500 and (stats.inside, stats.lost, stats.non_finite) == (0, 0, 0)
    kinetic = 0.5 * drop.particle_mass * (drop.velocities**2).sum()
    assert stats.kinetic_energy == pytest.approx(kinetic) and drop.bounds.tolist() == [[0, 0, 0], [3, 3, 3]]


def test_the_surface_is_that_of_the_program(program, tmp_path, drop):
    drop.step(30)
    mesh = drop.surface()
    assert mesh.closed and len(mesh.triangles) > 100 and mesh.thin_cells == 0 and np.isnan(mesh.max_distance)
    fluid = len(drop) * drop.spacing**3
    assert 0.8 * fluid < mesh.volume < 1.3 * fluid and mesh.area > 0.0
    program("run", EXAMPLES / "pawn.rfm", "-D", "particles=500", "--steps", "30", "-o", tmp_path / "out")
    program("mesh", tmp_path / "out", "--fluid", "--format", "ply", "-o", tmp_path / "surfaces")
    written = sorted((tmp_path / "surfaces").glob("*.ply"))[-1]
    head = open(written, "rb").read(400).decode("latin1")
    # frames have single precision, so that a vertex may come or go
    count = int(head.split("element vertex ")[1].split()[0])
    assert abs(count - len(mesh.vertices)) <= 0.02 * count
    assert len(drop.surface(cell=0.5 * drop.spacing).triangles) < len(mesh.triangles) / 2
    mesh.save(tmp_path / "fluid.stl")
    assert (tmp_path / "fluid.stl").stat().st_size == 84 + 50 * len(mesh.triangles)
    with pytest.raises(rfm.RfmError, match="lengths above 0"):
        drop.surface(cell=-1.0)
    with pytest.raises(rfm.RfmError, match="too small for these particles"):
        drop.surface(cell=1e-5)


def test_the_surface_of_a_fluid_ends_at_walls():
    tank = rfm.load(TANK).scene()
    vertices = tank.surface().vertices
    assert vertices[:, 0].min() == 0.0 and vertices[:, 2].min() == 0.0 and vertices[:, 1].max() == 0.4
    assert vertices[:, 0].max() == pytest.approx(0.3, abs=0.02)


def test_views_show_the_state_and_hold_it(drop):
    drop.step(5)
    views = drop.views()
    order = np.argsort(views["id"])
    assert np.array_equal(np.column_stack([views[k] for k in "xyz"])[order], drop.positions)
    assert np.array_equal(np.column_stack([views[k] for k in "uvw"])[order], drop.velocities)
    assert np.array_equal(views["density"][order], drop.density)
    with pytest.raises(ValueError):
        views["x"][0] = 1.0
    for change in (drop.step, lambda: drop.advance(1.0)):
        with pytest.raises(BufferError, match="views of the particles"):
            change()
    part = views["x"][::2]
    del views
    gc.collect()
    with pytest.raises(BufferError):
        drop.step()
    pawn = drop.program["pawn"]
    assert (pawn.omega(part, part, part) < 1).all()
    del part
    gc.collect()
    drop.step()
    # arrays outlive the name of their simulation
    kept = rfm.load(EXAMPLES / "pawn.rfm", particles=200).scene().views()["z"]
    gc.collect()
    assert 1.0 < kept.mean() < 3.0


def test_a_run_ends_at_its_time_and_samples_its_probes(capsys):
    tank = rfm.load(TANK).scene()
    tank.advance(0.1, progress=True)
    assert tank.time == pytest.approx(0.1, rel=1e-12)
    shown = capsys.readouterr().err
    assert "100 %" in shown and shown.endswith("\n")
    assert set(tank.probes) == {"gauge", "push", "joules"} and tank.probe_units["push"]["force x"] == "N"
    gauge = tank.probes["gauge"]
    assert len(gauge["time"]) == len(gauge["height"]) and 10 <= len(gauge["time"]) <= 11 and gauge["time"][0] == 0.0
    assert 0.1 < gauge["height"].min() and gauge["height"].max() < 0.45
    assert list(tank.probes["joules"]) == ["time", "kinetic", "potential", "elastic", "total"]
    audit = tank.audit
    assert audit.unjudged is None and audit.energy_excess < 0.05 and 0.1 < audit.max_speed < 4.0
    assert isinstance(audit.findings, tuple)
    tank.advance(0.05)  # that time has passed
    assert tank.time == pytest.approx(0.1, rel=1e-12)


def test_a_resumed_run_has_the_bits_of_one_that_never_stopped(tmp_path):
    program = rfm.load(TANK)
    straight, first = program.scene(), program.scene(threads=1)
    straight.step(60)
    first.step(25)
    path = first.save(tmp_path)
    assert path == tmp_path / "checkpoints" / "step_0000000025.checkpoint"
    second = program.scene()
    second.resume(tmp_path)
    assert second.steps == 25
    second.step(35)
    assert np.array_equal(second.positions, straight.positions) and second.time == straight.time
    assert np.array_equal(second.density, straight.density)
    samples = second.probes["push"]
    same = np.isin(straight.probes["push"]["time"], samples["time"])
    assert same.any() and np.array_equal(straight.probes["push"]["force x"][same], samples["force x"])
    from_file = program.scene()
    from_file.resume(path)
    assert from_file.steps == 25


def test_states_that_do_not_fit_are_refused(drop, tmp_path):
    with pytest.raises(rfm.RfmError, match="no state"):
        drop.resume(tmp_path)
    with pytest.raises(FileNotFoundError):
        drop.resume(tmp_path / "none")
    path = drop.save(tmp_path)
    with pytest.raises(rfm.RfmError, match="another scene"):
        rfm.load(EXAMPLES / "pawn.rfm", particles=400).scene().resume(tmp_path)
    damaged = bytearray(open(path, "rb").read())
    damaged[200] ^= 1
    (tmp_path / "damaged").write_bytes(damaged)
    with pytest.raises(rfm.RfmError, match="damaged"):
        drop.resume(tmp_path / "damaged")
    drop.step()


def test_a_particle_has_the_mass_of_its_part_of_the_fluid():
    text = """rfm 1
    scene s {
      box { max: [0.63, 0.41, 0.5] }
      fluid water { shape: box([0, 0, 0], [0.63, 0.41, 0.29]), density: 1000, spacing: 5.3 cm }
      run { until: 1 s }
    }"""
    pool = rfm.load(text).scene()
    assert len(pool) * pool.particle_mass == pytest.approx(1000 * 0.63 * 0.41 * 0.29, rel=1e-3)
    assert pool.spacing == pytest.approx((pool.particle_mass / 1000) ** (1 / 3))


def test_another_thread_sees_how_far_a_simulation_is(drop):
    seen, steps = [], threading.Thread(target=drop.step, args=(200,))
    steps.start()
    while steps.is_alive():
        seen.append((drop.time, drop.steps, len(drop), repr(drop)))
    steps.join()
    assert drop.steps == 200 and [s for _, s, _, _ in seen] == sorted(s for _, s, _, _ in seen)
    assert all(0 <= time <= drop.time and count == len(drop) for time, _, count, _ in seen)


def test_bad_goals(drop):
    for until in (np.nan, np.inf):
        with pytest.raises(ValueError, match="until"):
            drop.advance(until)
    for count in (-1, 1.5, "ten"):
        with pytest.raises((TypeError, ValueError)):
            drop.step(count)
    drop.step(0)
    drop.advance(-1.0)
    assert drop.steps == 0
    with pytest.raises(rfm.RfmError):
        rfm.load(EXAMPLES / "pawn.rfm", particles=0)


def test_obstacles_that_the_particles_do_not_fit_are_told():
    text = """rfm 1
        scene s { box { max: [1, 1, 1] }, fluid { shape: z <= 0.3, spacing: 0.06 }
          obstacle { solid: box([0.4, 0, 0], [0.41, 1, 0.5]) }, obstacle { solid: ball([0.5, 0.5, 3], 0.2) } }"""
    codes = {found.code for found in rfm.load(text).scene().warnings}
    assert {"W0508", "W0519"} <= codes


def test_an_end_by_numbers_is_an_error_and_final():
    # far too stiff for its step
    text = (EXAMPLES / "pawn.rfm").read_text().replace("stiffness: 3 J/kg", "stiffness: 3000000 J/kg")
    simulation = rfm.load(text.replace("until: 5 s,", "until: 5 s, dt: 50 ms,"), particles=300).scene()
    assert any(found.severity == "warning" for found in simulation.warnings)
    with pytest.raises(rfm.RfmError) as ended:
        simulation.step(1000)
    for again in (simulation.step, lambda: simulation.advance(1.0), lambda: simulation.save("nowhere")):
        with pytest.raises(rfm.RfmError, match="the simulation has ended"):
            again()
    assert str(ended.value) and not os.path.exists("nowhere")


def test_ctrl_c_ends_between_two_steps(drop, interrupts):
    with interrupts():
        drop.step(10**9)
    steps = drop.steps
    assert steps > 0
    drop.step()
    assert drop.steps == steps + 1


def test_another_thread_is_told_that_steps_are_being_taken(drop):
    stepping = threading.Thread(target=drop.step, args=(400,))
    stepping.start()
    refused = 0
    while stepping.is_alive():
        try:
            drop.positions
        except RuntimeError as error:
            assert "another thread" in str(error)
            refused += 1
        time.sleep(0.001)
    stepping.join()
    assert refused > 0 and drop.steps == 400
