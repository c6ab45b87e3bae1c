"""Seconds per phase of a step.

assemble : all of a step that is none of the others: meshes to matrices and forces, the certificate
factor : A's factorisation, and the two solves with it that every step needs (free and corrective motion)
detect : gaps, normals, rows of H, the distances of the certificate included
delassus : solves on columns of Hᵀ
solve : the contact method itself, on W
output : writing the record
"""

from __future__ import annotations

from collections.abc import Callable
from time import perf_counter

PHASES = ("assemble", "factor", "detect", "delassus", "solve", "output")


class _Phase:
    """A context that charges its time to one phase; it may be entered again while it lasts."""

    __slots__ = ("_clock", "_name")

    def __init__(self, clock: Clock, name: str) -> None:
        self._clock, self._name = clock, name

    def __enter__(self) -> None:
        clock = self._clock
        clock.charge()
        clock.running.append(self._name)

    def __exit__(self, *error: object) -> None:
        clock = self._clock
        clock.charge()
        clock.running.pop()


class Clock:
    """Adds up the time spent in each phase; a phase inside another interrupts it, so that their sum is the whole.

    `now` tells the time [s]: that on the wall, if it is not given. `running` are the phases begun, the last one last.
    """

    def __init__(self, now: Callable[[], float] | None = None) -> None:
        self.seconds = dict.fromkeys(PHASES, 0.0)
        self.running: list[str] = []
        self._phases = {phase: _Phase(self, phase) for phase in PHASES}
        self._now = now or perf_counter
        self._since = self._start = self._now()

    def __call__(self, phase: str) -> _Phase:
        """Count the time of the ``with`` block as `phase`."""
        return self._phases[phase]

    def charge(self) -> None:
        """Add the time since the last call to the phase that is running."""
        now = self._now()
        if self.running:
            self.seconds[self.running[-1]] += now - self._since
        self._since = now

    def share(self, seconds: list[float]) -> None:
        """Charge parts of the time of the phase that is running to the phases, in their order."""
        self.charge()
        self.seconds[self.running[-1]] -= sum(seconds)
        for phase, spent in zip(PHASES, seconds, strict=False):
            self.seconds[phase] += spent

    def lap(self) -> dict[str, float]:
        """Seconds per phase and `total` (without output) since the last lap; starts anew."""
        now = self._now()
        lap = {**self.seconds, "total": now - self._start - self.seconds["output"]}
        self.seconds = dict.fromkeys(PHASES, 0.0)
        self._start = now
        return lap
