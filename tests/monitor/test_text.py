"""How the page writes numbers; its module of texts runs without a browser."""

import json
import shutil
import subprocess
from pathlib import Path

import pytest

import monitor.web

NODE = shutil.which("node")
pytestmark = pytest.mark.skipif(NODE is None, reason="needs Node.js: apt-get install nodejs")


@pytest.mark.parametrize(
    ("name", "size", "said"),
    [
        ("reducer_play", [5.02, 4.98, 5.04], "5.02° (4.98° to 5.04°)"),
        ("reducer_play", [123.4, 120.1, 127.9], "123° (120° to 128°)"),
        ("reducer_play", [1234.0, 1000.0, 1500.0], "1200° (1000° to 1500°)"),
        ("reducer_play", [0.0, 0.0, 0.31], "0° (0° to 0.31°)"),
        ("reducer_play", [5.0, 5.0, 5.0], "5°"),
        ("backlash_deg", [5.02, 4.98, 5.04], "5.02° (4.98° to 5.04°)"),
        ("crack", [0.3, 0.297, 0.304], "30.0 % (29.7 % to 30.4 %)"),
        ("crack", [0.3, 0.27, 0.33], "30 % (27 % to 33 %)"),
    ],
)
def test_a_size_has_the_digits_that_its_interval_needs(tmp_path, name, size, said):
    text = Path(monitor.web.__file__).parent / "static" / "text.js"
    (tmp_path / "text.mjs").write_text(text.read_text(encoding="utf-8"), encoding="utf-8")
    call = f"""
        import {{ setUnits, interval }} from "./text.mjs";
        setUnits({{ reducer_play: "° at the motor shaft" }});
        console.log(interval({json.dumps(name)}, {json.dumps(size)}));
    """
    (tmp_path / "call.mjs").write_text(call, encoding="utf-8")
    done = subprocess.run([str(NODE), "call.mjs"], cwd=tmp_path, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == said
