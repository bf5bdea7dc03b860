"""Prometheus metrics and recent log messages, which contain no data that identifies participants."""

import logging
import time
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import partial

from prometheus_client import CollectorRegistry, Counter, Gauge, Histogram, ProcessCollector, generate_latest
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from experiments.visit.store import Counts
from experiments.web.server.player import Meter
from experiments.web.server.sessions import Sessions

LATENCIES = (0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 3.0, 10.0)  # histogram buckets, in seconds
KEPT = 50  # number of recent warnings and errors to keep


@dataclass(frozen=True)
class Fault:
    """A warning or an error that was logged."""

    at: datetime
    level: str
    text: str


class ServerMetrics(Meter):
    """The metrics of a server since its start."""

    def __init__(self) -> None:
        registry = self._registry = CollectorRegistry()
        ProcessCollector(registry=registry)
        gauge, counter = partial(Gauge, registry=registry), partial(Counter, registry=registry)
        histogram = partial(Histogram, buckets=LATENCIES, registry=registry)
        self._people = gauge("mjsim_people", "Participants by status.", ["status"])
        self._places = gauge("mjsim_places", "Places of cells by state.", ["cell", "state"])
        self._sessions = gauge("mjsim_sessions", "Sessions on this server, by phase.", ["phase"])
        self._capacity = gauge("mjsim_sessions_capacity", "Limit of sessions on this server.")
        self._held = gauge("mjsim_sessions_held", "Sessions with a slot on this server.")
        self._waiting = gauge("mjsim_sessions_waiting", "Sessions waiting for a slot on this server.")
        self._lost = counter("mjsim_workers_lost", "Workers that died during a session.")
        self._faults = counter("mjsim_log", "Warnings and errors in the log.", ["level"])
        self._inputs = histogram(
            "mjsim_input_acknowledged_seconds", "Time from an input until it is on disk."
        )
        self._writes = histogram("mjsim_database_write_seconds", "Duration of write transactions.")
        self._answers = histogram(
            "mjsim_http_answer_seconds", "Response time of participants' requests.", ["status"]
        )
        self.log = FaultLog(self._faults)

    def acknowledged(self, seconds: float) -> None:
        self._inputs.observe(seconds)

    def worker_lost(self) -> None:
        self._lost.inc()

    def wrote(self, seconds: float) -> None:
        self._writes.observe(seconds)

    def answered(self, status: int, seconds: float) -> None:
        self._answers.labels(f"{status // 100}xx").observe(seconds)

    def text(self, counts: Counts, sessions: Sessions) -> bytes:
        """Return all metrics in the Prometheus text format."""
        for gauge in (self._people, self._places, self._sessions):
            gauge.clear()
        for status, number in counts.statuses.items():
            self._people.labels(status).set(number)
        for cell, count in counts.cells.items():
            for state in ("held", "finished", "released"):
                self._places.labels(str(cell), state).set(getattr(count, state))
        for session in sessions.under_way.values():
            self._sessions.labels(session.state.phase).inc()
        self._capacity.set(sessions.limit.count)
        self._held.set(len(sessions.limit.held))
        self._waiting.set(sessions.limit.waiting)
        return generate_latest(self._registry)


class FaultLog(logging.Handler):
    """A log handler that counts warnings and errors and keeps the most recent ones."""

    def __init__(self, counter: Counter) -> None:
        super().__init__(logging.WARNING)
        self._counter = counter
        self._kept: deque[Fault] = deque(maxlen=KEPT)

    @property
    def latest(self) -> Sequence[Fault]:
        return list(self._kept)[::-1]

    def emit(self, record: logging.LogRecord) -> None:
        level = record.levelname.lower()
        self._counter.labels(level).inc()
        self._kept.append(Fault(datetime.fromtimestamp(record.created, UTC), level, record.getMessage()))


class Timed:
    """An ASGI middleware that measures response times."""

    def __init__(self, app: ASGIApp, metrics: ServerMetrics) -> None:
        self._app, self._metrics = app, metrics

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        began = time.monotonic()

        async def timed_send(message: Message) -> None:
            if message["type"] == "http.response.start":
                self._metrics.answered(message["status"], time.monotonic() - began)
            await send(message)

        await self._app(scope, receive, timed_send)
