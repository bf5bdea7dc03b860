import { beforeEach, describe, expect, test, vi } from "vitest";

import { Connection, readFrame } from "../static/connection.js";
import { MAX_INPUTS, REPLACED } from "../static/protocol.js";
import { FakeSocket, frame } from "./page.js";

/** @import { Received } from "../static/connection.js" */
/** @import { FromBrowser } from "../static/protocol.js" */

/** @returns {{ connection: Connection, socket: FakeSocket, received: Received[] }} */
function connected() {
  /** @type {Received[]} */
  const received = [];
  /** @type {() => FromBrowser} */
  const hello = () => ({ type: "leave" });
  const connection = new Connection(hello, (message) => received.push(message));
  connection.open();
  return { connection, socket: FakeSocket.latest(), received };
}

/** @param {FakeSocket} socket */
const numbers = (socket) => socket.inputs.map((input) => input.number);

beforeEach(() => {
  FakeSocket.all = [];
  vi.useFakeTimers();
  vi.stubGlobal("WebSocket", FakeSocket);
  vi.stubGlobal("location", { href: "https://example.org/play/token?debug#here" });
});

describe("inputs", () => {
  test("wait until the session takes them", () => {
    const { connection, socket } = connected();
    expect(connection.input({ forward: 1 }).number).toBe(1);
    socket.state("loading");
    socket.state("ready");
    expect(numbers(socket)).toEqual([]);
    socket.state("running");
    connection.input({});
    expect(numbers(socket)).toEqual([1, 2]);
  });

  test("are kept until they are taken", () => {
    const { connection, socket } = connected();
    socket.state("running");
    for (let i = 0; i < 3; i++) connection.input({});
    socket.receive({ type: "taken", input: 2, step: 1 });
    expect(connection.pending).toBe(1);
  });

  test("are sent again after the connection or the worker was lost", () => {
    const { connection, socket } = connected();
    socket.state("running");
    connection.input({});
    connection.input({});
    socket.receive({ type: "taken", input: 1, step: 1 });
    socket.onclose({ code: 1006 });
    connection.input({});
    vi.runAllTimers();
    FakeSocket.latest().state("paused", "", 2);
    expect(numbers(FakeSocket.latest())).toEqual([2, 3]);
    FakeSocket.latest().state("loading");
    FakeSocket.latest().state("paused", "", 1);
    expect(numbers(FakeSocket.latest())).toEqual([2, 3, 2, 3]);
  });

  test("of a page that was loaded again continue the numbers of the session", () => {
    const { connection, socket } = connected();
    socket.state("running", "", 41);
    expect(connection.input({}).number).toBe(42);
  });

  test("are sent in batches that the server accepts", () => {
    const { connection, socket } = connected();
    for (let i = 0; i < MAX_INPUTS + 1; i++) connection.input({});
    socket.state("running");
    expect(socket.sent.map(({ inputs }) => inputs.length)).toEqual([MAX_INPUTS, 1]);
  });
});

describe("a connection", () => {
  test("goes to the path of the page", () => {
    expect(connected().socket.url).toBe("wss://example.org/play/token");
  });

  test("says hello first", () => {
    const { socket } = connected();
    socket.onopen();
    expect(socket.sent).toEqual([{ type: "leave" }]);
  });

  test("is opened again unless the server closed it for good", () => {
    const { socket, received } = connected();
    socket.onclose({ code: 1006 });
    vi.runAllTimers();
    expect(FakeSocket.all).toHaveLength(2);
    FakeSocket.latest().onclose({ code: REPLACED });
    vi.runAllTimers();
    expect(FakeSocket.all).toHaveLength(2);
    expect(received).toEqual([{ type: "closed" }, { type: "closed" }]);
  });

  test("is tried again less and less often", () => {
    connected();
    const tries = () => FakeSocket.all.length;
    for (let seconds = 0; seconds < 60; seconds++) {
      vi.advanceTimersByTime(1000);
      if (FakeSocket.latest().readyState === 1) FakeSocket.latest().fail();
    }
    expect(tries()).toBeGreaterThan(10);
    expect(tries()).toBeLessThan(25);
  });

  test("is replaced after five seconds without a message, then less often", () => {
    const { connection, socket } = connected();
    /** @param {number} seconds */
    const silent = (seconds) => {
      for (let beat = 0; beat < 2 * seconds; beat++) {
        vi.advanceTimersByTime(500);
        connection.watch(true);
      }
    };
    socket.state("running");
    silent(0.5);
    expect(connection.link).toBe("open");
    silent(1);
    expect(connection.link).toBe("lost");
    socket.receive({ type: "beat" });
    expect(connection.link).toBe("open");
    silent(5);
    expect([FakeSocket.all.length, socket.readyState]).toEqual([2, 3]);
    silent(30);
    expect(FakeSocket.all.length).toBeLessThan(5);
    FakeSocket.latest().state("paused");
    expect(connection.link).toBe("open");
    silent(5);
    expect(connection.link).toBe("lost");
  });

  test.each([["occupied", "occupied"], ["replaced", "replaced"]])("stays silent without being replaced: %s", (type, link) => {
    const { connection, socket } = connected();
    socket.receive({ type });
    vi.advanceTimersByTime(60_000);
    connection.watch(true);
    expect([connection.link, FakeSocket.all.length]).toEqual([link, 1]);
  });

  test("ignores an old socket", () => {
    const { connection, socket, received } = connected();
    connection.close();
    socket.state("running");
    socket.onclose({ code: 1006 });
    vi.runAllTimers();
    expect(received).toEqual([]);
    expect(FakeSocket.all).toHaveLength(1);
  });
});

test("the head of a frame is read", () => {
  const found = readFrame(frame({ number: 7, step: 8, input: 2 ** 40, codec: 2, key: true }));
  expect(found).toMatchObject({
    type: "frame", codec: "h264", key: true, width: 640, height: 480, number: 7, step: 8, input: 2 ** 40, milliseconds: 12.5,
  });
  expect(found.data).toHaveLength(3);
});
