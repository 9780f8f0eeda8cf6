"""What the files themselves say about rate and length of the records, where the settings leave it to them."""

from __future__ import annotations

import dataclasses
import statistics
from collections.abc import Sequence

from datagen.ingest.settings import Settings
from datagen.ingest.sources import Source
from datagen.progress import progress
from indexer_env.errors import SignalError, refuse
from indexer_records.measured import read_recording


def check_channels(sources: Sequence[Source], settings: Settings) -> None:
    """Refuse files of which one is to give more channels than another. Raises ParameterError."""
    counts = {max(1, len(source.reading(settings.read).names)): source.name for source in reversed(sources)}
    if len(counts) > 1:
        got = " and ".join(f"{count} for {name}" for count, name in sorted(counts.items()))
        raise refuse("read", "signal_column", "as many channels for each file", got)


def surveyed(sources: Sequence[Source], settings: Settings) -> Settings:
    """The settings with rate and length of the records.

    A rate that is not given is the lowest of all files, so that none lacks the band. Where turns are not cut, each file
    is a record: its length is that of the shortest file which is within `pulse.tolerance` of the median one; shorter
    files are refused when they are cut, longer ones are cut at their end, or give several records.

    Raises
    ------
    SignalError
        No file can be read.
    ParameterError
        Records of so many samples are refused.
    """
    cut = settings.turns_are_cut
    if settings.sample_rate is not None and cut:
        return settings
    rates, durations, problems = [], [], []
    with progress("looking through", len(sources), "files") as advance:
        for source in sources:
            try:
                recording = read_recording(source.path, source.reading(settings.read), settings.pulse.column)
            except SignalError as error:
                problems.append(str(error))
            else:
                rates.append(recording.signals[0].sample_rate)
                durations.append(recording.signals[0].duration)
            advance(1)
    if not rates:
        raise SignalError(
            f"ingest must be given files with at least one record, got none in {len(sources)}; the first: {problems[0]}"
        )
    rate = min(rates) if settings.sample_rate is None else settings.sample_rate
    if cut:
        return dataclasses.replace(settings, sample_rate=rate)
    usual = (1.0 - settings.pulse.tolerance) * statistics.median_low(durations)
    return dataclasses.replace(
        settings, sample_rate=rate, period=min(duration for duration in durations if duration >= usual)
    )
