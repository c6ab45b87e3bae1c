"""The loops of active sets that whole-array numpy cannot express, compiled.

What a kernel calls stands inlined in it: sums may be reordered, and another copy of a function, compiled by itself,
would round differently, so that a run that compiles would differ from one that loads its kernels.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from contact.solvers.problem import Bools, Floats, Ints

DONE, WANTED, INFEASIBLE, STALLED = 0, 1, 2, 3
DEPENDENT, GUESS = 4, 5
# A pivot above this part of its diagonal entry is no rounding.
SURE = 1e-5
_MATHS = {"reassoc", "contract", "nnan", "nsz"}


@njit(cache=True, fastmath=_MATHS, forceinline=True)
def remove(U: Floats, n: int, k: int) -> None:
    """Take row and column k out of the n rows of W = UᵀU: drop U's column k and rotate its trailing rows back."""
    w = U[k, k + 1 : n].copy()
    for j in range(k):
        U[j, k : n - 1] = U[j, k + 1 : n]
    for j in range(k, n - 1):
        U[j, j : n - 1] = U[j + 1, j + 1 : n]
    for j in range(n - 1 - k):
        row = U[k + j, k + j : n - 1]
        r = np.hypot(row[0], w[j])
        cosine, sine = row[0] / r, w[j] / r
        for i in range(len(row)):
            a, b = row[i], w[j + i]
            row[i] = cosine * a + sine * b
            w[j + i] = cosine * b - sine * a


@njit(cache=True, fastmath=_MATHS, forceinline=True)
def solve_transposed(U: Floats, n: int, b: Floats) -> None:
    """b ← U⁻ᵀ b."""
    for j in range(n):
        b[j] /= U[j, j]
        for i in range(j + 1, n):
            b[i] -= b[j] * U[j, i]


@njit(cache=True, fastmath=_MATHS, forceinline=True)
def solve_upper(U: Floats, n: int, b: Floats) -> None:
    """b ← U⁻¹ b."""
    for j in range(n - 1, -1, -1):
        total = b[j]
        for i in range(j + 1, n):
            total -= U[j, i] * b[i]
        b[j] = total / U[j, j]


@njit(cache=True, fastmath=_MATHS, forceinline=True)
def cholesky(W: Floats, rows: Ints, n: int, pivot: float, U: Floats) -> bool:
    """U ← the upper factor of W on the first n of `rows`; False where a pivot is below `pivot` times its entry of W."""
    for k in range(0, n, 4):
        # Four rows of the factor at a time, from two above: each number is loaded a fraction as often.
        m = min(4, n - k)
        for r in range(k, k + m):
            row, u = W[rows[r]], U[r]
            for i in range(k, n):
                u[i] = row[rows[i]]
        j = 0
        if m == 4:
            u0, u1, u2, u3 = U[k, k:n], U[k + 1, k:n], U[k + 2, k:n], U[k + 3, k:n]
            while j + 2 <= k:
                v, w = U[j, k:n], U[j + 1, k:n]
                a0, a1, a2, a3, b0, b1, b2, b3 = v[0], v[1], v[2], v[3], w[0], w[1], w[2], w[3]
                for i in range(n - k):
                    x, y = v[i], w[i]
                    u0[i] -= a0 * x + b0 * y
                    u1[i] -= a1 * x + b1 * y
                    u2[i] -= a2 * x + b2 * y
                    u3[i] -= a3 * x + b3 * y
                j += 2
        for r in range(k, k + m):
            u = U[r]
            for h in range(j, r):
                a0, v = U[h, r], U[h]
                for i in range(r, n):
                    u[i] -= a0 * v[i]
            if not u[r] > pivot * W[rows[r], rows[r]]:
                return False
            root = 1.0 / np.sqrt(u[r])
            for i in range(r, n):
                u[i] *= root
    return True


@njit(cache=True, fastmath=_MATHS, forceinline=True)
def _hold(W: Floats, wanted: Bools, order: Ints, n: int, pivot: float, U: Floats) -> int:
    """The number of rows `wanted`, in `order`, whose factor U holds; −1 where they depend on one another."""
    count, same = 0, True
    for i in range(len(wanted)):
        count += wanted[i]
    for i in range(n):
        same = same and wanted[order[i]]
    if same and count == n:
        return n
    n = 0
    for i in range(len(wanted)):
        if wanted[i]:
            order[n] = i
            n += 1
    return n if cholesky(W, order, n, pivot, U) else -1


