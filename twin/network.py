"""The networks: the modes of the turn, and the paper's own on the spectrum.

Either one takes x (n, stations, cells) in units of the noise and conditions (n, 2), and gives, for each record,

    faults    (n, f)   logit of each fault
    any       (n,)     logit of any fault at all
    size      (n, f)   size t of each, were it there; spread (n, f) ln of its error
    station   (n, s)   logit of each cam turn for what belongs to one station; None where the network cannot tell

in two steps: `sees` turns x into what the layers see (n, z), `says` that into what is told. A network is taught on what
it sees, which is made once.
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

MODES, STATION_MODES = 64, 24
"""Principal components of the mean cam turn and of a station's difference from it: those that simulated faults excite
above the noise (the 65th of the mean is at 0.7 of it)."""

_LARGE = 8.0
"""Noises from which on a component is squeezed in the second of its two squeezed forms: the first one's middle is a
small fault's, the second's a large one's."""


@dataclass
class Told:
    """What a network says; see the module."""

    faults: Tensor
    any: Tensor
    size: Tensor
    spread: Tensor
    station: Tensor | None


def mean_turn(x: Tensor) -> Tensor:
    """The mean cam turn (n, cells) in units of its own noise."""
    return x.mean(dim=1) * math.sqrt(x.shape[1])


def axes(rows: Tensor, count: int) -> tuple[Tensor, Tensor]:
    """Principal axes (cells, count) of rows (n, cells) about nothing, and the rms along each."""
    values, vectors = torch.linalg.eigh(rows.T @ rows / len(rows))
    return vectors.flip(1)[:, :count].contiguous(), values.flip(0)[:count].clamp(min=0.0).sqrt()


class Modes(nn.Module):
    """Three layers on the principal components of the mean cam turn and of the stations' differences from it.

    The components are linear in the turn, so the layers see a large fault as exactly as a small one; what the stations
    differ by is pooled over them by mean square and maximum, so a turn may begin at any station.
    """

    mean_axes: Tensor
    mean_rms: Tensor
    own_axes: Tensor

    exact = True
    """Noise may be added to what is seen, as that is linear in x."""

    def __init__(self, faults: int, cells: int, stations: int, width: int = 256) -> None:
        super().__init__()
        self.stations = stations
        kept = min(MODES, cells), min(STATION_MODES, cells)
        self.register_buffer("mean_axes", torch.eye(cells)[:, : kept[0]].contiguous())
        self.register_buffer("mean_rms", torch.ones(kept[0]))
        self.register_buffer("own_axes", torch.eye(cells)[:, : kept[1]].contiguous())
        seen = 3 * kept[0] + 2 * kept[1] + 3
        self.layers = nn.Sequential(
            nn.BatchNorm1d(seen), nn.Linear(seen, width), nn.SiLU(), nn.Linear(width, width), nn.SiLU(),
            nn.Linear(width, width), nn.SiLU(), nn.Linear(width, 3 * faults + 1),
        )  # fmt: skip
        self.place = nn.Sequential(nn.Linear(2 * kept[1], 32), nn.SiLU(), nn.Linear(32, 1))

    def fit(self, x: Tensor) -> None:
        """Take the axes from turns x without noise."""
        along, rms = axes(mean_turn(x), self.mean_axes.shape[1])
        self.mean_axes.copy_(along)
        self.mean_rms.copy_(rms.clamp(min=1.0))
        apart = (x - x.mean(dim=1, keepdim=True)).flatten(0, 1)
        self.own_axes.copy_(axes(apart, self.own_axes.shape[1])[0])

    def sees(self, x: Tensor) -> Tensor:
        """See the module."""
        apart = (x - x.mean(dim=1, keepdim=True)) @ self.own_axes
        return torch.cat([mean_turn(x) @ self.mean_axes, apart.flatten(1)], dim=1)

    def says(self, z: Tensor, conditions: Tensor) -> Told:
        """See the module."""
        k = self.mean_axes.shape[1]
        mean, own = z[:, :k], z[:, k:].reshape(len(z), self.stations, -1)
        squeezed = torch.asinh(own)
        heads = self.layers(torch.cat([
            mean / self.mean_rms, torch.asinh(mean), torch.asinh(mean / _LARGE),
            torch.log(own.pow(2).mean(dim=1) + 0.3), squeezed.abs().amax(dim=1),
            torch.log1p(mean.pow(2).mean(dim=1).sqrt())[:, None], conditions,
        ], dim=1))  # fmt: skip
        f = (heads.shape[1] - 1) // 3
        level = own.pow(2).mean(dim=(1, 2), keepdim=True).sqrt()
        place = self.place(torch.cat([squeezed, own / (level + 1.0)], dim=2))[:, :, 0]
        return Told(heads[:, :f], heads[:, -1], heads[:, f : 2 * f], heads[:, 2 * f : 3 * f], place)

    def forward(self, x: Tensor, conditions: Tensor) -> Told:
        """See the module."""
        return self.says(self.sees(x), conditions)


class Paper(nn.Module):
    """The paper's network (section 4): the power spectrum of the whole turn, one hidden layer of logistic nodes."""

    exact = False

    def __init__(self, faults: int, cells: int, stations: int, width: int = _HIDDEN) -> None:
        super().__init__()
        self.scale = nn.BatchNorm1d(_BANDS + 2)
        self.hidden = nn.Linear(_BANDS + 2, width)
        self.head = nn.Linear(width, 3 * faults + 1)

    def fit(self, x: Tensor) -> None:
        """The spectrum needs nothing of the turns."""

    def sees(self, x: Tensor) -> Tensor:
        """See the module."""
        spectrum = torch.fft.rfft(x.flatten(1), norm="ortho")[:, 1:].abs() ** 2
        return torch.log(nn.functional.adaptive_avg_pool1d(spectrum[:, None], _BANDS)[:, 0] + 0.1)

    def says(self, z: Tensor, conditions: Tensor) -> Told:
        """See the module."""
        heads = self.head(torch.sigmoid(self.hidden(self.scale(torch.cat([z, conditions], dim=1)))))
        f = (heads.shape[1] - 1) // 3
        return Told(heads[:, :f], heads[:, -1], heads[:, f : 2 * f], heads[:, 2 * f : 3 * f], None)

    def forward(self, x: Tensor, conditions: Tensor) -> Told:
        """See the module."""
        return self.says(self.sees(x), conditions)


NETWORKS: dict[str, type[Modes] | type[Paper]] = {"modes": Modes, "paper": Paper}
"""By the name that tables have."""
