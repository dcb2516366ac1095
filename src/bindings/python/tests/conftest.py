"""What the tests share: files of the project, and the program `rfm`, whose answers the module must match."""

import contextlib
import os
import pathlib
import signal
import subprocess
import threading
import time

import pytest

import rfm

ROOT = pathlib.Path(__file__).resolve().parents[4]
EXAMPLES = ROOT / "examples"


@pytest.fixture(scope="session")
def pawn():
    return rfm.load(EXAMPLES / "pawn.rfm")["pawn"]


@pytest.fixture(scope="session")
def program():
    """Runs the program `rfm`. It is that of RFM_PROGRAM, or the one that Cargo makes."""
    command = [os.environ["RFM_PROGRAM"]] if "RFM_PROGRAM" in os.environ else None
    if command is None:
        cargo = ["cargo", "build", "--quiet", "--release", "--locked", "--bin", "rfm"]
        subprocess.run(cargo, cwd=ROOT, check=True)
        target = pathlib.Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
        command = [str(target / "release" / "rfm")]

    def run(*arguments, **options):
        return subprocess.run([*command, *map(str, arguments)], check=True, capture_output=True, text=True, **options)

    return run


@pytest.fixture
def interrupts():
    """Presses Ctrl-C soon, and expects an end long before the work would end, within some seconds."""

    @contextlib.contextmanager
    def pressed(within=20):
        # Python's own answer: a process that was started in the background would ignore the signal
        before = signal.signal(signal.SIGINT, signal.default_int_handler)
        timer = threading.Timer(0.4, lambda: os.kill(os.getpid(), signal.SIGINT))
        started = time.monotonic()
        try:
            timer.start()
            with pytest.raises(KeyboardInterrupt):
                yield
        finally:
            timer.cancel()
            signal.signal(signal.SIGINT, before)
        assert time.monotonic() - started < within

    return pressed
