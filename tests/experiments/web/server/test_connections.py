"""Requests that never end, and machines that open too many connections."""

import asyncio
from contextlib import asynccontextmanager, suppress

import pytest
import uvicorn
from starlette.responses import PlainTextResponse

from experiments.web.server.guards import Guards, TimedConnection

HEAD = b"POST / HTTP/1.1\r\nHost: localhost\r\nOrigin: http://localhost\r\n"
WHOLE = HEAD + b"Content-Length: 0\r\n\r\n"
PAGE = PlainTextResponse("a page")


@asynccontextmanager
async def serving(page=PAGE):
    config = uvicorn.Config(
        Guards(page, None),
        port=0,
        http=TimedConnection,
        lifespan="off",
        log_level="error",
        timeout_keep_alive=1,
        timeout_graceful_shutdown=1,
    )
    server = uvicorn.Server(config)
    task = asyncio.create_task(server.serve())
    while not server.started:
        await asyncio.sleep(0.01)
    try:
        yield server.servers[0].sockets[0].getsockname()[1]
    finally:
        server.should_exit = True
        await task


async def ask(port, request, machine="127.0.0.1"):
    reader, writer = await asyncio.open_connection("127.0.0.1", port, local_addr=(machine, 0))
    writer.write(request)
    return reader, writer


@pytest.mark.parametrize(
    "request_", [b"", HEAD, HEAD + b"Content-Length: 9\r\n\r\nopene", WHOLE + HEAD], ids=repr
)
def test_a_request_that_does_not_end_is_closed(monkeypatch, request_):
    monkeypatch.setattr("experiments.web.server.guards.REQUEST_TIMEOUT", 0.2)

    async def answer():
        async with serving() as port:
            reader, _ = await ask(port, request_)
            with suppress(ConnectionResetError):
                while await asyncio.wait_for(reader.read(999), 3.0):
                    pass

    asyncio.run(answer())


def test_an_answer_may_take_longer_than_a_request(monkeypatch):
    monkeypatch.setattr("experiments.web.server.guards.REQUEST_TIMEOUT", 0.2)

    async def slow_page(scope, receive, send):
        await asyncio.sleep(0.6)
        await PAGE(scope, receive, send)

    async def answer():
        async with serving(slow_page) as port:
            reader, _ = await ask(port, WHOLE)
            return await asyncio.wait_for(reader.readline(), 5.0)

    assert asyncio.run(answer()).startswith(b"HTTP/1.1 200")


def test_who_opens_most_connections_makes_room(monkeypatch):
    monkeypatch.setattr("experiments.web.server.guards.MAX_OPEN", 10)

    async def answer():
        async with serving() as port:
            reader, writer = await ask(port, HEAD, "127.0.0.2")
            flood = [await ask(port, HEAD) for _ in range(50)]
            writer.write(b"Content-Length: 0\r\n\r\n")
            first = await asyncio.wait_for(reader.readline(), 3.0)
            return first, sum(not other.at_eof() and other.exception() is None for other, _ in flood)

    first, left = asyncio.run(answer())
    assert first.startswith(b"HTTP/1.1 200") and left <= 10
