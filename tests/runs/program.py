"""The installed command in a process of its own."""

import subprocess
import sys
from pathlib import Path

PROGRAM = Path(sys.executable).with_name("signorini")


def program(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    """Run it to its end."""
    return subprocess.run([PROGRAM, *arguments], capture_output=True, text=True, timeout=120, check=False)
