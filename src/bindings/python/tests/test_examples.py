"""The examples for Python run, and print what they should."""

import json
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


def test_the_cells_of_the_notebook(tmp_path):
    for package in ("matplotlib", "scipy", "pyvista"):
        pytest.importorskip(package)
    notebook = json.loads((EXAMPLES / "python" / "notebook.ipynb").read_text())
    assert all(not cell["outputs"] and cell["execution_count"] is None for cell in code(notebook)), "clear its outputs"
    cells = ["".join(cell["source"]) for cell in code(notebook)]
    assert len(cells) >= 6
    # as Jupyter does: the value of a last line is shown
    program = """
import ast, json, sys
names = {}
for cell in json.load(sys.stdin):
    tree = ast.parse(cell)
    last = tree.body.pop() if isinstance(tree.body[-1], ast.Expr) else None
    exec(compile(tree, "cell", "exec"), names)
    if last is not None:
        value = eval(compile(ast.Expression(last.value), "cell", "eval"), names)
        show = getattr(value, "_repr_html_", value.__repr__)
        print(show())
"""
    environment = {**os.environ, "MPLBACKEND": "agg"}
    options = {"cwd": tmp_path, "env": environment, "capture_output": True, "text": True}
    run = subprocess.run([sys.executable, "-c", program], input=json.dumps(cells), **options)
    assert run.returncode == 0, run.stderr
    assert "0 of 2000 particles inside" in run.stdout and run.stdout.count("<iframe") == 2


def code(notebook):
    return [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]


def test_the_lines_of_the_readme(tmp_path):
    for readme in (EXAMPLES.parent / "README.md", EXAMPLES.parent / "src/bindings/python/README.md"):
        blocks = readme.read_text().split("```python\n")[1:]
        assert blocks, readme
        for block in blocks:
            code = block.split("```")[0]
            run = subprocess.run([sys.executable, "-c", code], cwd=EXAMPLES.parent, capture_output=True, text=True)
            assert run.returncode == 0, run.stderr
