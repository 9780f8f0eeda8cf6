"""One alarm as a signed POST.

Headers: X-Timestamp (seconds since 1970), X-Delivery (a number that a repeated delivery has again) and X-Signature, the
hex HMAC-SHA256 of timestamp, a dot and the body under the shared secret. The receiver should refuse old timestamps.
"""

from __future__ import annotations

import hashlib
import hmac
import http.client
import json
import time
import urllib.error
import urllib.request
from typing import Any

from indexer_cli.json_values import finite
from monitor.outputs.outbox import Refused

CHANNEL = "webhook"
_TIMEOUT_S = 10.0
_REFUSED = (400, 413, 414, 415, 422)
"""Answers that are about the message itself: it will be refused again."""


class WebhookDelivery:
    """Posts to a URL. Calling it raises OSError where the answer is not 2xx, or none of HTTP, and Refused where it is
    about the message itself."""

    def __init__(self, url: str, secret: str) -> None:
        self._url, self._secret = url, secret
        self._opener = urllib.request.build_opener(_NoRedirect)

    def __call__(self, message: dict[str, Any]) -> None:
        """Deliver one message."""
        body = json.dumps(finite(message)).encode()
        stamp = str(int(time.time()))
        headers = {
            "Content-Type": "application/json",
            "X-Timestamp": stamp,
            "X-Delivery": str(message["delivery"]),
            "X-Signature": signature(self._secret, stamp, body),
        }
        request = urllib.request.Request(self._url, body, headers, method="POST")
        try:
            with self._opener.open(request, timeout=_TIMEOUT_S):
                pass
        except urllib.error.HTTPError as error:
            if error.code in _REFUSED:
                raise Refused(f"HTTP {error.code} {error.reason}") from None
            raise
        except http.client.HTTPException as error:
            raise ConnectionError(f"the answer is no HTTP ({type(error).__name__})") from None


def signature(secret: str, stamp: str, body: bytes) -> str:
    """What X-Signature must be."""
    return hmac.new(secret.encode(), stamp.encode() + b"." + body, hashlib.sha256).hexdigest()


class _NoRedirect(urllib.request.HTTPRedirectHandler):
    """An alarm goes where it was told to go, and nowhere else."""

    def redirect_request(self, *_: Any) -> None:
        return None
