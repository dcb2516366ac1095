"""What Python costs beside Rust: `python src/bindings/python/tests/speed.py`, with the module installed.

Prints the best of many for what is short, and medians else; quotients are of runs that took turns. Needs Cargo for the part in Rust.
"""

import pathlib
import statistics
import subprocess
import sys
import time
import timeit

import numpy as np

import rfm

HERE = pathlib.Path(__file__).resolve()
PAWN = HERE.parents[4] / "examples" / "pawn.rfm"
COUNT, ROUNDS = 1_000_000, 7


def fresh(code, rounds=15):
    """Milliseconds that a line takes in a new process, after numpy has been imported."""
    program = f"import sys, time, numpy; t = time.perf_counter(); {code}; print((time.perf_counter() - t) * 1e3)"
    times = [float(subprocess.check_output([sys.executable, "-c", program])) for _ in range(rounds)]
    return min(times)


def call(statement, number, **names):
    """Nanoseconds of one call, the best of many: others use the processors, too."""
    return min(timeit.repeat(statement, number=number, repeat=300, globals=names)) / number * 1e9


def rust(threads):
    command = ["cargo", "run", "--release", "--quiet", "--manifest-path", HERE.parents[1] / "Cargo.toml", "--example",
               "columns", "--", PAWN, "pawn", COUNT, threads, 15]  # fmt: skip
    return [float(number) for number in subprocess.check_output([str(part) for part in command]).split()]


def main():
    pawn = rfm.load(PAWN)["pawn"]
    k = np.arange(COUNT)
    x, y, z = (3.0 * (k * step % 1009) / 1009.0 for step in (7, 31, 101))
    print(f"import rfm                {fresh('import rfm'):7.2f} ms")
    alone = "import time; t = time.perf_counter(); import rfm; print((time.perf_counter() - t) * 1e3)"
    alone = min(float(subprocess.check_output([sys.executable, "-c", alone])) for _ in range(15))
    print(f"import rfm, nothing before{alone:7.2f} ms")
    load = f"s = rfm.load({str(PAWN)!r})['pawn']; s(1.5, 1.5, 0.5)"
    print(f"load the pawn, first value{fresh('import rfm; t = time.perf_counter(); ' + load):7.2f} ms")
    for threads in (1, 2):
        ratios = {}
        for _ in range(ROUNDS):
            double, single, one = rust(threads)
            for dtype, base in (("f8", double), ("f4", single)):
                columns = [column.astype(dtype) for column in (x, y, z)]
                rows, out = np.column_stack(columns), np.empty(COUNT, dtype)
                for name, points in (("columns", columns), ("(n, 3)", [rows])):
                    ask = lambda: pawn.omega(*points, out=out, threads=threads)
                    ask()
                    times = []
                    for _ in range(15):
                        started = time.perf_counter()
                        ask()
                        times.append(time.perf_counter() - started)
                    nanoseconds = statistics.median(times) / COUNT * 1e9
                    ratios.setdefault((dtype, name), []).append((nanoseconds / base, nanoseconds, base))
        for (dtype, name), found in ratios.items():
            ratio, ours, base = (statistics.median(column) for column in zip(*found))
            print(f"{threads} threads, {dtype}, {name:8} {ours:6.2f} ns, Rust's columns {base:6.2f} ns: {ratio:5.2f} x")
    print(f"one point, Rust           {one:7.1f} ns")
    ours = call("pawn(1.5, 1.4, 0.5)", 2000, pawn=pawn)
    print(f"one point, solid(x, y, z) {ours:7.1f} ns")
    ours = call("pawn.omega(small)", 2000, pawn=pawn, small=np.array([[1.5, 1.4, 0.5]]))
    print(f"array of shape (1, 3)     {ours:7.1f} ns")


if __name__ == "__main__":
    main()
