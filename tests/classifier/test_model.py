import dataclasses
import hashlib
import json

import numpy as np
import pytest
import safetensors.torch
import torch
import yaml

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
        (MODEL_YAML, lambda data: data.replace(b"format: 3", b"format: 2"), "format must be 3, got 2"),
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


def sealed(folder, change):
    """Change what is inside and write both digests anew, as a careful hand would."""
    body = yaml.safe_load((folder / MODEL_YAML).read_text())
    del body["tensors_sha256"]
    tensors = safetensors.torch.load_file(folder / MODEL_TENSORS)
    change(body, tensors)
    digest = hashlib.sha256(json.dumps(body, sort_keys=True).encode()).hexdigest()
    data = safetensors.torch.save(tensors, metadata={"body_sha256": digest})
    (folder / MODEL_TENSORS).write_bytes(data)
    body["tensors_sha256"] = hashlib.sha256(data).hexdigest()
    (folder / MODEL_YAML).write_text(yaml.safe_dump(body))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda body, tensors: body.pop("record"), "it lacks 'record'"),
        (lambda body, tensors: tensors.pop("w2"), "it lacks 'w2'"),
        (lambda body, tensors: tensors.update(w1=tensors["w1"][:, :3].contiguous()), "the number of weights is"),
        (lambda body, tensors: tensors.update({"scaling.low": torch.zeros(3)}), "as long as high"),
        (lambda body, tensors: body["network"].update(hidden=-1), "hidden must be a whole number"),
        (lambda body, tensors: [entry.update(code=entry["code"] + "1") for entry in body["classes"]], "number of bits"),
        (lambda body, tensors: body.update(conditions=None), "model.yaml must be as it was written"),
        (lambda body, tensors: body["parts"].append({"kind": "guess"}), r"parts\.kind must be one of"),
    ],
)
def test_a_model_that_was_sealed_anew_is_refused_where_it_does_not_hold_together(folder, change, words):
    sealed(folder, lambda body, tensors: None)
    assert load_model(folder).samples == 400
    sealed(folder, change)
    with pytest.raises(ModelFileError, match=words) as caught:
        load_model(folder)
    assert "\n" not in str(caught.value)


def test_weights_that_are_none_are_refused(folder):
    (folder / MODEL_TENSORS).write_bytes(b"no tensors")
    body = yaml.safe_load((folder / MODEL_YAML).read_text())
    body["tensors_sha256"] = hashlib.sha256(b"no tensors").hexdigest()
    (folder / MODEL_YAML).write_text(yaml.safe_dump(body))
    with pytest.raises(ModelFileError, match="it holds no tensors"):
        load_model(folder)
