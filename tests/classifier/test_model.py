import dataclasses

import numpy as np
import pytest
import torch

from classifier.model import MODEL_TENSORS, MODEL_YAML, ModelFileError, load_model, save_model


@pytest.fixture
def folder(result, tmp_path):
    save_model(result.model, tmp_path)
    return tmp_path


def test_a_loaded_model_gives_the_same_outputs_bit_for_bit(result, dataset, folder):
    loaded = load_model(folder)
    assert np.array_equal(loaded.outputs(dataset.records), result.model.outputs(dataset.records))
    for field in dataclasses.fields(loaded):
        before, after = getattr(result.model, field.name), getattr(loaded, field.name)
        if isinstance(before, torch.Tensor):
            assert torch.equal(before, after)
        elif isinstance(before, np.ndarray):
            assert np.array_equal(before, after)
        elif field.name == "scaling":
            assert np.array_equal(before.low, after.low)
            assert np.array_equal(before.high, after.high)
        elif field.name == "parts":
            assert [(part.kind, part.body()) for part in before] == [(part.kind, part.body()) for part in after]
            for part, again in zip(before, after, strict=True):
                assert part.arrays().keys() == again.arrays().keys()
                assert all(np.array_equal(array, again.arrays()[name]) for name, array in part.arrays().items())
        else:
            assert before == after, field.name


def test_saving_a_loaded_model_gives_the_same_bytes(folder, tmp_path):
    again = tmp_path / "again"
    again.mkdir()
    save_model(load_model(folder), again)
    for name in (MODEL_YAML, MODEL_TENSORS):
        assert (again / name).read_bytes() == (folder / name).read_bytes()


def edit(path, change):
    path.write_bytes(change(path.read_bytes()))


@pytest.mark.parametrize(
    ("name", "change", "words"),
    [
        (MODEL_TENSORS, lambda data: data[:-1], "SHA-256"),
        (MODEL_TENSORS, lambda data: data[:4], "SHA-256"),
        (MODEL_TENSORS, lambda data: b"", "SHA-256"),
        (MODEL_TENSORS, lambda data: data[:-1] + bytes([data[-1] ^ 1]), "SHA-256"),
        (
            MODEL_YAML,
            lambda data: data.replace(b"sample_rate: 200.0", b"sample_rate: 100.0"),
            "not those that were saved",
        ),
        (MODEL_YAML, lambda data: data.replace(b"'011'", b"'111'"), "not those that were saved"),
        (MODEL_YAML, lambda data: data[: data.index(b"features:")], "states no SHA-256"),
        (MODEL_YAML, lambda data: b"", "states no format"),
        (MODEL_YAML, lambda data: b"a: [", "not YAML"),
        (MODEL_YAML, lambda data: b"\xff\xfe\x00", "not YAML"),
        (MODEL_YAML, lambda data: data.replace(b"format: 2", b"format: 3"), "format must be 2, got 3"),
        (MODEL_YAML, lambda data: b"!!python/object/apply:os.getcwd []\n", "not YAML"),
    ],
)
def test_a_truncated_or_edited_file_is_refused_in_one_sentence(folder, name, change, words):
    before = (folder / name).read_bytes()
    edit(folder / name, change)
    assert (folder / name).read_bytes() != before
    with pytest.raises(ModelFileError, match=words) as caught:
        load_model(folder)
    assert str(folder / name) in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", [MODEL_YAML, MODEL_TENSORS])
def test_a_missing_file_is_refused(folder, name):
    (folder / name).unlink()
    with pytest.raises(ModelFileError, match=f"folder that holds {name}"):
        load_model(folder)
