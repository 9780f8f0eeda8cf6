"""Binary codes of the classes, and the way back from network outputs to a class.

The paper teaches the network one bit pattern per class (Table 2: class 6 is ``11100``). Each bit is the
target of one output node; a record is given to the class whose code lies nearest to the outputs.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from indexer_env.errors import refuse


@dataclass(frozen=True)
class CodeBook:
    """Classes, their names and their codes, in the order in which everything else in this package counts
    them.

    classes  class labels as they stand in the data set, e.g. (1, 2, 3, 4, 5, 6)
    names    one readable name per class
    codes    one string of 0 and 1 per class, all of one length, no two alike

    Raises ParameterError.
    """

    classes: tuple[int, ...]
    names: tuple[str, ...]
    codes: tuple[str, ...]

    def __post_init__(self) -> None:
        if len(self.classes) < 2:
            raise refuse("CodeBook", "classes", "at least two classes to tell apart", self.classes)
        for name, values in (("names", self.names), ("codes", self.codes)):
            if len(values) != len(self.classes):
                raise refuse("CodeBook", name, f"one entry for each of the {len(self.classes)} classes", values)
        for name, values in (("classes", self.classes), ("codes", self.codes)):
            if len(set(values)) != len(values):
                raise refuse("CodeBook", name, "free of repetitions", values)
        for code in self.codes:
            if not code or set(code) - {"0", "1"} or len(code) != len(self.codes[0]):
                raise refuse("CodeBook", "codes", "strings of 0 and 1 of one length", self.codes)

    @classmethod
    def of_rows(cls, classes: np.ndarray, names: np.ndarray, codes: np.ndarray) -> CodeBook:
        """Code book of a data set, from the class, class name and code of each of its rows (three arrays
        (n,)).

        Raises ParameterError when one class comes with two names or two codes.
        """
        rows = sorted({(int(c), str(n), str(k)) for c, n, k in zip(classes, names, codes, strict=True)})
        return cls(*(tuple(column) for column in zip(*rows, strict=True)))

    @property
    def bits(self) -> int:
        """Number of bits of a code, hence of output nodes."""
        return len(self.codes[0])

    @property
    def matrix(self) -> np.ndarray:
        """Codes as float64 matrix (classes, bits)."""
        return np.array([[float(bit) for bit in code] for code in self.codes])

    def positions(self, classes: np.ndarray) -> np.ndarray:
        """Positions (n,) in this book of class labels (n,). Raises ParameterError for a label that it does
        not hold.
        """
        known = {label: position for position, label in enumerate(self.classes)}
        unknown = sorted({int(label) for label in classes} - set(known))
        if unknown:
            raise refuse("CodeBook", "classes", f"one of {self.classes}", unknown[0])
        return np.array([known[int(label)] for label in classes], dtype=np.int64)

    def targets(self, classes: np.ndarray) -> np.ndarray:
        """Target outputs (n, bits) of class labels (n,)."""
        return self.matrix[self.positions(classes)]

    def distances(self, outputs: np.ndarray) -> np.ndarray:
        """Euclidean distances (n, classes) between outputs (n, bits), each in [0, 1], and every code."""
        return np.linalg.norm(np.asarray(outputs)[:, None, :] - self.matrix[None, :, :], axis=-1)

    def decode(self, outputs: np.ndarray) -> np.ndarray:
        """Positions (n,) of the nearest codes to outputs (n, bits); of two equally near ones the first."""
        return np.argmin(self.distances(outputs), axis=-1)
