"""Error against time for every solver on the machine with play: each over a range of steps or tolerances.

The error is the median, over draws, of the relative rms error of φ̈ in the first 0.5 s against the reference solver;
over longer records play parts all solvers. The time is that of one turn with both cores at work, from processor time
divided by the cores: batched solvers run a batch as they would for a data set; a serial solver's time for one cam turn
(motion and dwell) is multiplied by the stations.
"""

from __future__ import annotations

import statistics
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks import cases, peers
from benchmarks.accuracy import accelerations
from benchmarks.measures import relative_rms
from benchmarks.peers import lane_peer, model_b, scipy_peer
from benchmarks.references import reference_records
from benchmarks.report import Row, number
from benchmarks.session import CORES, version
from benchmarks.speed import median_time
from indexer_env.errors import refuse

JUDGED = 8
"""Draws over which the error's median is taken."""

TOLERANCES = (1e-4, 1e-6, 1e-8, 1e-10, 1e-12)
SCIPY_MAX_STEPS = {"RK45": (2e-3, 1e-3, 2.5e-4, 6.25e-5), "DOP853": (2e-3, 1e-3, 5e-4), "LSODA": (1e-3, 2.5e-4)}
"""s; without such a bound solve_ivp steps over contacts after the dwell (SciPy issues 18039, 19968)."""

EQUAL_ACCURACY = 1e-5
"""Error at which the solvers' speeds are put side by side."""


@dataclass(frozen=True)
class Point:
    """One setting of one solver: relative rms error of φ̈ [-] and seconds of a turn on both cores."""

    solver: str
    setting: str
    error: float
    seconds_per_turn: float


def measure(*, quick: bool, only: Sequence[str] = (), stored: Sequence[Point] = ()) -> tuple[list[Row], list[Point]]:
    """All points, and the rows that compare the solvers at equal accuracy; `quick` takes one setting of each. Solvers
    that are not among `only` (all, where that is empty) have no row, and the stored points."""
    judged, batch = (2, 32) if quick else (JUDGED, 256)
    truth = reference_records(cases.draws(judged), cases.OPERATING_POINT, samples=cases.HALF_SECOND)
    points = []
    rows = []
    for solver, needs, sweep in SWEEPS:
        if only and solver not in only:
            points += [point for point in stored if point.solver == solver]
            continue
        if needs is not None and version(peers.DISTRIBUTIONS[needs]) is None:
            rows.append(Row(_what(solver), "", f"{peers.DISTRIBUTIONS[needs]} is not installed"))
            continue
        settings = sweep(judged, batch)
        for setting, error, seconds in [next(settings)] if quick else settings:
            points.append(Point(solver, setting, float(np.median(error(truth))), seconds()))
            print(f"  {solver}, {setting}: error {points[-1].error:.1e}, {1e3 * points[-1].seconds_per_turn:.3g} ms")
        rows.append(_row(solver, [point for point in points if point.solver == solver]))
    return rows, points


def check_solvers(names: Sequence[str]) -> None:
    """Raise ParameterError where a name is of no solver, or of one that is not installed."""
    needed = {solver: needs for solver, needs, _ in SWEEPS}
    for name in names:
        if name not in needed:
            raise refuse("benchmarks", "only", "some of " + ", ".join(map(repr, needed)), name)
        package = peers.DISTRIBUTIONS.get(needed[name] or "")
        if package is not None and version(package) is None:
            raise refuse("benchmarks", "only", "solvers that are installed", name, f"pip install {package}")


def _what(solver: str) -> str:
    return f"turns/s at an error ≤ {EQUAL_ACCURACY:g}: {solver}"


def _row(solver: str, points: list[Point]) -> Row:
    """The fastest setting at or below the error that is asked for."""
    good = [point for point in points if point.error <= EQUAL_ACCURACY]
    what = _what(solver)
    if not good:
        best = min(points, key=lambda point: point.error)
        return Row(what, "", f"not reached; {number(best.error)} at {number(1 / best.seconds_per_turn)} turns/s")
    best = min(good, key=lambda point: point.seconds_per_turn)
    return Row(
        what, "", f"{number(1 / best.seconds_per_turn)} ({best.setting}, error {number(best.error)})",
        numbers={"turns_per_s": 1 / best.seconds_per_turn, "error": best.error},
    )  # fmt: skip


Setting = tuple[str, Callable[[np.ndarray], np.ndarray], Callable[[], float]]
"""Its name; errors (n,) of the judged draws against the truth; seconds of a turn."""


def _own(judged: int, batch: int) -> Iterator[Setting]:
    machines = cases.draws(batch)
    for per_ms in (1, 2, 4, 8, 16, 32):
        step = 1e-3 / per_ms
        yield (
            f"{number(1e3 * step)} ms",
            lambda truth, step=step: relative_rms(
                accelerations(machines[:judged], cases.HALF_SECOND, step=step), truth
            ),
            lambda step=step: _batched(lambda: accelerations(machines, cases.TURN_SAMPLES, step=step), batch, 1.0),
        )


