"""kill -9 with a real broker loses and doubles no turn; `python -m benchmarks.monitor kill` does it 30 times."""

import pytest

from benchmarks.monitor import kill
from benchmarks.monitor.programs import MOSQUITTO, POSTGRES

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(MOSQUITTO is None, reason="needs Mosquitto: apt-get install mosquitto"),
]


@pytest.mark.parametrize(
    "target",
    [
        "monitor",
        "broker",
        pytest.param(
            "database",
            marks=pytest.mark.skipif(POSTGRES is None, reason="needs PostgreSQL: apt-get install postgresql"),
        ),
    ],
)
def test_kills_lose_and_double_no_turn(target):
    found = kill.measure(target, kills=2, machines=2, speed=3.0, seed=5)
    assert (found["lost"], found["doubled"], found["holes"]) == (0, 0, 0)
    assert found["turns"] == found["turns_expected"] > 4
