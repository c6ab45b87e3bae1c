"""The command line: ``signorini``. Only what a command needs is imported, after its arguments are read."""

from __future__ import annotations

import argparse
import os
import signal
import sys
import traceback
from collections.abc import Sequence
from importlib.metadata import version

UNKNOWN_TYPE = 86  # PETSc's error for an option that names no solver

DONE, OUTSIDE, BAD_INPUT, NOT_CONVERGED = 0, 1, 2, 3
UNHEARD = 141  # as shells tell of a program whose reader has gone

METHODS = ("status", "gauss-seidel", "lemke", "kkt", "vi-rsls", "vi-ssls", "tao", "vi-primal")


class Parser(argparse.ArgumentParser):
    """Reports a wrong argument in one line."""

    def error(self, message: str) -> None:  # type: ignore[override]
        """Exit with code 2."""
        self.exit(BAD_INPUT, f"{self.prog}: {message}\n")


def parser() -> Parser:
    """All commands and their arguments."""
    main = Parser(
        prog="signorini",
        description="Contact between devices, vessel walls and tissue. What follows a lone -- goes to PETSc.",
        epilog="exit codes: 0 done, 1 outside a tolerance, 2 bad input, 3 not converged or infeasible",
    )
    main.add_argument("--version", action="version", version=f"signorini {version('signorini')}")
    commands = main.add_subparsers(dest="command", required=True, parser_class=Parser, metavar="COMMAND")

    def add(name: str, does: str) -> Parser:
        return commands.add_parser(name, help=does, description=f"{does[0].upper()}{does[1:]}.")

    run = add("run", "run a scene and keep it in a record")
    _add_scene(run)
    run.add_argument("-o", dest="output", metavar="FILE", help="the record (default: SCENE.vtkhdf)")
    run.add_argument("--resume", metavar="FILE", help="go on with this record")
    _add_method(run)
    run.add_argument("--plot", metavar="FILE.png", help="a picture of the last step")

    _add_scene(add("explain", "say what a scene builds and what it leaves out"))

    validate = add("validate", "solve problems with known answers")
    validate.add_argument("cases", nargs="*", metavar="CASE", help="of those that --list names (default: all)")
    validate.add_argument("--list", action="store_true", help="the cases and their parameters")
    _add_changes(validate, "change a parameter of the cases")
    resolution = validate.add_mutually_exclusive_group()
    resolution.add_argument("--h", type=float, metavar="H", help="mesh size [m]")
    resolution.add_argument("--n", type=int, metavar="N", help="points a side")
    validate.add_argument("--order", type=int, choices=(1, 2), metavar="P", help="of the elements, 1 or 2")
    _add_method(validate)
    validate.add_argument("--json", action="store_true", help="one JSON object per case and level")
    validate.add_argument("-o", dest="output", metavar="DIR", help="keep the JSON lines in DIR/validate.jsonl")

    study = add("study", "measure error against run time: a table, pictures and a page")
    study.add_argument("cases", nargs="+", metavar="CASE", help="of those that validate --list names")
    study.add_argument("--methods", metavar="M,…", help=f"of {', '.join(METHODS)} (default: all but kkt)")
    study.add_argument("--levels", type=int, default=5, metavar="K", help="mesh sizes a case, at most (default: 5)")
    study.add_argument("--jobs", type=int, default=1, metavar="J", help="processes at a time (default: 1)")
    study.add_argument("--repeat", type=int, default=3, metavar="R", help="timed runs each, at most (default: 3)")
    study.add_argument("--seed", type=int, default=0, metavar="S", help="of the order of the runs (default: 0)")
    study.add_argument("--limit", type=float, default=30.0, metavar="T", help="CPU seconds of one run (default: 30)")
    study.add_argument(
        "--record",
        type=float,
        default=10.0,
        metavar="T",
        help="CPU seconds of each scene whose contact problems are recorded; 0: none (default: 10)",
    )
    _add_changes(study, "change a parameter of the cases")
    study.add_argument("-o", dest="output", default="study", metavar="DIR", help="a study's folder (default: study)")
    study.add_argument("--json", action="store_true", help="print the tables")

    stability = add("stability", "solve the stiff and extreme set, and random trials")
    stability.add_argument("sweeps", nargs="*", metavar="SWEEP", help="some of the set, without trials")
    stability.add_argument("--list", action="store_true", help="the sweeps and what each sweeps over")
    stability.add_argument("--seed", type=int, default=2007, metavar="S", help="of the trials (default: 2007)")
    stability.add_argument("--trials", type=int, metavar="N", help="random contact problems (default: 10000)")
    stability.add_argument("--jobs", type=int, default=1, metavar="J", help="processes at a time (default: 1)")
    stability.add_argument("--json", action="store_true", help="print everything as one JSON object")
    stability.add_argument("-o", dest="output", metavar="DIR", help="keep the JSON, a page and its pictures in DIR")

    show = add("show", "say what a record holds")
    _add_record(show)
    show.add_argument("--steps", action="store_true", help="a row for each step")
    show.add_argument("--contact", type=int, metavar="STEP", help="a row for each contact point of a step, from 0")
    show.add_argument("--json", action="store_true", help="as one JSON object")

    plot = add("plot", "draw a step of a record, or an animation of devices")
    _add_record(plot)
    plot.add_argument("-o", dest="output", metavar="PICTURE", help="default: FILE.png; of devices also *.gif, *.mp4")
    plot.add_argument("--step", type=int, default=-1, metavar="N", help="from 0, or from the end if negative")

    compare = add("compare", "name the first dataset in which two records differ")
    compare.add_argument("records", nargs=2, metavar="FILE", help="a record")
    compare.add_argument("--tolerance", type=float, default=0.0, metavar="T", help="relative difference to pass over")
    return main


