"""The tables of a study, made from its journal, as JSON and as HDF5.

A table is a list of rows with the same keys, whose values are numbers, words, truth values or None. In HDF5 it is a
group with one dataset per column, NaN or an empty word where the value is None, −1 where it is a truth value.
"""

from __future__ import annotations

import json
import math
from collections import defaultdict
from collections.abc import Iterable, Sequence
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

from validation.case import CASES
from validation.study.plan import Chain
from validation.study.rates import Point, above_floor, cheapest, reached, slope

Row = dict[str, Any]
Tables = dict[str, list[Row]]

TARGETS = (1e-2, 1e-3, 1e-4, 1e-5)
WITHIN = (1.0, 10.0)
SECONDS = ("build", "assemble", "factor", "detect", "delassus", "solve", "total")
MEASURED = ("candidates", "least_eigenvalue", "active", "condition", "iterations", "residual")
RESIDUALS = ("complementarity", "equilibrium", "surface_error", "penetration")


def tables(chains: Sequence[Chain], lines: Iterable[Row]) -> Tables:
    """All tables of a study from the lines of its journal.

    runs : one row for each level, order and method
    quantities : one row for each quantity of a solved run
    rates : of each quantity over the levels, those that the case claims beside them
    cheapest : the fastest way to each error
    reached : the error reached within a time
    scenes, problems : the recorded scenes, and each method on each of their problems
    """
    lines = list(lines)
    answers: dict[tuple[str, int], Row] = {}
    times: dict[tuple[str, int], Row] = {}
    for line in lines:
        if "chain" in line:
            key = line["chain"], line["level"]
            if key not in answers or not line["alone"]:
                answers[key] = line
            if line["alone"] and line["outcome"] == "solved":
                times[key] = line
    runs: list[Row] = []
    quantities: list[Row] = []
    points: dict[tuple[str, str], list[Point]] = defaultdict(list)
    for chain in chains:
        for level, h in enumerate(chain.sizes):
            answer = answers.get((chain.key, level))
            if answer is None:
                continue
            row = _run(chain, level, h, answer, times.get((chain.key, level)))
            for name, quantity in answer.get("report", {}).get("quantities", {}).items():
                quantities.append({"run": len(runs), "quantity": name, **quantity})
                error = math.nan if quantity["error"] is None else quantity["error"]
                seconds = math.nan if row["total"] is None else row["total"]
                points[chain.label, name].append(
                    Point(chain.method, chain.order, level, h, row["unknowns"], seconds, error)
                )
            runs.append(row)
    result = {"runs": runs, "quantities": quantities, "rates": _rates(chains, points)}
    result["cheapest"] = [
        {"case": case, "quantity": name, "target": target, **_way(cheapest(found, target))}
        for (case, name), found in points.items()
        for target in TARGETS
    ]
    result["reached"] = [
        {"case": case, "quantity": name, "within": seconds, **_way(reached(found, seconds))}
        for (case, name), found in points.items()
        for seconds in WITHIN
    ]
    return result | _problems(lines)


def _run(chain: Chain, level: int, h: float, answer: Row, timed: Row | None) -> Row:
    report = answer.get("report", {})
    row = {"case": chain.label, "order": chain.order, "method": chain.method, "level": level, "h": h}
    row |= {"outcome": answer["outcome"], "reason": answer.get("reason", ""), "claimed": answer.get("claimed", False)}
    row |= {"unknowns": report.get("dofs"), "contacts": report.get("contacts")}
    row["iterations"] = report.get("iterations", answer.get("iterations"))
    row |= {name: report.get("certificate", {}).get(name) for name in RESIDUALS}
    row["residual"] = answer.get("residual")
    repeats = timed["times"] if timed else []
    for phase in SECONDS:
        row[phase] = median(t[phase] for t in repeats) if repeats else None
    row["least"] = min((t["total"] for t in repeats), default=None)
    row["most"] = max((t["total"] for t in repeats), default=None)
    row["repeats"] = len(repeats)
    row["wall_over_cpu"] = median(t["wall"] / t["process"] for t in repeats) if repeats else None
    row |= {"memory": answer.get("memory"), "memory_before": answer.get("base")}
    return row


