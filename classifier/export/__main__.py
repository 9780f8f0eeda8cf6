"""A model as an ONNX file: ``indexer export model=DIR out=FILE.onnx``."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path
from typing import Any

from classifier.model import UNGUARDED, load_model
from indexer_cli.command import check_flag, hydra_command
from indexer_cli.job_paths import path_given
from indexer_env.errors import IndexerError, refuse

SUFFIX = ".onnx"


def run(config: dict[str, Any]) -> None:
    """The command, given its configuration as in conf/export.yaml."""
    out = _check_file(path_given("export", "out", config["out"]), config["overwrite"])
    try:
        import onnx

        from classifier.export.model import guards, left_out, to_onnx
    except ModuleNotFoundError as error:
        if error.name not in ("onnx", "ml_dtypes", "google"):
            raise
        raise IndexerError(
            "classifier.export must have the package onnx, got none; run: pip install 'indexer-diagnosis[onnx]'."
        ) from None
    model = load_model(path_given("export", "model", config["model"]))
    data = onnx.ModelProto.SerializeToString(to_onnx(model, config["input"]))
    _write(out, data)
    print(f"written {out}, {len(data) / 1e6:.1f} MB")
    for name, reason in left_out(model, config["input"]).items():
        print(f"without {name}: {reason}")
    if not guards(model, config["input"]):
        print(UNGUARDED)


def _check_file(out: Path, overwrite: object) -> Path:
    check_flag("export", "overwrite", overwrite)
    if out.suffix != SUFFIX:
        raise refuse("export", "out", f"a file that ends in {SUFFIX}", str(out))
    if out.is_dir():
        raise refuse("export", "out", "a file", str(out), "a folder stands there, choose another name")
    if out.exists() and not overwrite:
        raise refuse("export", "out", "a new file", str(out), "set overwrite=true to replace it, or name another")
    return out


def _write(out: Path, data: bytes) -> None:
    """Write a file that appears whole or not at all."""
    out.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.NamedTemporaryFile(dir=out.parent, prefix=f".{out.name}-", delete=False) as file:
        file.write(data)
    os.chmod(file.name, 0o644)
    os.replace(file.name, out)


main = hydra_command("export")(run)

if __name__ == "__main__":
    main()
