"""One alarm as an MQTT message, kept by the broker until those who want it have it (quality of service 1)."""

from __future__ import annotations

import json
from typing import Any

from indexer_cli.json_values import finite
from monitor.sources.mqtt import Broker

CHANNEL = "mqtt"
_TIMEOUT_S = 10.0


class MqttDelivery:
    """Publishes under TOPIC/MACHINE/QUANTITY. Calling it raises OSError where the broker does not take it."""

    def __init__(self, broker: Broker, topic: str, client_id: str) -> None:
        self._topic = topic.rstrip("/")
        self._client = broker.client(f"{client_id}-alarms", keep_session=False)
        broker.connect(self._client, keep_session=False)

    def __call__(self, message: dict[str, Any]) -> None:
        """Deliver one message."""
        if not self._client.is_connected():
            # The client would keep the message, and one more of it for each time that it is tried again.
            raise OSError("the broker is not connected")
        topic = f"{self._topic}/{message['machine'].replace('+', '_')}/{message['quantity']}"
        sent = self._client.publish(topic, json.dumps(finite(message)), qos=1)
        try:
            sent.wait_for_publish(_TIMEOUT_S)
        except (RuntimeError, ValueError) as error:
            raise OSError(str(error)) from None
        if not sent.is_published():
            raise OSError("the broker did not answer")

    def close(self) -> None:
        """Leave the broker."""
        self._client.disconnect()
        self._client.loop_stop()
