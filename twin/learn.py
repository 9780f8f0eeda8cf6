"""Learning: Adam on turns whose noise, shift and residual are drawn anew each time that they are seen."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor, nn

from indexer_env import OperatingPoint
from twin.data import Turns
from twin.network import NETWORKS, Told
from twin.remains import Remains
from twin.turns import shift_shapes

_BATCH = 256
_RATE = 1.5e-2
"""Greatest learning rate of Adam; it rises for a tenth of the steps and then falls along a cosine. At a seventh of it
four times as many epochs are needed for the same error."""

_DECAY = 1e-2
"""Decay of the weights (AdamW's default)."""

_WEIGHTS = {"any": 1.0, "size": 0.3, "station": 0.3}
"""Weights of the losses beside the faults' own."""

_AXES = 4000
"""Turns that the axes are taken from."""

_DRAWING = threading.Lock()
"""First weights are drawn from the one generator that all threads share."""

_NOISES, _LOOKS = 2048, 4
"""Draws of the noise that are mixed by pairs, where what is seen is linear; looks at each turn where it is not."""


@dataclass(frozen=True, eq=False)
class View:
    """What turns go through before a network: residual, noise, shift, unit.

    Attributes
    ----------
    remains : Remains
    shift : float
        Standard deviation of a turn's angle at its ends [rad].
    speeds, loads : (float, float)
        Middle and half width of the range [rad/s, N m]; 0 of a single speed or load.
    """

    remains: Remains
    shift: float
    speeds: tuple[float, float]
    loads: tuple[float, float]

    @property
    def noise(self) -> float:
        """σ of a cell in the middle of the range [unit of the sensor]."""
        return self.remains.sigma(OperatingPoint(self.speeds[0], self.loads[0]))

    def conditions(self, points: Sequence[OperatingPoint]) -> np.ndarray:
        """Speed and load (n, 2) as networks take them, from -1 to 1 over the range: beyond it they see its end, as they
        were taught no other, and of a single speed or load nothing."""
        given = np.array([(p.motor_speed, p.load_torque) for p in points])
        middle, half = np.array([self.speeds, self.loads]).T
        within = np.divide(given - middle, half, out=np.zeros_like(given), where=half > 0.0)
        return np.clip(within, -1.0, 1.0).astype(np.float32)

    def shapes(self, turns: np.ndarray, sigma: float = 1.0) -> np.ndarray:
        """`shift_shapes` of turns (..., stations, cells), in units of their noise σ; of x, which is in these units, σ
        is 1."""
        return (shift_shapes(turns, self.shift) / sigma).astype(np.float32)

    def measured(self, left: np.ndarray, reference: np.ndarray, point: OperatingPoint) -> np.ndarray:
        """x (stations, cells) of a measured turn less ŷ."""
        sigma = self.remains.sigma(point)
        x = torch.from_numpy(((left - self.remains.at(point)) / sigma).astype(np.float32))[None]
        return still(x, torch.from_numpy(self.shapes(reference, sigma))[None])[0].numpy()


def still(x: Tensor, shapes: Tensor) -> Tensor:
    """Turns (n, s, c) without the shift that is most likely, shapes (n, 2, s, c) in units of the noise."""
    D, flat = shapes.flatten(2), x.flatten(1)
    share = torch.linalg.solve(D @ D.transpose(1, 2) + torch.eye(2), (D @ flat[:, :, None]))
    return (flat - (share.transpose(1, 2) @ D)[:, 0]).reshape(x.shape)


class Feed:
    """Batches of turns as a network will see measured ones."""

    def __init__(self, turns: Turns, view: View) -> None:
        self.view = view
        sigma = np.array([view.remains.sigma(point) for point in turns.points], dtype=np.float32)
        self.x = torch.from_numpy(turns.x / sigma[turns.point, None, None])
        self.point = torch.from_numpy(turns.point)
        shapes = [view.shapes(r, float(own)) for r, own in zip(turns.reference, sigma, strict=True)]
        self.shapes = torch.from_numpy(np.array(shapes))
        self.conditions = torch.from_numpy(view.conditions(turns.points))
        cells = turns.x.shape[2]
        parts = np.array([view.remains.parts(point) for point in turns.points])
        self.parts = torch.from_numpy((parts / sigma[:, None, None, None]).astype(np.float32))
        self.colour = torch.from_numpy((view.remains.spectrum / math.sqrt(cells)).astype(np.float32))
        self.there = torch.from_numpy(turns.there.astype(np.float32))
        self.size = torch.from_numpy(turns.size)
        self.station = torch.from_numpy(turns.station)

    def clean(self, rows: Tensor) -> Tensor:
        """x of these rows without noise."""
        return still(self.x[rows], self.shapes[self.point[rows]])

    def shifts(self, rows: Tensor) -> Tensor:
        """What shifts add to these rows (n, 2, stations, cells) beyond what they add to the healthy turn: a shift moves
        what a fault does to the turn, too."""
        own = torch.from_numpy(self.view.shapes(self.x[rows].numpy()))
        return still(own.flatten(0, 1), self.shapes[self.point[rows]].repeat_interleave(2, dim=0)).reshape(own.shape)

    def noise(self, point: Tensor, generator: torch.Generator) -> Tensor:
        """What is measured of nothing at these points: noise, what comes and goes of the residual, shift."""
        shapes, n = self.shapes[point], len(point)
        # a record's part comes and goes by itself: another record may show none of it
        x = torch.einsum("nr,nrsc->nsc", torch.randn((n, self.parts.shape[1]), generator=generator), self.parts[point])
        x = x + torch.einsum("nk,nksc->nsc", torch.randn((n, 2), generator=generator), shapes)
        white = torch.randn(x.shape, generator=generator)
        return still(x + torch.fft.irfft(torch.fft.rfft(white) * self.colour, n=x.shape[2]), shapes)

    def noisy(self, rows: Tensor, generator: torch.Generator) -> tuple[Tensor, Tensor]:
        """x of these rows with noise, and conditions."""
        moved = torch.randn((len(rows), 2, 1, 1), generator=generator) * self.shifts(rows)
        x = self.clean(rows) + self.noise(self.point[rows], generator) + moved.sum(dim=1)
        return x, self.conditions[self.point[rows]]


class Sight:
    """What a network sees of turns, made once: without noise, to which noise is added anew each time where that is
    exact, else several noisy looks."""

    def __init__(self, network: nn.Module, feed: Feed, rows: Tensor, generator: torch.Generator) -> None:
        self.rows, self.generator = rows, generator
        if network.exact:
            self.seen = torch.cat([network.sees(feed.clean(part)) for part in rows.split(512)])  # type: ignore[operator]
            points = feed.point[rows[torch.randint(0, len(rows), (_NOISES,), generator=generator)]]
            parts = [network.sees(feed.noise(part, generator)) for part in points.split(512)]  # type: ignore[operator]
            self.noise = torch.cat(parts)
            self.shifts = torch.stack([
                torch.cat([network.sees(feed.shifts(part)[:, k]) for part in rows.split(512)])  # type: ignore[operator]
                for k in (0, 1)
            ])  # fmt: skip
        else:
            looks = rows.repeat(_LOOKS).split(512)
            self.seen = torch.cat([network.sees(feed.noisy(part, generator)[0]) for part in looks])  # type: ignore[operator]
            self.noise = None

    def at(self, places: Tensor) -> Tensor:
        """What is seen (n, z) of the turns at these places of the rows."""
        n = len(places)
        if self.noise is None:
            return self.seen[places + len(self.rows) * torch.randint(0, _LOOKS, (n,), generator=self.generator)]
        # two draws of a normal law, turned by an angle, are a new draw of it
        angle = 2.0 * math.pi * torch.rand((n, 1), generator=self.generator)
        first, second = torch.randint(0, _NOISES, (2, n), generator=self.generator)
        noise = torch.cos(angle) * self.noise[first] + torch.sin(angle) * self.noise[second]
        moved = torch.randn((2, n, 1), generator=self.generator) * self.shifts[:, places]
        return self.seen[places] + noise + moved.sum(dim=0)


def trained(
    kind: str, turns: Turns, view: View, *, epochs: int, seed: int, advance: Callable[[int], None] = lambda epoch: None
) -> nn.Module:
    """A network of a kind of NETWORKS, taught on the calibration turns; all chance comes from `seed`."""
    feed, generator = Feed(turns, view), torch.Generator().manual_seed(seed)
    rows = torch.from_numpy(np.flatnonzero(turns.subset == 0))
    with _DRAWING, torch.random.fork_rng():
        torch.manual_seed(seed)
        network = NETWORKS[kind](turns.there.shape[1], turns.x.shape[2], turns.x.shape[1])
    with torch.no_grad():
        network.fit(feed.clean(rows[:_AXES]))
        sight = Sight(network, feed, rows, generator)
    optimiser = torch.optim.AdamW(network.parameters(), lr=_RATE, weight_decay=_DECAY)
    steps = epochs * math.ceil(len(rows) / _BATCH)
    # a rise of exactly one step would begin and end at once, which the schedule divides by
    rise = 0.1 if steps != 10 else 0.2
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimiser, _RATE, total_steps=steps, pct_start=rise)
    network.train()
    for epoch in range(epochs):
        for places in torch.randperm(len(rows), generator=generator).split(_BATCH):
            if len(places) == 1:
                continue  # has no variance to normalise a batch by
            part = rows[places]
            optimiser.zero_grad()
            _loss(network.says(sight.at(places), feed.conditions[feed.point[part]]), feed, part).backward()
            nn.utils.clip_grad_norm_(network.parameters(), 5.0)
            optimiser.step()
            schedule.step()
        advance(epoch)
    return network.eval()


