"""Who asks, and what he may.

On localhost without secrets everybody is the operator: whoever is on the host could as well stop the monitor. With
secrets a request must bring a token (header Authorization: Bearer, or the cookie of a sign-in), or come through a proxy
that signs people in, shows its own secret and names the person.
"""

from __future__ import annotations

import hmac
import secrets
from dataclasses import dataclass

from starlette.requests import HTTPConnection

from monitor.settings import Access

COOKIE = "monitor"
_SESSIONS = 1000


@dataclass(frozen=True)
class Person:
    """Who asks: a name for the history, and whether he may act."""

    name: str
    operator: bool


class Gate:
    """Tells who a request comes from."""

    def __init__(self, access: Access) -> None:
        self._access = access
        self._sessions: dict[str, Person] = {}

    def person(self, request: HTTPConnection) -> Person | None:
        """Who it is; None: nobody who may look."""
        if not self._access.needed:
            return Person("local operator", True)
        return self._by_proxy(request) or self._by_token(_bearer(request)) or self._by_cookie(request)

    def sign_in(self, token: str) -> tuple[str, Person] | None:
        """A new session for a token; None: it is no token."""
        person = self._by_token(token)
        if person is None:
            return None
        while len(self._sessions) >= _SESSIONS:
            self._sessions.pop(next(iter(self._sessions)))
        session = secrets.token_urlsafe(32)
        self._sessions[session] = person
        return session, person

    def _by_token(self, token: str | None) -> Person | None:
        if not token:
            return None
        for known, person in (
            (self._access.operator_token, Person("operator", True)),
            (self._access.viewer_token, Person("viewer", False)),
        ):
            if known is not None and _same(token, known):
                return person
        return None

    def _by_cookie(self, request: HTTPConnection) -> Person | None:
        return self._sessions.get(request.cookies.get(COOKIE, ""))

    def _by_proxy(self, request: HTTPConnection) -> Person | None:
        secret, name = request.headers.get("x-proxy-secret"), request.headers.get("x-forwarded-user")
        known = self._access.proxy_secret
        if known is None or not secret or not name or not _same(secret, known):
            return None
        return Person(name[:64], name in self._access.operators)


def _bearer(request: HTTPConnection) -> str | None:
    scheme, _, token = request.headers.get("authorization", "").partition(" ")
    return token.strip() if scheme.lower() == "bearer" else None


def _same(given: str, known: str) -> bool:
    return hmac.compare_digest(given.encode(), known.encode())