def _rates(chains: Sequence[Chain], points: dict[tuple[str, str], list[Point]]) -> list[Row]:
    """The slopes over the levels, of the method that has solved most of them, the first among equal ones."""
    rows = []
    for (case, name), found in points.items():
        chain = next(c for c in chains if c.label == case)
        entry = CASES[chain.case]
        claims = entry.claims(entry.configure(dict(chain.changes))).get(name, {})
        for order in sorted({p.order for p in found}):
            mine: dict[str, list[Point]] = defaultdict(list)
            for point in found:
                if point.order == order:
                    mine[point.method].append(point)
            method, solved = max(mine.items(), key=lambda item: len(item[1]))
            used = above_floor(solved)
            row: Row = {"case": case, "quantity": name, "order": order, "method": method, "levels": len(used)}
            row["rate"] = _finite(slope([p.h for p in used], [p.error for p in used]))
            claim = claims.get(order)
            row |= {"theory": claim[0] if claim else None, "tolerance": claim[1] if claim else None}
            judged = claim is not None and len(used) >= 3
            row["passed"] = abs((row["rate"] or math.nan) - claim[0]) <= claim[1] if judged and claim else None
            row["unknowns_over_h"] = _finite(slope([p.h for p in used], [p.unknowns for p in used]))
            row["seconds_over_unknowns"] = _finite(slope([p.unknowns for p in used], [p.seconds for p in used]))
            row["error_over_seconds"] = _finite(slope([p.seconds for p in used], [p.error for p in used]))
            rows.append(row)
    return rows


def _way(point: Point | None) -> Row:
    names = ("method", "order", "level", "h", "unknowns", "seconds", "error")
    return {name: getattr(point, name, None) for name in names} | {"method": point.method if point else ""}


def _problems(lines: list[Row]) -> Tables:
    scenes: dict[str, Row] = {}
    problems: dict[tuple[str, ...], Row] = {}
    for line in lines:
        if "problems_of" not in line:
            continue
        scene = line["problems_of"]
        if "method" not in line:
            if line.get("outcome"):
                ended = line.get("ended", line.get("reason", ""))
                scenes[scene] = {"scene": scene, "outcome": line["outcome"], "ended": ended}
            continue
        if "file" in line:
            row = {"scene": scene, "step": int(line["file"][5:-4]), "method": line["method"]}
            row |= {"outcome": line["outcome"], "reason": line["failure"], "claimed": line["claimed"]}
            row |= {name: line[name] for name in MEASURED}
            row |= {"seconds": median(line["times"]), "least": min(line["times"]), "most": max(line["times"])}
            problems[scene, line["method"], line["file"]] = row | {"repeats": len(line["times"])}
        elif line.get("outcome"):
            row = dict.fromkeys((*MEASURED, "seconds", "least", "most"))
            row = {"scene": scene, "step": -1, "method": line["method"], "outcome": line["outcome"]} | row
            row |= {"reason": line["reason"], "claimed": False, "candidates": 0, "repeats": 0}
            problems[scene, line["method"]] = row
    return {"scenes": list(scenes.values()), "problems": list(problems.values())}


def write(folder: Path, facts: Row, found: Tables) -> None:
    """Write ``study.json`` and ``study.h5``: `facts` about the study, and its tables."""
    import h5py

    _replace(folder / "study.json", json.dumps({**facts, **found}, indent=1, allow_nan=False).encode("utf8"))
    part = folder / "study.h5.part"
    with h5py.File(part, "w") as file:
        for name, value in facts.items():
            file.attrs[name] = json.dumps(value)
        for name, rows in found.items():
            group = file.create_group(name)
            group.attrs["rows"] = len(rows)
            for column in rows[0] if rows else ():
                values = _column([row[column] for row in rows])
                group.create_dataset(column, data=values)
    part.replace(folder / "study.h5")


def read(path: Path) -> tuple[Row, Tables]:
    """The facts and the tables of a ``study.h5``, as `write` got them."""
    import h5py

    with h5py.File(path) as file:
        facts = {name: json.loads(value) for name, value in file.attrs.items()}
        found = {}
        for name, group in file.items():
            columns = {
                key: [_value(v) for v in (data.asstr() if data.dtype.kind == "O" else data)[:]]
                for key, data in group.items()
            }
            found[name] = [{key: values[i] for key, values in columns.items()} for i in range(group.attrs["rows"])]
    return facts, found


def _column(values: list[Any]) -> Any:
    """The values of one column as an array that HDF5 keeps."""
    known = [value for value in values if value is not None]
    if any(isinstance(value, str) for value in known):
        return np.array(["" if value is None else value for value in values], dtype=object)
    if known and all(isinstance(value, bool) for value in known):
        return np.array([-1 if value is None else int(value) for value in values], dtype=np.int8)
    if known and len(known) == len(values) and all(isinstance(value, int) for value in known):
        return np.array(values, dtype=np.int64)
    return np.array([math.nan if value is None else float(value) for value in values])


def _value(value: Any) -> Any:
    """One value of a column as JSON has it."""
    if isinstance(value, np.int8):
        return None if value < 0 else bool(value)
    if isinstance(value, np.floating):
        return None if np.isnan(value) else float(value)
    return int(value) if isinstance(value, np.integer) else value


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _replace(path: Path, data: bytes) -> None:
    part = path.with_name(path.name + ".part")
    part.write_bytes(data)
    part.replace(path)
