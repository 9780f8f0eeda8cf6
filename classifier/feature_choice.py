"""Which features suit a data set, where a training is not told.

Simulated records get the paper's: linear densities every 1 Hz up to 100 Hz. Measured records get what holds on a sensor
that the training never saw:

    logarithms   a sensor's gain and its way to the machine multiply the densities; on a logarithmic scale they add a
                 constant, and a weak line counts as much as a strong one
    band         up to 0.4 of the sampling rate, where the filter of `datagen.ingest` is still flat: which band a fault
                 rings in is not known beforehand
    resolution   8 over the duration of a record, so that each density is the mean of 15 half-overlapping segments, as
                 with the paper's 8.2 s and 1 Hz; never finer than 400 lines over the band, as more inputs than there
                 are records only teach noise

Whatever is given is taken as it is.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Any, ClassVar

from classifier.dataset import Dataset
from classifier.features import FEATURES, Features, Psd, make_features
from indexer_env.build import from_mapping
from indexer_records.resample import PASSBAND

SEGMENTS = 8
"""Lengths of a segment in a measured record: half as many leave 7 means a density and errors of 2 dB, twice as many
widen each line to twice the bandwidth."""

LINES = 400
"""Most lines over the band of a measured record."""


@dataclass(frozen=True)
class Auto:
    """Power spectral densities whose numbers follow the records; the fields are those of `Psd`, None: as suits them."""

    kind: ClassVar[str] = "auto"

    resolution_hz: float | None = None
    maximum_hz: float | None = None
    scale: str | None = None

    def __post_init__(self) -> None:
        # Each number is judged alone here, the two together once the records are known.
        self.over(Psd(resolution_hz=1e-300, maximum_hz=1e300))

    def over(self, suited: Psd) -> Psd:
        """These densities with what is given here in place of their own. Raises ParameterError."""
        given = {field.name: getattr(self, field.name) for field in fields(self)}
        return replace(suited, **{name: value for name, value in given.items() if value is not None})

    def features_for(self, dataset: Dataset) -> Psd:
        """The densities for a data set. Raises ParameterError where what is given contradicts what suits it."""
        if not dataset.measured:
            return self.over(Psd())
        rate, duration = dataset.sample_rate, dataset.records.shape[-1] / dataset.sample_rate
        maximum = PASSBAND * rate if self.maximum_hz is None else self.maximum_hz
        resolution = max(SEGMENTS / duration, maximum / LINES) if self.resolution_hz is None else self.resolution_hz
        return self.over(Psd(resolution, maximum, "log"))


FeatureChoice = Features | Auto
"""Features, or the rule that finds them once the data set is known."""


def make_choice(mapping: Mapping[str, Any]) -> FeatureChoice:
    """Features or their rule from a plain mapping, as in conf/features. Raises ParameterError."""
    if not isinstance(mapping, Mapping) or mapping.get("kind") != Auto.kind:
        return make_features(mapping, (*FEATURES, Auto.kind))
    return from_mapping(Auto, {key: value for key, value in mapping.items() if key != "kind"}, owner="features")


def chosen(choice: FeatureChoice, dataset: Dataset) -> Features:
    """The features of a choice for a data set. Raises ParameterError."""
    return choice.features_for(dataset) if isinstance(choice, Auto) else choice


def told(choice: FeatureChoice, features: Features, dataset: Dataset) -> str:
    """One line about features that were chosen by rule; empty where they were given."""
    if not isinstance(choice, Auto) or not isinstance(features, Psd):
        return ""
    why = "as suits measured records; features=psd takes the paper's" if dataset.measured else "as in the paper"
    lines = f"every {features.resolution_hz:.3g} Hz up to {features.maximum_hz:.4g} Hz"
    return f"features: {features.scale} PSD {lines}, {why}"
