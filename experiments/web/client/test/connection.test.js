import { beforeEach, describe, expect, test, vi } from "vitest";

import { Connection, readFrame } from "../static/connection.js";
import { FRAME_HEAD_BYTES, MAX_INPUTS, REPLACED } from "../static/protocol.js";

/** @import { Received } from "../static/connection.js" */
/** @import { FromBrowser, Input, Phase } from "../static/protocol.js" */

class FakeSocket {
  static OPEN = 1;
  /** @type {FakeSocket[]} */
  static all = [];
  readyState = 1;
  /** @type {any[]} */
  sent = [];
  onopen = () => {};
  /** @type {(event: { data: any }) => void} */
  onmessage = () => {};
  /** @type {(event: { code: number }) => void} */
  onclose = () => {};

  /** @param {string} url */
  constructor(url) {
    this.url = url;
    FakeSocket.all.push(this);
  }

  /** @param {string} text */
  send(text) {
    this.sent.push(JSON.parse(text));
  }

  close() {
    this.readyState = 3;
  }

  /** @param {object} message */
  receive(message) {
    this.onmessage({ data: JSON.stringify(message) });
  }

  /** @param {Phase} phase @param {number} input */
  state(phase, input = 0) {
    this.receive({ type: "state", phase, reason: "", input });
  }

  /** Numbers of the inputs that were sent. */
  get numbers() {
    const batches = this.sent.filter(({ type }) => type === "inputs");
    return batches.flatMap(({ inputs }) => inputs.map((/** @type {Input} */ input) => input.number));
  }
}

/** @returns {{ connection: Connection, socket: FakeSocket, received: Received[] }} */
function connected() {
  /** @type {Received[]} */
  const received = [];
  /** @type {() => FromBrowser} */
  const hello = () => ({ type: "leave" });
  const connection = new Connection(hello, (message) => received.push(message));
  connection.open();
  return { connection, socket: latest(), received };
}

function latest() {
  const socket = FakeSocket.all.at(-1);
  if (!socket) throw new Error("no socket was opened");
  return socket;
}

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
    expect(socket.numbers).toEqual([]);
    socket.state("running");
    connection.input({});
    expect(socket.numbers).toEqual([1, 2]);
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
    latest().state("paused", 2);
    expect(latest().numbers).toEqual([2, 3]);
    latest().state("loading");
    latest().state("paused", 1);
    expect(latest().numbers).toEqual([2, 3, 2, 3]);
  });

  test("of a page that was loaded again continue the numbers of the session", () => {
    const { connection, socket } = connected();
    socket.state("running", 41);
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
    latest().onclose({ code: REPLACED });
    vi.runAllTimers();
    expect(FakeSocket.all).toHaveLength(2);
    expect(received).toEqual([
      { type: "closed", code: 1006, final: false },
      { type: "closed", code: REPLACED, final: true },
    ]);
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
  const buffer = new ArrayBuffer(FRAME_HEAD_BYTES + 3);
  const head = new DataView(buffer);
  head.setUint8(1, 2);
  head.setUint8(2, 1);
  head.setUint16(4, 640, true);
  head.setUint16(6, 480, true);
  head.setUint32(8, 7, true);
  head.setUint32(12, 8, true);
  head.setBigUint64(16, 2n ** 40n, true);
  head.setFloat32(24, 12.5, true);
  const frame = readFrame(buffer);
  expect(frame).toMatchObject({
    type: "frame", codec: "h264", key: true, width: 640, height: 480, number: 7, step: 8, input: 2 ** 40, milliseconds: 12.5,
  });
  expect(frame.data).toHaveLength(3);
});
