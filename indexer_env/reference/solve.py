"""DOP853 from edge to edge, and `simulate_reference`."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from indexer_env.checks import check_integer, check_number
from indexer_env.errors import SimulationError, refuse
from indexer_env.machine import Machine
from indexer_env.operating_point import OperatingPoint
from indexer_env.reference.edges import CAM_HIGH, CAM_LOW, JOINT_1, Guards, first_crossing
from indexer_env.reference.equations import SHEET, STATE, Equations
from indexer_env.trajectory import Trajectory, check_channels

LARGEST_DEFLECTION = 0.5
"""rad; a joint deflected by more has left the range in which the model means anything."""

LARGEST_STEP = 1e-3
"""s; the default bound on the step, a fifteenth of the reference machine's fastest period. Without a bound an error
estimate taken in a quiet dwell lets the step grow past whole contacts (scipy issues 18039 and 19968)."""

_FIRST_STEP = 1e-6
"""s; first step behind an edge, so that a touch much shorter than a step is seen. The steps grow tenfold from it."""

_CHATTER_TIME, _CHATTER_EDGES = 1e-9, 100
"""More edges than this within so short a time [s] are no motion."""

_OWNER = "simulate_reference"


def simulate_reference(
    machine: Machine,
    operating_point: OperatingPoint | None = None,
    *,
    sample_rate: float = 1000.0,
    samples: int | None = None,
    turns_before: int = 0,
    rtol: float = 1e-10,
    atol: float = 1e-12,
    max_step: float | None = None,
    channels: Sequence[str] = ("table_acceleration",),
) -> Trajectory:
    """Simulate one machine with DOP853 stopped at every edge: some seconds per table turn, for checking.

    The motion begins at α = start_angle, γ = α/τ, φ = β(α), motor at its commanded speed: no joint is deflected but the
    input joint by what ripples on the drive there. Model A has
    no joint 1: its cam is the drive side, M1 = 0, and what acts on joint 1 or needs its torque has no effect there.
    A joint that the model does not have is reported in region +1, undeflected and without torque.

    Parameters
    ----------
    machine : Machine
    operating_point : OperatingPoint, optional
        The reference one where not given.
    sample_rate : float
        [Hz], > 0.
    samples : int, optional
        Samples of the record; one table turn at the commanded speed where not given, rounded.
    turns_before : int
        Table turns at the commanded speed run first, not recorded, >= 0.
    rtol, atol : float
        Tolerances of one step of DOP853, relative [-] and absolute [rad, rad/s].
    max_step : float, optional
        Bound on the step [s]; LARGEST_STEP where not given.
    channels : sequence of str
        Quantities to record, of `trajectory.CHANNELS`.

    Returns
    -------
    Trajectory
        Channels (n,) in SI units and radians; no warm-up report.

    Raises
    ------
    ParameterError
        A bad argument, or an effect that does not fit the machine or is unknown here.
    SimulationError
        The run became non-finite, left the physical range or does not get over an edge; names machine, time and state.

    Notes
    -----
    Validated against closed forms (free decay, bilinear period, energy, free flight) and against the compiled kernel.
    Where there is play the motion is sensitive: two accurate solutions part over seconds, so compare short horizons
    sample by sample and long ones by their statistics.
    """
    operating_point = OperatingPoint() if operating_point is None else operating_point
    if not isinstance(machine, Machine):
        raise refuse(_OWNER, "machine", "a Machine", machine)
    if not isinstance(operating_point, OperatingPoint):
        raise refuse(_OWNER, "operating_point", "an OperatingPoint", operating_point)
    check_number(_OWNER, "sample_rate", sample_rate, low=0.0, low_open=True, unit="Hz")
    if samples is not None:
        check_integer(_OWNER, "samples", samples, low=1)
    check_integer(_OWNER, "turns_before", turns_before, low=0)
    # DOP853 itself takes nothing finer than 100 times the rounding of a float
    check_number(_OWNER, "rtol", rtol, low=2.3e-14, high=1e-3)
    check_number(_OWNER, "atol", atol, low=0.0, low_open=True, high=1e-3, unit="rad")
    max_step = LARGEST_STEP if max_step is None else max_step
    check_number(_OWNER, "max_step", max_step, low=1e-6, high=0.01, unit="s")
    if isinstance(channels, str) or not isinstance(channels, Sequence) or not channels:
        raise refuse(_OWNER, "channels", "a row of channel names", channels)
    check_channels(_OWNER, tuple(channels))

    duration = machine.turn_duration(operating_point)
    count = samples or max(1, round(duration * sample_rate))
    times = turns_before * duration + np.arange(count) / sample_rate
    solver = _Solver(Equations(machine, operating_point), rtol, atol, max_step)
    with np.errstate(over="ignore", invalid="ignore"):  # a run that overflows is told below, in words
        table = np.array(solver.record(times)).T
    names: tuple[str, ...] = (*STATE, *SHEET, "region_1", "region_2", "region_3")
    # Model A's cam pair of the sheet comes after that of the state and replaces it.
    rows: dict[str, np.ndarray] = dict(zip(names, table, strict=True))
    return Trajectory(float(sample_rate), {name: rows[name] for name in channels})


class _Solver:
    """The state of one run and what is in force there: the stretch of the cam and the joints' regions."""

    def __init__(self, equations: Equations, rtol: float, atol: float, max_step: float) -> None:
        self.equations, self.rtol, self.atol, self.max_step = equations, rtol, atol, max_step
        self.time, self.state = 0.0, equations.start()
        self.regions = [1, 1, 1]
        self.place = equations.cam.place(self.state[0])
        self._enter(self.place)
        values = self.sheet(self.state)
        for joint in equations.present:
            self.regions[joint] = self.contacts[joint].region(values[6 + 2 * joint], values[7 + 2 * joint])
        self._enter(equations.cam.place(values[0]))

    def _enter(self, place: tuple[int, int]) -> None:
        """Put the stretch of the cam at `place` and the present regions in force."""
        self.place, self.stretch = place, self.equations.cam.stretch(*place)
        self.contacts = self.equations.contacts(place[0])
        self.sheet = self.equations.sheet(self.stretch, self.contacts, self.regions)
        self.guards = Guards(self.stretch, self.contacts, self.regions, self.equations.present)

    def _rates(self, _time: float, state: np.ndarray) -> list[float]:
        y = state.tolist()
        if not math.isfinite(sum(y)):
            return [math.nan] * len(y)
        values = self.sheet(y)
        return [values[1], values[2], y[3], values[3], y[5], values[4], y[7], values[5]]

    def record(self, times: np.ndarray) -> list[tuple[float, ...]]:
        """States, sheets and regions at ascending times [s], one row each."""
        from scipy.integrate import DOP853  # here, not above: it takes longer to import than the rest of the package

        rows: list[tuple[float, ...]] = []
        edges: list[float] = []
        last = float(times[-1])
        while self.time < last:
            step = min(_FIRST_STEP, self.max_step, last - self.time)
            solver = DOP853(
                self._rates, self.time, self.state, last, max_step=self.max_step, rtol=self.rtol, atol=self.atol,
                first_step=step,
            )  # fmt: skip
            if self._until_edge(solver, times, rows):
                edges.append(self.time)
                if len(edges) > _CHATTER_EDGES and self.time - edges[-_CHATTER_EDGES] < _CHATTER_TIME:
                    raise self._fault("does not get over an edge of its contacts")
        rows.append(self._row(self.state))
        return rows

    def _until_edge(self, solver, times: np.ndarray, rows: list[tuple[float, ...]]) -> bool:
        """Step until an edge is crossed and go over it (True), or to the end (False); rows at the times passed."""
        before = self.sheet(self.state)
        while solver.status == "running":
            solver.step()
            if solver.status == "failed":
                raise self._fault("became non-finite or too fast to follow")
            old, now = solver.t_old, solver.t
            after = self._checked(now, solver.y.tolist())
            dense = None

            def at(offsets: np.ndarray, old: float = old) -> list[tuple[float, ...]]:
                nonlocal dense
                dense = dense or solver.dense_output()
                return [self.sheet(state) for state in dense(old + offsets).T.tolist()]

            crossing = first_crossing(self.guards, before, after, now - old, at)
            end = now if crossing is None else old + crossing[0]
            while len(rows) < len(times) and times[len(rows)] < end:
                dense = dense or solver.dense_output()
                rows.append(self._row(dense(times[len(rows)]).tolist()))
            self.time = end
            if crossing is not None:
                dense = dense or solver.dense_output()
                self.state = dense(end).tolist()
                self._cross(crossing[1])
                return True
            self.state, before = solver.y.tolist(), after
        return False

    def _cross(self, edge: int) -> None:
        """Go over an edge: into the next stretch of the cam, or into the joint's next region."""
        values = self.sheet(self.state)
        if edge in (CAM_LOW, CAM_HIGH):
            self._enter(self.equations.cam.beside(*self.place, 1 if edge == CAM_HIGH else -1))
            for joint in self.equations.present:
                contact, motion = self.contacts[joint], values[6 + 2 * joint : 8 + 2 * joint]
                if contact.guard(self.regions[joint], *motion) < 0.0:
                    self.regions[joint] = contact.region(*motion)
        else:
            joint = edge - JOINT_1
            motion = values[6 + 2 * joint : 8 + 2 * joint]
            self.regions[joint] = self.contacts[joint].region_after(self.regions[joint], *motion)
        self._enter(self.place)

    def _row(self, state: list[float]) -> tuple[float, ...]:
        return (*state, *self.sheet(state), *self.regions)

    def _checked(self, time: float, state: list[float]) -> tuple[float, ...]:
        """The sheet at a state that is finite and within the physical range."""
        finite = math.isfinite(sum(state))
        values = self.sheet(state) if finite else (math.nan,)
        if not math.isfinite(sum(values)):
            raise self._fault("became non-finite", time, state)
        if max(map(abs, values[6:12:2])) > LARGEST_DEFLECTION:
            raise self._fault(f"deflected a joint beyond {LARGEST_DEFLECTION} rad", time, state)
        return values

    def _fault(self, what: str, time: float | None = None, state: list[float] | None = None) -> SimulationError:
        time, state = (self.time, self.state) if time is None or state is None else (time, state)
        values = ", ".join(f"{name} {value:.4g}" for name, value in zip(STATE, state, strict=True))
        return SimulationError(f"{self.equations.machine.name} {what} at t = {time:.4g} s ({values}).")
