import numpy as np
import pytest

from classifier.codes import CodeBook
from indexer_env.errors import ParameterError

# Table 2 of the paper.
TABLE_2 = CodeBook(
    (1, 2, 3, 4, 5, 6),
    tuple(f"class {label}" for label in range(1, 7)),
    ("01111", "01110", "11111", "11110", "11101", "11100"),
)


def test_every_code_is_decoded_to_its_own_class():
    labels = np.array([6, 1, 3, 2, 5, 4])
    positions = TABLE_2.decode(TABLE_2.targets(labels))
    assert [TABLE_2.classes[position] for position in positions] == labels.tolist()


def test_the_nearest_code_wins():
    # The outputs which the paper prints for its measured record (§4.3), less the one too many: class 6.
    outputs = np.array([[0.9901, 0.9805, 1.0, 0.0032, 0.0011]])
    assert TABLE_2.classes[TABLE_2.decode(outputs)[0]] == 6
    assert TABLE_2.distances(outputs)[0, 5] == pytest.approx(np.sqrt(0.0099**2 + 0.0195**2 + 0.0032**2 + 0.0011**2))


def test_rows_of_a_data_set_give_the_book_in_order_of_class():
    book = CodeBook.of_rows(np.array([2, 1, 2]), np.array(["b", "a", "b"]), np.array(["10", "01", "10"]))
    assert book == CodeBook((1, 2), ("a", "b"), ("01", "10"))


@pytest.mark.parametrize(
    ("book", "words"),
    [
        (((1,), ("a",), ("0",)), "at least two classes"),
        (((1, 2), ("a",), ("0", "1")), "names must be one entry"),
        (((1, 1), ("a", "b"), ("0", "1")), "classes must be free of repetitions"),
        (((1, 2), ("a", "b"), ("01", "01")), "codes must be free of repetitions"),
        (((1, 2), ("a", "b"), ("01", "1")), "0 and 1 of one length"),
        (((1, 2), ("a", "b"), ("01", "0x")), "0 and 1 of one length"),
    ],
)
def test_a_book_that_cannot_be_decoded_is_refused(book, words):
    with pytest.raises(ParameterError, match=words):
        CodeBook(*book)


def test_a_class_with_two_codes_is_refused():
    with pytest.raises(ParameterError, match="repetitions"):
        CodeBook.of_rows(np.array([1, 1, 2]), np.array(["a", "a", "b"]), np.array(["00", "01", "10"]))


def test_an_unknown_class_is_refused():
    with pytest.raises(ParameterError, match="got 7"):
        TABLE_2.targets(np.array([1, 7]))
