"""What a stored classifier can say beyond its outputs: parts such as a severity, a confidence or a novelty.

A part is fitted in training, is stored in the two files of its model and looks at what the network sees and says.
Parts need not derive from `Part`, they only have to have its methods; PARTS finds them by their ``kind``.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Any, ClassVar, Protocol, runtime_checkable

import numpy as np

from classifier.dataset import Dataset
from classifier.tasks.confidence import Confidence
from classifier.tasks.convolution import Convolution
from classifier.tasks.need import NotAvailable
from classifier.tasks.novelty import NOVEL, Novelty
from classifier.tasks.range import OUTSIDE, Range
from classifier.tasks.remaining import Remaining
from classifier.tasks.severity import Severity
from indexer_env.checks import check_choice
from indexer_env.errors import refuse


@runtime_checkable
class Part(Protocol):
    """A frozen object that judges records by their features and the network's outputs.

    kind  the name by which PARTS finds its class
    """

    kind: ClassVar[str]

    @classmethod
    def fit(cls, dataset: Dataset, features: np.ndarray, outputs: np.ndarray, seed: int) -> Part:
        """A part fitted to a data set. Raises NotAvailable where its records or columns do not allow it.

        features (n, count)  scaled as the network sees them
        outputs  (n, bits)   of the trained network, on the scale of the bits
        seed                 of whatever is drawn
        """
        ...

    @classmethod
    def restore(cls, body: Mapping[str, Any], arrays: Mapping[str, np.ndarray]) -> Part:
        """The part that gave this body and these arrays, equal to it bit for bit."""
        ...

    def body(self) -> dict[str, Any]:
        """All of it that is no array: texts, numbers, flags, lists and mappings, as YAML holds them."""
        ...

    def arrays(self) -> dict[str, np.ndarray]:
        """Its arrays by name."""
        ...

    def assess(self, features: np.ndarray, outputs: np.ndarray, records: np.ndarray) -> dict[str, np.ndarray]:
        """What it says of records (n, samples) with features (n, count) and outputs (n, bits): named columns, each with
        first axis n. Names that end in ``_low`` and ``_high`` are the ends of an interval for the column without the
        ending.
        """
        ...


PARTS: dict[str, type[Part]] = {part.kind: part for part in (Confidence, Range, Novelty, Severity, Remaining)}
"""Classes of parts by their kind, in the order in which they are fitted where none is asked for by name."""

ON_REQUEST: dict[str, type[Part]] = {Convolution.kind: Convolution}
"""Those that are fitted only where they are asked for: they take longer than the network itself."""


GUARDS: dict[str, str] = {Range.kind: OUTSIDE, Novelty.kind: NOVEL}
"""Columns that say whether a record is unlike all that was taught, by the kind of their part. Without one of these
parts a model gives every record the nearest name."""


NOT_ASKED_FOR = "not asked for"
"""Why a part is left out that the training was told to leave out."""

NEW_MACHINES = f"{Severity.kind} of new machines"
"""Under which name it is told that the intervals of severities are not promised for them."""


def known_parts() -> dict[str, type[Part]]:
    """All classes of parts by their kind."""
    return {**PARTS, **ON_REQUEST}


def check_kinds(kinds: object) -> Sequence[str] | None:
    """The kinds of parts that are asked for; None: all that a data set allows. Raises ParameterError."""
    if kinds is None:
        return None
    if isinstance(kinds, str) or not isinstance(kinds, Sequence):
        remedy = "write parts=[] for none, parts=null for all that the data set allows"
        raise refuse("classifier", "parts", f"a list of {', '.join(known_parts())}, or null", kinds, remedy)
    for kind in kinds:
        check_choice("classifier", "parts", kind, known_parts())
        if kinds.count(kind) > 1:
            raise refuse("classifier", "parts", "a list that names each part once", list(kinds))
    return kinds


def fit_parts(
    dataset: Dataset,
    features: np.ndarray,
    outputs: np.ndarray,
    kinds: Sequence[str] | None = None,
    seed: int = 0,
    without: Collection[str] = (),
) -> tuple[tuple[Part, ...], dict[str, str]]:
    """Parts fitted to a data set, given the scaled features (n, count) and the outputs (n, bits) of all its records;
    and which of PARTS are left out or promise less than they might, with the reason.

    kinds    which; None: all of PARTS that the records and columns of the data set allow
    without  those of PARTS that are left out all the same

    Raises ParameterError for an unknown kind, one named twice, and one that the data set does not allow.
    """
    check_kinds(kinds)
    fitted, left_out = [], {}
    wanted = [kind for kind in (PARTS if kinds is None else kinds) if kind not in without]
    for kind in wanted:
        try:
            fitted.append(known_parts()[kind].fit(dataset, features, outputs, seed))
        except NotAvailable as reason:
            if kinds is not None:
                remedy = f"add such records to the data set, or leave {kind} out"
                raise refuse(
                    "classifier", "parts", f"parts that the data set allows ({reason})", kind, remedy
                ) from None
            left_out[kind] = f"not available, {reason}"
    if any(part.kind == Severity.kind for part in fitted) and (reason := Severity.unpromised(dataset)):
        left_out[NEW_MACHINES] = f"not promised, {reason}"
    left_out |= {kind: NOT_ASKED_FOR for kind in PARTS if kind not in wanted}
    return tuple(fitted), left_out
