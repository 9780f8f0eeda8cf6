"""The networks: a convolution along each cam turn, pooled over the stations, and the paper's own on the spectrum.

Either one takes x (n, stations, cells) in units of the noise and conditions (n, 2), and gives, for each record,

    faults    (n, f)   logit of each fault
    any       (n,)     logit of any fault at all
    size      (n, f)   size t of each, were it there; spread (n, f) ln of its error
    station   (n, s)   logit of each cam turn for what belongs to one station; None where the network cannot tell
    seen      (n, c)   what it takes the mean cam turn to be without noise, to tell what it has never seen; or None
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import torch
from torch import Tensor, nn

_HIDDEN = 20
"""Nodes of the paper's hidden layer (section 4)."""

_BANDS = 100
"""Frequencies of the paper's network (section 4: the spectrum up to 100 Hz)."""


@dataclass
class Told:
    """What a network says; see the module."""

    faults: Tensor
    any: Tensor
    size: Tensor
    spread: Tensor
    station: Tensor | None
    seen: Tensor | None


def squeezed(x: Tensor) -> Tensor:
    """Linear near nothing and logarithmic where a fault is hundreds of times the noise."""
    return torch.asinh(x)


def both(x: Tensor, size: Tensor) -> Tensor:
    """What a stack sees of rows (n, cells): how large they are, and their shape whatever their size (n, 2, cells);
    `size` (n, 1) is the rms that the shape is relative to."""
    return torch.stack([squeezed(x), 3.0 * x / torch.sqrt(size**2 + 1.0)], dim=1)


def mean_turn(x: Tensor) -> Tensor:
    """The mean cam turn (n, cells) in units of its own noise."""
    return x.mean(dim=1) * math.sqrt(x.shape[1])


class Convolution(nn.Module):
    """Four strided convolutions on each cam turn and on the mean one; what they give is pooled over the stations by
    mean and maximum, so a turn may begin at any station."""

    def __init__(self, faults: int, cells: int, width: int = 64) -> None:
        super().__init__()
        self.each, self.mean = _stack(cells, width), _stack(cells, width)
        self.joint = nn.Sequential(nn.Linear(3 * width + 4, 2 * width), nn.ReLU(), nn.Dropout(0.1))
        self.head = nn.Linear(2 * width, 3 * faults + 1)
        self.place = nn.Linear(2 * width, 1)
        self.decode = nn.Sequential(nn.Linear(2 * width, 2 * width), nn.ReLU(), nn.Linear(2 * width, cells))

    def forward(self, x: Tensor, conditions: Tensor) -> Told:
        """See the module."""
        n, stations, cells = x.shape
        size = x.pow(2).mean(dim=(1, 2)).sqrt()[:, None]
        turns = self.each(both(x.reshape(n * stations, cells), size.repeat_interleave(stations, dim=0)))
        turns = turns.reshape(n, stations, -1)
        whole = mean_turn(x)
        mean = self.mean(both(whole, whole.pow(2).mean(dim=1, keepdim=True).sqrt()))
        joint = self.joint(
            torch.cat([turns.mean(dim=1), turns.amax(dim=1), mean, torch.log1p(size), _level(whole), conditions], dim=1)
        )
        heads = self.head(joint)
        f = (heads.shape[1] - 1) // 3
        apart = torch.cat([turns - turns.mean(dim=1, keepdim=True), turns], dim=2)
        return Told(
            heads[:, :f], heads[:, -1], heads[:, f : 2 * f], heads[:, 2 * f : 3 * f],
            self.place(apart)[:, :, 0], self.decode(joint),
        )  # fmt: skip


def _level(whole: Tensor) -> Tensor:
    return torch.log1p(whole.pow(2).mean(dim=1, keepdim=True).sqrt())


def _stack(cells: int, width: int) -> nn.Sequential:
    sizes = ((2, 16, 15, 4), (16, 32, 7, 2), (32, 48, 5, 2), (48, width, 3, 2))
    parts: list[nn.Module] = []
    for into, out, kernel, stride in sizes:
        parts += [nn.Conv1d(into, out, kernel, stride, kernel // 2), nn.BatchNorm1d(out), nn.ReLU()]
    left = cells
    for *_, stride in sizes:
        left = -(-left // stride)
    return nn.Sequential(*parts, nn.Flatten(), nn.Linear(left * width, width), nn.ReLU())


class Paper(nn.Module):
    """The paper's network (section 4): the power spectrum of the whole turn, one hidden layer of logistic nodes."""

    def __init__(self, faults: int, cells: int, width: int = _HIDDEN) -> None:
        super().__init__()
        self.scale = nn.BatchNorm1d(_BANDS + 2)
        self.hidden = nn.Linear(_BANDS + 2, width)
        self.head = nn.Linear(width, 3 * faults + 1)

    def forward(self, x: Tensor, conditions: Tensor) -> Told:
        """See the module."""
        n = len(x)
        spectrum = torch.fft.rfft(x.reshape(n, -1), norm="ortho")[:, 1:].abs() ** 2
        bands = nn.functional.adaptive_avg_pool1d(spectrum[:, None], _BANDS)[:, 0]
        heads = self.head(
            torch.sigmoid(self.hidden(self.scale(torch.cat([torch.log(bands + 0.1), conditions], dim=1))))
        )
        f = (heads.shape[1] - 1) // 3
        return Told(heads[:, :f], heads[:, -1], heads[:, f : 2 * f], heads[:, 2 * f : 3 * f], None, None)


NETWORKS: dict[str, type[nn.Module]] = {"cnn": Convolution, "paper": Paper}
"""By the name that tables have."""
