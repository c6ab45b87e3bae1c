"""The commands that read records: `show`, `compare` and `plot`."""

from __future__ import annotations

import argparse
from pathlib import Path


def command(arguments: argparse.Namespace) -> int:
    """Carry out the command; 1 where two records differ."""
    if arguments.command == "show":
        from contact.record import show

        print(show(arguments.record, steps=arguments.steps, contact=arguments.contact, as_json=arguments.json))
        return 0
    if arguments.command == "plot":
        from runs.plot import plot_record

        target = arguments.output or Path(arguments.record).with_suffix(".png")
        plot_record(arguments.record, target, arguments.step)
        print(target)
        return 0
    from contact.record import compare

    difference = compare(arguments.records[0], arguments.records[1], arguments.tolerance)
    print(difference or "equal")
    return 0 if difference is None else 1
