"""Four ways to name an effect on a machine with play: ``python -m benchmarks.play_methods [--quick]``

Every method gets the same blind cases of `indexer_experiments.challenge`: one effect hidden, or none, at each amount of
play.

    whole record  least squares on the samples of whole records, one start state for each (`whole_record`)
    windows       least squares on windows of one cam turn with start states of their own, as `discrepancy` does it
    cam average   synthetic likelihood of the mean cam turn (`cam_averages`)
    by station    the same of each station's mean cam turn

All choose among the same effects, `LIBRARY`, by cost with the price of the parameters (BIC), and give a name where the
best effect wins more than `MARGIN` over none. What a method has found is told alike for all: its machine is frozen and
fitted by windows to the record held out, a speed and load that none of them saw; `closed` is the share of the gap that
the windows' base model leaves there.
"""

from __future__ import annotations

import argparse
import functools
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import numpy as np

from benchmarks.cam_averages import Fitted, name_by_averages
from benchmarks.whole_record import WholeRecordModel
from discrepancy import NONE, name_effect
from discrepancy.held_out import held_place
from discrepancy.indexer import Experiment, IndexerModel
from discrepancy.problem import Problem
from indexer_env.machine import Machine
from indexer_experiments.challenge.draw import HIDDEN, KNOWN_TO, Order, draw
from indexer_experiments.challenge.records import read_case, write_records
from indexer_experiments.tables import table

LIBRARY = (
    "friction.coulomb", "friction.viscous", "load.imbalance", "drive.slip", "drive.speed_ripple",
    "drive.transmission_error",
)  # fmt: skip
"""Effects that compete: a part of the whole library, so that all cases can be solved by all methods."""

TOLD = ("load.imbalance", "friction.coulomb", "drive.speed_ripple", "friction.viscous")
"""Effects that are hidden, in turn."""

MARGIN = 30.0
"""Least gain in BIC (twice a log-likelihood) for which a name is given."""

GAP = (3.0, 10.0)
"""Lowest and highest size of what is hidden, as in the challenge."""

NAMES_OF_PLAY = {"none": "none", "healthy": "2′", "5": "5°", "20": "20°"}


_M = TypeVar("_M", bound=IndexerModel)


@dataclass(frozen=True)
class Outcome:
    """What a method made of a case.

    Attributes
    ----------
    method, play, hidden : str
        Of METHODS and NAMES_OF_PLAY; `hidden` is "none" where nothing is.
    first : str
        The hypothesis of the lowest BIC.
    margin : float
        Its gain over none.
    before, after : float
        Level on the record held out, of the windows' base model and of what the method found.
    cpu : float
        Processor time [s].
    """

    method: str
    play: str
    hidden: str
    first: str
    margin: float
    before: float
    after: float
    cpu: float

    @property
    def named(self) -> bool:
        """Whether a name is given."""
        return self.first != NONE.name and self.margin > MARGIN

    @property
    def right(self) -> bool:
        """Whether what is hidden, or none, has the lowest BIC."""
        return self.first == self.hidden

    @property
    def closed(self) -> float:
        """Share of the gap on the record held out that was closed."""
        return (self.before**2 - self.after**2) / (self.before**2 - 1.0)


@dataclass(frozen=True, eq=False)
class Case:
    """The files of a case as every method gets them."""

    machine: Machine
    fitted: Sequence[Experiment]
    held_out: Sequence[Experiment]
    number: int

    def models(self, kind: type[_M]) -> tuple[_M, _M]:
        without = tuple(name for name in HIDDEN if name not in LIBRARY)
        fitted = kind(self.machine, self.fitted, uncertainty=KNOWN_TO, without=without)
        return fitted, kind(self.machine, self.held_out, uncertainty=KNOWN_TO, without=without)


def by_windows(case: Case, kind: type[IndexerModel] = IndexerModel) -> list[Fitted]:
    naming = name_effect(*case.models(kind))
    return [Fitted(c.place.hypothesis, c.place.z, c.score) for c in naming.candidates]


def by_whole_records(case: Case) -> list[Fitted]:
    return by_windows(case, WholeRecordModel)


def by_averages(case: Case, *, by_station: bool = False) -> list[Fitted]:
    model, rng = case.models(WholeRecordModel)[0], np.random.default_rng(case.number)
    return name_by_averages(model, rng, by_station=by_station)


