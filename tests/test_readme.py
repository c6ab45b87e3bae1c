"""The README's Python example runs and says what it claims."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

README = Path(__file__).parents[1] / "README.md"


def test_example_runs(tmp_path: Path) -> None:
    """Its certificate is printed, and the force is positive."""
    code = re.search(r"```python\n(.*?)```", README.read_text(encoding="utf8"), re.S)
    assert code
    done = subprocess.run([sys.executable, "-c", code[1]], capture_output=True, text=True, timeout=120, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    force, certificate = done.stdout.split(" ", 1)
    assert float(force) > 0
    assert all(float(value) < 1e-8 for value in re.findall(r"=([-0-9.e]+)", certificate))
