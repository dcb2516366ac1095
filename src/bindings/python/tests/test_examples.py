"""The examples for Python run, and print what they should."""

import os
import subprocess
import sys

import pytest

from conftest import EXAMPLES

NEEDS = {"parameter_study.py": ["matplotlib"], "optimise.py": ["scipy"], "pictures.py": ["pyvista"]}


@pytest.mark.parametrize("path", sorted((EXAMPLES / "python").glob("*.py")), ids=lambda path: path.name)
def test_example(path, tmp_path):
    for package in NEEDS.get(path.name, []):
        pytest.importorskip(package)
    environment = {**os.environ, "MPLBACKEND": "agg"}
    run = subprocess.run([sys.executable, path], cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    assert run.stdout
    if path.name == "particle_loop.py":
        assert "0 of 1000 particles inside the pawn" in run.stdout


def test_the_lines_of_the_readme(tmp_path):
    for readme in (EXAMPLES.parent / "README.md", EXAMPLES.parent / "src/bindings/python/README.md"):
        blocks = readme.read_text().split("```python\n")[1:]
        assert blocks, readme
        for block in blocks:
            code = block.split("```")[0]
            run = subprocess.run([sys.executable, "-c", code], cwd=EXAMPLES.parent, capture_output=True, text=True)
            assert run.returncode == 0, run.stderr