@njit(cache=True, fastmath=_MATHS, forceinline=True)
def _gaps(W: Floats, q: Floats, lam: Floats, delta: Floats) -> float:
    """δ ← Wλ + q, and ℓ of `certificate.length`."""
    delta[:] = q
    for i in range(len(q)):
        x, row = lam[i], W[i]
        if x != 0.0:
            for j in range(len(q)):
                delta[j] += x * row[j]
    length, most = 0.0, 0.0
    for i in range(len(q)):
        length = max(length, -q[i], abs(delta[i] - q[i]))
        most = max(most, abs(q[i]))
    if length > 0.0:
        return length
    return most if most > 0.0 else 1.0


@njit(cache=True, fastmath=_MATHS)
def block_steps(
    W: Floats,
    q: Floats,
    start: Floats,
    lam: Floats,
    delta: Floats,
    order: Ints,
    U: Floats,
    state: Ints,
    tolerance: float,
    pivot: float,
    limit: int,
) -> int:
    """λ ≥ 0 on independent rows with its gaps: the solution, or else a guess for `ratio_tested`.

    The rows where `start` is positive are the first active ones. All rows with a negative multiplier leave and all
    violated ones enter at once, up to `limit` times (a primal-dual active set); where that does not end at a λ ≥ 0, the
    guess is `start`.

    Parameters
    ----------
    lam, delta : (c), overwritten
    order, U, state : the state[0] active rows and the upper factor of W on them, of the last call with the same W;
        overwritten

    Returns
    -------
    DONE where the residual is within `tolerance`, GUESS, or DEPENDENT where the rows of `start` are.
    """
    c = len(q)
    wanted = start > 0.0
    x = np.empty(c)
    for _ in range(limit):
        state[0] = n = _hold(W, wanted, order, state[0], pivot, U)
        if n <= 0:
            break
        for i in range(n):
            x[i] = -q[order[i]]
        solve_transposed(U, n, x)
        solve_upper(U, n, x)
        lam[:] = 0.0
        feasible = True
        for i in range(n):
            lam[order[i]] = x[i]
            feasible = feasible and x[i] > 0.0
        small = tolerance * _gaps(W, q, lam, delta)
        solved = feasible
        for i in range(c):
            solved = solved and delta[i] >= -small and (lam[i] == 0.0 or delta[i] <= small)
            wanted[i] = lam[i] > 0.0 or (lam[i] == 0.0 and delta[i] < -small)
        if solved:
            return DONE
        if feasible:
            return GUESS
    state[0] = _hold(W, start > 0.0, order, max(state[0], 0), pivot, U)
    lam[:] = start
    _gaps(W, q, lam, delta)
    return GUESS if state[0] >= 0 else DEPENDENT