def _serial(record: Callable[[np.ndarray, int], np.ndarray], setting: str, judged: int) -> Setting:
    p = _parameters(judged)
    stations = cases.with_play().stations
    cam_turn = cases.TURN_SAMPLES // stations

    def errors(truth: np.ndarray) -> np.ndarray:
        return relative_rms(np.stack([record(row, cases.HALF_SECOND) for row in p]), truth)

    def seconds() -> float:
        times = [median_time(lambda row=row: record(row, cam_turn), 1)[1] for row in p[:4]]
        return statistics.median(times) * stations / CORES

    return setting, errors, seconds


def _plain(judged: int, batch: int) -> Iterator[Setting]:
    for per_ms in (1, 4, 16, 64):
        yield _serial(
            lambda p, n, per_ms=per_ms: model_b.plain_rk4(p, peers.start(p), 1000.0, n, per_ms),
            f"{number(1 / per_ms)} ms", judged,
        )  # fmt: skip


def _lanes(judged: int, batch: int) -> Iterator[Setting]:
    p = _parameters(batch)
    for per_ms in (1, 4, 16, 64):
        yield (
            f"{number(1 / per_ms)} ms",
            lambda truth, per_ms=per_ms: relative_rms(
                lane_peer.records(p[:judged], 1000.0, cases.HALF_SECOND, per_ms), truth
            ),
            lambda per_ms=per_ms: _batched(
                lambda: lane_peer.records(p, 1000.0, cases.HALF_SECOND, per_ms), batch,
                cases.HALF_SECOND / cases.TURN_SAMPLES,
            ),
        )  # fmt: skip


def _scipy(method: str) -> Callable[[int, int], Iterator[Setting]]:
    def sweep(judged: int, batch: int) -> Iterator[Setting]:
        for max_step in SCIPY_MAX_STEPS[method]:
            for rtol in (1e-6, 1e-9):
                yield _serial(
                    lambda p, n, rtol=rtol, max_step=max_step: scipy_peer.record(
                        p, 1000.0, n, method=method, rtol=rtol, max_step=max_step
                    ),
                    f"rtol {rtol:g}, steps ≤ {number(1e3 * max_step)} ms", judged,
                )  # fmt: skip

    return sweep


def _sundials(judged: int, batch: int) -> Iterator[Setting]:
    from benchmarks.peers.sundials_peer import record

    for rtol in TOLERANCES:
        yield _serial(lambda p, n, rtol=rtol: record(p, 1000.0, n, rtol=rtol), f"rtol {rtol:g}", judged)


def _jax_scan(judged: int, batch: int) -> Iterator[Setting]:
    from benchmarks.peers.jax_peer import scan, split_over_cores

    for per_ms in (1, 4, 16):
        function = scan(1000.0, cases.HALF_SECOND, per_ms)
        yield _compiled(function, f"{number(1 / per_ms)} ms", judged, split_over_cores(_parameters(min(batch, 128))))


def _diffrax(judged: int, batch: int) -> Iterator[Setting]:
    from benchmarks.peers.diffrax_peer import tsit5
    from benchmarks.peers.jax_peer import split_over_cores

    for rtol in TOLERANCES[:-1]:
        function = tsit5(1000.0, cases.HALF_SECOND, rtol)
        yield _compiled(function, f"rtol {rtol:g}", judged, split_over_cores(_parameters(min(batch, 64))))


def _compiled(function: Callable, setting: str, judged: int, p: np.ndarray) -> Setting:
    turns = cases.HALF_SECOND / cases.TURN_SAMPLES
    return (
        setting,
        lambda truth: relative_rms(np.asarray(function(_parameters(judged))), truth),
        lambda: _batched(lambda: np.asarray(function(p)), len(p), turns),
    )


def _batched(action: Callable[[], object], batch: int, turns: float) -> float:
    return median_time(action, 3)[1] / (CORES * batch * turns)


def _parameters(count: int) -> np.ndarray:
    return np.stack([peers.parameters(machine, cases.OPERATING_POINT) for machine in cases.draws(count)])


SWEEPS: tuple[tuple[str, str | None, Callable[[int, int], Iterator[Setting]]], ...] = (
    ("indexer_env", None, _own),
    ("plain RK4, compiled", None, _plain),
    ("plain RK4 in lanes", None, _lanes),
    *((f"SciPy {method}", None, _scipy(method)) for method in scipy_peer.METHODS),
    ("JAX scan of RK4", "jax", _jax_scan),
    ("diffrax Tsit5", "diffrax", _diffrax),
    ("CVODE, stopped at edges", "sundials", _sundials),
)
"""Name, optional peer that must be installed, settings from fast to accurate."""
