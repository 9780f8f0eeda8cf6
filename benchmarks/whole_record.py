"""An indexing machine's records fitted whole: one start state for each record, as if the machine had no play."""

from __future__ import annotations

import numpy as np

from discrepancy.indexer import IndexerModel
from discrepancy.indexer.windows import Windows


class WholeRecordModel(IndexerModel):
    """`IndexerModel` whose windows are whole records, from the first window's start to the last one's end.

    Everything else is the model's own, so that what differs is the length of a window alone. Not for `extended`.
    """

    def _cut(self) -> None:
        super()._cut()
        w = self.windows
        of_record = [np.flatnonzero(w.record == r) for r in np.unique(w.record)]
        begin = np.array([windows[0] for windows in of_record])
        end = np.array([windows[-1] for windows in of_record])
        self.windows = Windows(
            w.record[begin], w.first[begin], w.first[end] + w.count[end] - w.first[begin], w.turn[begin]
        )
        self.counts, self.groups = self.windows.count, self.windows.record
        self._measured = np.zeros((len(begin), int(self.counts.max())))
        for k, (record, first, count) in enumerate(zip(self.groups, self.windows.first, self.counts, strict=True)):
            self._measured[k, :count] = self.experiments[record].signal.values[first : first + count]
        self._inside = np.arange(self._measured.shape[1]) < self.counts[:, None]
        # what a filter remembers has passed away long before a record ends
        self._periods = self._periods * np.array([len(windows) for windows in of_record])
