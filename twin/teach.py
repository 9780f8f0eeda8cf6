"""The stage in which networks learn, and thresholds are taken from turns that none was taught on."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import torch
from safetensors.numpy import save
from safetensors.torch import save as save_weights
from torch import nn

from datagen.progress import progress
from indexer_env import OperatingPoint
from indexer_env.errors import SignalError
from twin.card import scores
from twin.components import Components, patterns_of
from twin.data import OWN_LOAD, Turns
from twin.faults import Fault
from twin.folder import NETWORKS, PAPER, networks_of, synthesis_of
from twin.growth import growth_of
from twin.judge import Judge, ensemble, judge_of, looked_at
from twin.learn import Feed, View, trained
from twin.nuisance import Nuisance
from twin.refine import fitted
from twin.settings import Settings
from twin.synthesis import Synthesis
from twin.turns import Healthy
from twin.weigh import Weights, weights_of
from twin.workplace import keep

GROWN = 600
"""Control turns that tell what the posterior leaves open beside faults, at most."""

NOISES = 50
"""Draws of the noise for each component: a covariance of fewer makes what is left of a turn look larger."""

FITTED, LEAST_FITTED, OF_EACH = 1.0 / 300.0, 160, 30
"""Control turns that are fitted by simulation, for names, intervals and novelty, as share of the simulated ones, how
many at least, and how many for each fault of the table, of half of them at most; some tenths of a second of a core
each."""


def learned(
    out: Path, faulty: Turns, sound: Turns, faults: Sequence[Fault], healthy: Healthy, view: View, settings: Settings
) -> dict[str, Any]:
    """Networks and synthesis as files of `out`, and what learned.yaml says of them."""
    s = settings
    # Each network is taught by one thread: several threads on one batch wait for each other more than they work.
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        with progress(f"learning ({len(NETWORKS)} networks)", len(NETWORKS) * s.epochs, "epochs") as advance:

            def teach(name: str) -> None:
                kind, _, number = name.partition("_")
                tell = (lambda epoch: None) if name == PAPER else (lambda epoch: advance(1))
                network = trained(kind, faulty, view, epochs=s.epochs, seed=s.seed + int(number), advance=tell)
                keep(out / f"{name}.safetensors", save_weights(network.state_dict()))

            with ThreadPoolExecutor(len(NETWORKS)) as pool:
                missing = [name for name in (*NETWORKS, PAPER) if not (out / f"{name}.safetensors").exists()]
                list(pool.map(teach, missing))
    finally:
        torch.set_num_threads(threads)
    networks = networks_of(out, NETWORKS, len(faults), healthy.cells)
    paper = networks_of(out, [PAPER], len(faults), healthy.cells)
    told = {"false_alarms": s.false_alarms, "coverage": s.coverage, "seed": s.seed}
    judge = judge_of(networks, faulty, sound, view, **told)
    control = np.flatnonzero(faulty.subset == 1)
    asked = max(LEAST_FITTED, OF_EACH * len(faults), round(FITTED * len(faulty.x)))
    few, apart = np.split(control, [min(asked, len(control) // 2)])
    half = len(sound.x) // 2
    synthesis = _synthesis(
        out, networks, sound.part(np.arange(half)), faulty.part(apart[-GROWN:]), faults, healthy, view, s
    )
    weights, refined = weights_by_control(
        networks, judge, synthesis, faulty.part(few), sound.part(np.arange(half, len(sound.x))), view, s.coverage,
        s.seed, out / "data" / "fits",
    )  # fmt: skip
    return {
        "judge": judge.plain(), "paper_judge": judge_of(paper, faulty, sound, view, **told).plain(),
        "weights": weights.plain(), "records": len(faulty.x),
        "taught": {"noise": view.noise, "shift": float(view.shift), "radius": healthy.sensor.radius},
        "scores": {
            "twin": scores(refined, few, faulty),
            "networks": scores(*looked_at(networks, faulty, view, control, s.seed + 2, 1), faulty),
            "paper": scores(*looked_at(paper, faulty, view, control, s.seed + 2, 1), faulty),
        },
    }  # fmt: skip


def noisy(
    networks: Sequence[nn.Module], turns: Turns, view: View, seed: int
) -> tuple[np.ndarray, dict[str, np.ndarray], list[OperatingPoint]]:
    """Turns x (n, stations, cells) with noise, what networks say of them, and their operating points."""
    feed, generator = Feed(turns, view), torch.Generator().manual_seed(seed)
    x, conditions = feed.noisy(torch.arange(len(turns.x)), generator)
    return x.double().numpy(), ensemble(networks, x, conditions), [turns.points[k] for k in turns.point]


def _synthesis(
    out: Path, networks: Sequence[nn.Module], sound: Turns, faulty: Turns, faults: Sequence[Fault], healthy: Healthy,
    view: View, settings: Settings,
) -> Synthesis:  # fmt: skip
    """Along the axes of the first network; healthy turns say how wide it may miss."""
    of_mean, of_station = (getattr(networks[0], name).double().numpy() for name in ("mean_axes", "own_axes"))
    components = Components(of_mean, of_station, patterns_of(healthy.machine, faults))
    feed, own_load = Feed(sound, view), OWN_LOAD * settings.load_uncertainty
    rows, generator = torch.arange(len(sound.x)), torch.Generator().manual_seed(settings.seed + 3)
    rounds = math.ceil(NOISES * components.count / len(rows))
    noise = [components.of(feed.noise(feed.point, generator).double().numpy()) for _ in range(rounds)]
    both = np.concatenate(noise), components.of(feed.clean(rows).double().numpy())
    covariance, open_ = (np.ascontiguousarray(m.T @ m / len(m)) for m in both)
    nothing, nuisance = np.zeros_like(covariance), Nuisance.of(out / "posterior.parquet", own_load)
    plain = Synthesis(
        healthy, faults, view.remains.sigma, components, covariance, open_, nothing, view.shapes, nuisance
    )
    clean = Feed(faulty, view).clean(torch.arange(len(faulty.x))).double().numpy()
    growth = growth_of(plain, clean, [faulty.points[k] for k in faulty.point], faulty.size, faulty.station)
    held = {**dataclasses.replace(plain, growth=growth).arrays(), "own_load": np.array([own_load])}
    keep(out / "synthesis.safetensors", save(held))
    return synthesis_of(out, faults, healthy, view)


def weights_by_control(
    networks: Sequence[nn.Module], judge: Judge, synthesis: Synthesis, control: Turns, sound: Turns, view: View,
    coverage: float, seed: int, folder: Path,
) -> tuple[Weights, dict[str, np.ndarray]]:  # fmt: skip
    """What fits are worth, from control turns that raise an alarm and from healthy ones, and what is then said of all
    control turns; `folder` keeps the fits."""
    x, told, points = noisy(networks, control, view, seed + 4)
    seen = np.flatnonzero(told["any"] > judge.alarm)
    if not len(seen):
        raise SignalError(
            f"The twin cannot tell any of its faults: none of {len(x)} simulated turns with faults of all sizes raises "
            "an alarm; record with less noise, or name other faults (faults=)."
        )
    told = {name: value[seen] for name, value in told.items()}
    with progress("weighing", len(seen), "turns") as advance:
        fits = fitted(synthesis, x[seen], [points[k] for k in seen], told, advance, folder)
    quiet, _, _ = noisy(networks, sound, view, seed + 5)
    left = [of.unexplained(quiet) for of in (synthesis, synthesis.of_mean())]
    weights = weights_of(fits, control.there[seen], control.size[seen], left, coverage)
    # without an alarm nothing is named
    logits = np.full(control.there.shape, -np.inf)
    logits[seen] = weights.logits(fits)
    return weights, {"faults": logits}