def _loss(told: Told, feed: Feed, rows: Tensor) -> Tensor:
    there, size = feed.there[rows], feed.size[rows]
    bce = nn.functional.binary_cross_entropy_with_logits
    total = bce(told.faults, there)
    total = total + _WEIGHTS["any"] * bce(told.any, there.amax(dim=1))
    # Laplace's law: |error|/b + ln b; the size's own spread is learned beside it
    spread = told.spread.clamp(-6.0, 1.0)
    missed = ((told.size - size).abs() * torch.exp(-spread) + spread) * there
    total = total + _WEIGHTS["size"] * missed.sum() / there.sum().clamp(min=1.0)
    if told.station is not None:
        mine = feed.station[rows] >= 0
        if mine.any():
            loss = nn.functional.cross_entropy(told.station[mine], feed.station[rows][mine])
            total = total + _WEIGHTS["station"] * loss
    return total


def said(network: nn.Module, x: Tensor, conditions: Tensor) -> dict[str, np.ndarray]:
    """What a network says of many turns, as arrays by name."""
    parts: dict[str, list[np.ndarray]] = {}
    with torch.no_grad():
        for some, those in zip(x.split(256), conditions.split(256), strict=True):
            told = network(some, those)
            found = {"faults": told.faults, "any": told.any, "size": told.size, "spread": told.spread.clamp(-6.0, 1.0)}
            if told.station is not None:
                found["station"] = told.station
            for name, value in found.items():
                parts.setdefault(name, []).append(value.double().numpy())
    return {name: np.concatenate(values) for name, values in parts.items()}
