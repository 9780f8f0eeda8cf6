"""Thirty turns of a machine whose play grows, sent to a broker block by block as a logger would.

    python examples/send_turns.py [HOST [PORT]]

A block a second of the machine's time, a hundred times faster than real time; needs the extra [monitor].
"""

import dataclasses
import json
import math
import sys
import time

import numpy as np

from indexer_env import Faults, load_machine, load_sensor, simulate


def turns(count: int) -> np.ndarray:
    """So many turns as the bench's sensor reads them [m/s²]; the play grows from 0 to 10 degrees at the motor shaft."""
    machine = dataclasses.replace(load_machine("reference"), model="B_on_base")
    worn = (Faults(backlash=math.radians(10.0 * turn / (count - 1))).applied_to(machine) for turn in range(count))
    motion = np.concatenate([simulate(one).table_acceleration for one in worn])
    return load_sensor("bench").read(motion, 1000.0, np.random.default_rng(0)).values


def main(host: str = "127.0.0.1", port: str = "1883", count: int = 30) -> None:
    """Send them."""
    try:
        import paho.mqtt.client as mqtt
        from paho.mqtt.enums import CallbackAPIVersion
    except ImportError:
        raise SystemExit(
            "error: this example needs the package paho-mqtt; run: pip install -e '.[monitor]' -c constraints.txt."
        ) from None
    if not port.isdecimal() or not 0 < int(port) < 65536:
        raise SystemExit(f"error: PORT must be a whole number from 1 to 65535, got {port}.")
    client = mqtt.Client(CallbackAPIVersion.VERSION2, "logger")
    try:
        client.connect(host, int(port))
    except OSError as error:
        raise SystemExit(
            f"error: no broker can be reached at {host}:{port} ({error}); start the monitor first."
        ) from None
    client.loop_start()
    samples, start = turns(count), time.time()
    for sequence, first in enumerate(range(0, len(samples), 1000)):
        block = samples[first : first + 1000]
        message = {
            "time": start + first / 1000.0,
            "rate": 1000,
            "unit": "m/s^2",
            "sequence": sequence,
            "values": block.round(4).tolist(),
        }
        client.publish("plant/press-9/acceleration", json.dumps(message), qos=1).wait_for_publish(30)
        time.sleep(0.01)
    client.disconnect()
    client.loop_stop()


if __name__ == "__main__":
    main(*sys.argv[1:3])