@njit(cache=True, fastmath=_MATHS)
def ratio_tested(
    columns: Floats,
    slot: Ints,
    q: Floats,
    lam: Floats,
    delta: Floats,
    order: Ints,
    U: Floats,
    active: Ints,
    peak: Floats,
    state: Ints,
    tolerance: float,
    pivot: float,
    noise: float,
    limit: int,
) -> int:
    """Active-set loop for 0 ≤ δ = Wλ + q ⊥ λ ≥ 0 with a ratio test: λ ≥ 0 throughout, ½λᵀWλ + qᵀλ decreases.

    (1) On the active rows the minimiser is found; the first multiplier that reaches zero on the way leaves.
    (2) The gaps of all rows are formed. (3) The most violated row enters; where it depends on the active ones (a pivot
    below `pivot` Wⱼⱼ), λ first moves along the null direction until another row leaves, and where none does the
    dual objective is unbounded: no position satisfies the constraints.

    Parameters
    ----------
    columns, slot : formed columns of W and where each row's is, as in `FormedColumns`
    lam, delta : (c), from the support `order[:n]`; overwritten
    order, U : the active rows and the upper Cholesky factor of W on them
    active : (c) 1 on active rows, −1 on those that left again at once and wait for the next progress
    peak : (c) maxᵢ |Wᵢⱼ| of active columns
    state : n, the row that enters next or −1, iterations, departures
    noise : relative error of W's entries, [-]
    limit : on the iterations

    Returns
    -------
    DONE, or WANTED: column `state[1]` (or room in U) is needed, call again; INFEASIBLE: row `state[1]` cannot be
    satisfied; STALLED at the limit.

    Source: Lawson & Hanson, Solving Least Squares Problems (1974), ch. 23; Goldfarb & Idnani, Math. Program. 27 (1983).
    """
    c, n, enter, newest = len(q), state[0], state[1], -1
    reach = max(0.0, -q.min())
    scale = reach
    while True:
        refined = 0
        while enter < 0:
            # (1) δ = 0 on the active rows, from the gaps left there: this also refines λ
            while n > 0:
                state[2] += 1
                step = -delta[order[:n]]
                solve_transposed(U, n, step)
                solve_upper(U, n, step)
                alpha, k = 1.0, -1
                for i in range(n):
                    if lam[order[i]] + alpha * step[i] < 0:
                        alpha, k = max(0.0, -lam[order[i]] / step[i]), i
                for i in range(n):
                    lam[order[i]] = max(0.0, lam[order[i]] + alpha * step[i])
                    delta[order[i]] *= 1 - alpha
                if alpha > 0 and newest >= 0:
                    newest = -1
                    for i in range(c):
                        active[i] = max(active[i], 0)
                if k < 0:
                    break
                gone = order[k]
                active[gone] = -1 if gone == newest else 0
                lam[gone] = 0.0
                remove(U, n, k)
                order[k : n - 1] = order[k + 1 : n]
                n -= 1
                state[3] += 1
            # (2)
            delta[:] = q
            uncertain = 0.0
            for i in range(n):
                column, x = columns[slot[order[i]]], lam[order[i]]
                for j in range(c):
                    delta[j] += x * column[j]
                uncertain += x * peak[order[i]]
            scale = reach
            for i in range(c):
                scale = max(scale, abs(delta[i] - q[i]))
            small = max(tolerance * scale, noise * uncertain)
            left = 0.0
            for i in range(n):
                left = max(left, abs(delta[order[i]]))
            # (3)
            worst = -small
            for i in range(c):
                if active[i] == 0 and delta[i] < worst:
                    worst, enter = delta[i], i
            if refined < 3 and (left > small or (enter < 0 and left > tolerance * scale)):
                refined += 1
                enter = -1
            elif enter < 0:
                state[0], state[1] = n, -1
                return DONE
        if slot[enter] < 0 or n == len(U):
            state[0], state[1] = n, enter
            return WANTED
        if state[2] > limit:
            state[0], state[1] = n, -1
            return STALLED
        column = columns[slot[enter]]
        diagonal = column[enter]
        while True:
            border = column[order[:n]]
            solve_transposed(U, n, border)
            square = diagonal
            for i in range(n):
                square -= border[i] * border[i]
            dependent = square <= pivot * diagonal
            if square > SURE * diagonal:
                break
            null = -border
            solve_upper(U, n, null)
            # W's errors reach the pivot through the null direction
            weight = np.sqrt(diagonal)
            for i in range(n):
                weight += abs(null[i]) * np.sqrt(columns[slot[order[i]], order[i]])
            dependent = dependent or square <= noise * weight * weight
            if not dependent:
                break
            alpha, k, size, doubt = np.inf, -1, abs(q[enter]), 0.0
            for i in range(n):
                row = order[i]
                size += abs(q[row] * null[i])
                root = np.sqrt(columns[slot[row], row])
                # what the gaps left on active rows, and rounding of Wλ, make of the violation along the null direction
                doubt += abs(null[i] * delta[row]) + noise * weight * lam[row] * root
                pull = null[i] * root
                if pull < -1e-10 * weight and lam[row] < -alpha * null[i]:
                    alpha, k = -lam[row] / null[i], i
            if k < 0:
                # To satisfy the row the bodies need the energy δ²/2d, d the pivot: infeasible where that exceeds ℓ²/2W
                # for the largest d that rounding allows, or where no more than a pair of rows is opposed.
                largest = max(square, 0.0) + noise * weight * weight
                proven = delta[enter] ** 2 * diagonal > scale**2 * largest or weight**2 <= 9 * diagonal
                if proven and -delta[enter] > max(1e-11 * size, 4 * doubt):
                    state[0], state[1] = n, enter
                    return INFEASIBLE
                break
            lam[enter] += alpha
            for i in range(n):
                lam[order[i]] = max(0.0, lam[order[i]] + alpha * null[i])
            gone = order[k]
            active[gone] = 0
            lam[gone] = 0.0
            remove(U, n, k)
            order[k : n - 1] = order[k + 1 : n]
            n -= 1
            state[3] += 1
        if not dependent:
            U[:n, n] = border
            U[n, n] = np.sqrt(square)
            order[n] = enter
            active[enter] = 1
            peak[enter] = np.max(np.abs(column))
            newest = enter
            n += 1
        else:
            # consistent with the active rows to rounding: there is nothing that it could add
            active[enter] = -1
            lam[enter] = 0.0
        enter = -1


@njit(cache=True, fastmath=_MATHS)
def gauss_seidel(W: Floats, q: Floats, lam: Floats, sweeps: int) -> None:
    """λᵢ ← max(0, λᵢ − δᵢ/Wᵢᵢ), row after row, `sweeps` times; overwrites `lam`. Rows with Wᵢᵢ = 0 keep their λᵢ."""
    for _ in range(sweeps):
        for i in range(len(q)):
            gap = q[i]
            for j in range(len(q)):
                gap += W[i, j] * lam[j]
            if W[i, i] > 0:
                lam[i] = max(0.0, lam[i] - gap / W[i, i])