METHODS: dict[str, Callable[[Case], list[Fitted]]] = {
    "windows": by_windows,
    "whole record": by_whole_records,
    "cam average": by_averages,
    "by station": functools.partial(by_averages, by_station=True),
}


def made(seed: int, play: str, hidden: str) -> Case:
    """The case in which an effect is hidden, or none."""
    if hidden == NONE.name:
        order, number = Order(1, seed, kind="none", play=play), 0
    else:
        order, number = Order(len(HIDDEN), seed, play=play, gap=GAP), list(HIDDEN).index(hidden)
    drawn = draw(order, number)
    with tempfile.TemporaryDirectory() as folder:
        write_records(drawn, order.turns, Path(folder))
        records = read_case(Path(folder), drawn.nominal)
    return Case(drawn.nominal, records.fitted, records.held_out, number)


def solved(play: str, hidden: str, case: Case, methods: Sequence[str]) -> list[Outcome]:
    """What the methods make of a case; windows among them, as their base model is the gap."""
    found: dict[str, tuple[list[Fitted], float]] = {}
    for method in methods:
        began = time.process_time()
        candidates = METHODS[method](case)
        found[method] = candidates, time.process_time() - began
    model, held_out = case.models(IndexerModel)
    none = next(c for c in found["windows"][0] if c.hypothesis.name == NONE.name)
    before = _held(model, held_out, none)
    outcomes = []
    for method, (candidates, cpu) in found.items():
        best = candidates[0]
        gain = next(c.score for c in candidates if c.hypothesis.name == NONE.name) - best.score
        after = _held(model, held_out, best)
        outcomes.append(Outcome(method, play, hidden, best.hypothesis.name, gain, before, after, cpu))
    return outcomes


def _held(model: IndexerModel, held_out: IndexerModel, found: Fitted) -> float:
    """Level of the physics found, frozen, on the record held out."""
    states = np.zeros((len(model.counts), model.local_count(found.hypothesis)))
    place = Problem(model, found.hypothesis).point(found.z, states)
    return held_place(place, held_out).level(held_out)


def summary(outcomes: Sequence[Outcome]) -> str:
    """The table in Markdown: a row for each amount of play and method."""
    rows = []
    for play, method in dict.fromkeys((o.play, o.method) for o in outcomes):
        mine = [o for o in outcomes if (o.play, o.method) == (play, method)]
        hidden, empty = ([o for o in mine if (o.hidden == NONE.name) == lacks] for lacks in (False, True))
        closed = f"{100.0 * np.median([o.closed for o in hidden]):.1f} %" if hidden else "–"
        rows.append((
            NAMES_OF_PLAY[play], method, f"{sum(o.right for o in hidden)} of {len(hidden)}",
            f"{sum(o.named and not o.right for o in hidden)}", closed,
            f"{sum(o.named for o in empty)} of {len(empty)}", f"{np.median([o.cpu for o in mine]):.1f}",
        ))  # fmt: skip
    head = ("play", "method", "right first", "wrong names", "closed, median", "names where nothing is", "CPU s, median")
    return table(head, rows)


def measure(seed: int, hidden: Sequence[str], plays: Sequence[str], methods: Sequence[str]) -> list[Outcome]:
    """A case of each hypothesis hidden at each amount of play; each is printed as it is solved."""
    outcomes = []
    for name in hidden:
        for play in plays:
            for o in solved(play, name, made(seed, play, name), methods):
                outcomes.append(o)
                print(
                    f"{NAMES_OF_PLAY[play]:5s} {name:20s} {o.method:13s} {o.first:25s} {o.margin:11.1f}"
                    f" {o.before:6.2f} -> {o.after:6.2f}  {o.cpu:.1f} s",
                    flush=True,
                )
    return outcomes


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=501)
    parser.add_argument("--hidden", nargs="+", default=[NONE.name, *TOLD], choices=(NONE.name, *LIBRARY))
    parser.add_argument("--plays", nargs="+", default=list(NAMES_OF_PLAY), choices=NAMES_OF_PLAY)
    parser.add_argument("--without", nargs="+", default=[], choices=list(METHODS)[1:], help="methods left out")
    parser.add_argument("--quick", action="store_true", help="the first effect and an empty case, healthy play")
    options = parser.parse_args()
    hidden, plays = ([NONE.name, TOLD[0]], ["healthy"]) if options.quick else (options.hidden, options.plays)
    methods = [method for method in METHODS if method not in options.without]
    print(summary(measure(options.seed, hidden, plays, methods)))


if __name__ == "__main__":
    main()
