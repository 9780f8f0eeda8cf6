"""The interface: fleet, trends, turns, alarms. Every answer is JSON; what a caller gets wrong is one sentence."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import JSONResponse, Response, StreamingResponse
from starlette.routing import Route

from indexer_cli.json_values import finite
from indexer_env.errors import ParameterError
from monitor.alarms import Event
from monitor.alarms.condition import plain
from monitor.analysis.finding import Diagnoser
from monitor.engine import Engine
from monitor.intake.blocks import is_text
from monitor.intake.states import WORDS
from monitor.pipeline import Pipeline
from monitor.plan import Plan
from monitor.store import Store
from monitor.web import views
from monitor.web.access import COOKIE, Gate, Person
from monitor.web.hub import MOST_PAGES, Hub

MOST_ROWS = 1000
LARGEST_BODY = 8192


@dataclass(eq=False)
class Api:
    """The handlers and what they need; `physical`: whether physics is asked about machines; `troubles`: what keeps
    samples from coming or from being stored."""

    store: Store
    engine: Engine
    diagnoser: Diagnoser
    plan: Plan
    hub: Hub
    gate: Gate
    physical: bool = False
    troubles: Callable[[], list[str]] = list

    def routes(self) -> list[Route]:
        """All routes of the interface."""
        machine = "/api/machines/{machine}"
        return [
            Route("/api/fleet", self.fleet),
            Route(machine + "/trends", self.trends),
            Route(machine + "/turns", self.turns),
            Route(machine + "/physics", self.physics),
            Route(machine + "/turns/{number:int}", self.turn),
            Route(machine + "/alarms/{quantity}", self.act, methods=["POST"]),
            Route("/api/events", self.events),
            Route("/api/sign-in", self.sign_in, methods=["POST"]),
            Route("/events", self.stream),
        ]

    async def fleet(self, request: Request) -> Response:
        """Every machine, the limits and who asks."""
        machines = await run_in_threadpool(self.store.machines)
        person: Person = request.state.person
        return _json(
            {
                "now_ns": time.time_ns(),
                "machines": machines,
                "limits": views.limits(self.plan),
                "units": dict(self.diagnoser.units),
                "physics": self.physical,
                "states": WORDS,
                "person": {"name": person.name, "operator": person.operator},
                "troubles": self.troubles(),
                "engine": {"waiting": self.engine.waiting, "failed": self.engine.failure is not None},
            }
        )

    async def trends(self, request: Request) -> Response:
        """Trends of a machine."""
        found = await run_in_threadpool(views.trends, self.store, request.path_params["machine"], self.plan)
        return _json(found) if found is not None else _no("there is no such machine")

    async def turns(self, request: Request) -> Response:
        """The last turns of a machine, newest first."""
        before, count = _number(request, "before", None), _number(request, "count", 50)
        if before is False or count is False or count is None:
            return _no("before and count must be whole numbers from 1 on, count at most 1000", 400)
        found = await run_in_threadpool(self.store.turns, request.path_params["machine"], before, count)
        return _json({"turns": found})

    async def turn(self, request: Request) -> Response:
        """One turn with its record and spectrum."""
        machine, number = request.path_params["machine"], request.path_params["number"]
        if not 0 < number < 2**62:
            return _no("there is no such turn")
        found = await run_in_threadpool(views.turn, self.store, machine, number)
        return _json(found) if found is not None else _no("there is no such turn")

    async def physics(self, request: Request) -> Response:
        """What physics has said of a machine, newest first."""
        found = await run_in_threadpool(self.store.explanations, request.path_params["machine"])
        return _json({"answers": found})

    async def events(self, request: Request) -> Response:
        """What happened to alarms, newest first."""
        count = _number(request, "count", 200)
        if count is False or count is None:
            return _no("count must be a whole number from 1 to 1000", 400)
        machine = request.query_params.get("machine")
        return _json({"events": await run_in_threadpool(self.store.events, machine, count)})

    async def act(self, request: Request) -> Response:
        """An operator acknowledges, has repaired, shelves, unshelves or notes: {"action": …, "note": …, "hours": …}."""
        person: Person = request.state.person
        if not person.operator:
            return _no("only an operator may do this", 403)
        body = await _body(request)
        if isinstance(body, Response):
            return body
        todo = _action(body, person.name)
        if todo is None:
            return _no("action must be acknowledge, repaired, shelve, unshelve or note", 400)
        machine, quantity = request.path_params["machine"], request.path_params["quantity"]
        try:
            happened = await run_in_threadpool(
                self.engine.command, machine, quantity, lambda pipeline: todo(pipeline, quantity)
            )
        except ParameterError as error:
            return _no(str(error), 400)
        return _json(plain(happened))

    async def sign_in(self, request: Request) -> Response:
        """A session for a token: {"token": …}."""
        body = await _body(request)
        if isinstance(body, Response):
            return body
        token = body.get("token")
        found = self.gate.sign_in(token) if is_text(token) else None
        if found is None:
            return _no("this token is not known", 401)
        response = _json({"name": found[1].name, "operator": found[1].operator})
        # the monitor itself speaks HTTP; behind a proxy the browser tells by which way it came
        secure = request.headers.get("origin", "").startswith("https://")
        response.set_cookie(COOKIE, found[0], httponly=True, samesite="strict", secure=secure)
        return response

    async def stream(self, request: Request) -> Response:
        """Changes as they happen."""
        if self.hub.pages >= MOST_PAGES:
            return _no(f"more than {MOST_PAGES} pages are open", 503)
        return StreamingResponse(self.hub.listen(), media_type="text/event-stream")


def _action(body: dict[str, Any], user: str) -> Callable[[Pipeline, str], Event] | None:
    now, note = time.time_ns(), body.get("note", "")
    return {
        "acknowledge": lambda pipeline, name: pipeline.conditions[name].acknowledge(pipeline.time_at(now), user, note),
        "repaired": lambda pipeline, name: pipeline.watch.repair(name, pipeline.time_at(now), user, note),
        "shelve": lambda pipeline, name: pipeline.conditions[name].shelve(
            pipeline.time_at(now), body.get("hours", 8.0), user, note
        ),
        "unshelve": lambda pipeline, name: pipeline.conditions[name].unshelve(pipeline.time_at(now), user),
        "note": lambda pipeline, name: pipeline.conditions[name].note(pipeline.time_at(now), user, note),
    }.get(str(body.get("action")))


async def _body(request: Request) -> dict[str, Any] | Response:
    if request.headers.get("content-type", "").partition(";")[0].strip() != "application/json":
        return _no("the body must be application/json", 415)
    content = b""
    async for piece in request.stream():
        content += piece
        if len(content) > LARGEST_BODY:
            return _no(f"the body must have at most {LARGEST_BODY} bytes", 413)
    try:
        body = json.loads(content)
    except (ValueError, RecursionError):
        body = None
    return body if isinstance(body, dict) else _no("the body must be a JSON object", 400)


def _number(request: Request, key: str, default: int | None) -> int | bool | None:
    text = request.query_params.get(key)
    if text is None:
        return default
    if not (text.isascii() and text.isdigit() and len(text) < 19 and int(text) >= 1):
        return False
    return int(text) if key != "count" or int(text) <= MOST_ROWS else False


def _json(body: object, status: int = 200) -> JSONResponse:
    return JSONResponse(finite(body), status)


def _no(sentence: str, status: int = 404) -> JSONResponse:
    return JSONResponse({"error": sentence}, status)