def _add_scene(command: Parser) -> None:
    command.add_argument("scene", metavar="SCENE.toml", help="the scene")
    _add_changes(command, "change a key of the scene, such as body.0.material.E")


def _add_changes(command: Parser, what: str) -> None:
    command.add_argument(
        "--set", dest="changes", action="append", default=[], metavar="KEY=VALUE", help=f"{what}; may be repeated"
    )


def _add_method(command: Parser) -> None:
    command.add_argument("--method", choices=METHODS, metavar="M", help=f"of contact: {', '.join(METHODS)}")


def _add_record(command: Parser) -> None:
    command.add_argument("record", metavar="FILE", help="the record of a run")


def main(argv: Sequence[str] | None = None) -> int:
    """Run a command; the exit code of `design`: 0 done, 1 outside a tolerance, 2 bad input, 3 not converged."""
    words = list(sys.argv[1:] if argv is None else argv)
    # argparse alone gets `--` wrong beside optional positionals, so the split comes first.
    cut = words.index("--") if "--" in words else len(words)
    arguments, petsc_options = parser().parse_args(words[:cut]), words[cut + 1 :]
    try:
        code = _dispatch(arguments, petsc_options)
        sys.stdout.flush()
        return code
    except BrokenPipeError:
        # Whoever read what is printed has gone; the interpreter is not to try again when it ends.
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        return UNHEARD
    except (ValueError, ImportError, OSError) as error:
        return _say(error, BAD_INPUT)
    except RuntimeError as error:
        # The solvers' own errors and PETSc's are RuntimeErrors.
        return _say(error, BAD_INPUT if getattr(error, "ierr", 0) == UNKNOWN_TYPE else NOT_CONVERGED)
    except Exception:
        _abort_others()
        raise


def _dispatch(arguments: argparse.Namespace, petsc_options: list[str]) -> int:
    if arguments.command in ("show", "compare", "plot"):
        from runs import records

        return records.command(arguments)
    from fem import petsc

    petsc.initialise(petsc_options)
    signal.signal(signal.SIGPIPE, signal.SIG_IGN)  # an exception, as Python has it, and no report of PETSc's
    if arguments.command == "validate":
        from runs import validate

        return validate.command(arguments)
    if arguments.command == "study":
        from runs import study

        return study.command(arguments, petsc_options)
    if arguments.command == "stability":
        from runs import stability

        return stability.command(arguments)
    from runs import scenes

    return scenes.command(arguments, petsc_options)


def _abort_others() -> None:
    """End the other ranks, which would wait for this one for ever."""
    mpi = sys.modules.get("mpi4py.MPI")
    if mpi is not None and mpi.COMM_WORLD.size > 1:
        traceback.print_exc()
        mpi.COMM_WORLD.Abort(1)


def _say(error: Exception, code: int) -> int:
    """One line on standard error, by rank 0."""
    mpi = sys.modules.get("mpi4py.MPI")
    if mpi is None or mpi.COMM_WORLD.rank == 0:
        text = str(error).strip() or type(error).__name__
        if hasattr(error, "ierr"):  # of PETSc's trace only what went wrong, not where its library was built
            text = "PETSc: " + text.splitlines()[-1].split("] ", 1)[-1]
        print("signorini:", " ".join(text.split()), file=sys.stderr)
    return code


if __name__ == "__main__":
    sys.exit(main())
