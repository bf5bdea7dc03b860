// @ts-nocheck: types of node are not installed
// A page and its link, for tests of the modules that join them.

import { readFileSync } from "node:fs";
import { gzipSync } from "node:zlib";
import { vi } from "vitest";

import { FRAME_HEAD_BYTES } from "../static/protocol.js";

const template = (name) => readFileSync(`templates/${name}.html`, "utf8");
const sections = readFileSync("../../texts/en.toml", "utf8").split(/^\[(\w+)\]$/m);

/** The English texts of the page of a trial, by name. */
export const TEXTS = Object.fromEntries(
  ["common", "hud", "trial"].flatMap((name) =>
    [...sections[sections.indexOf(name) + 1].matchAll(/^(\w+) = ("""\n(?:.|\n)*?"""|".*")$/gm)].map(([, key, value]) => [
      key,
      JSON.parse(value.replace(/^"""\n|"""$/g, '"').replaceAll("\n", "\\n")),
    ]),
  ),
);

/** Writes the texts into a page, as the server does. */
export function giveTexts() {
  const json = { id: "texts", type: "application/json", textContent: JSON.stringify(TEXTS) };
  document.body.append(Object.assign(document.createElement("script"), json));
}

/** The body of a template as the server gives it, without what its scripts do not need. @param {string} name @param {Record<string, string>} [data] of #play */
export function showPage(name, data = {}) {
  const [, tasks, side] = template("hud").match(/tasks\(\) %}(.*?){% endmacro.*side\(texts\) %}(.*?){% endmacro/s);
  const text = template(name).replace("{{ hud.tasks() }}", tasks).replace("{{ hud.side(texts) }}", side);
  const body = text.match(/<main.*<\/main>/s)?.[0] ?? text;
  const filled = body.replace(/{{ texts\.(\w+) }}/g, (_, key) => TEXTS[key]);
  document.body.innerHTML = filled.replace(/{[{%].*?[%}]}/g, "");
  giveTexts();
  Object.assign(document.getElementById("play")?.dataset ?? {}, data);
}

/** Data as `mjsim view` writes it into its page. @param {object} value */
export const packed = (value) => gzipSync(JSON.stringify(value)).toString("base64");

/** Lets the listeners of a page go with it: call it before the page is loaded, and what it gives afterwards. */
export function watchListeners() {
  const undo = [window, document].flatMap((target) => {
    const added = [];
    const add = target.addEventListener.bind(target);
    const spy = vi.spyOn(target, "addEventListener").mockImplementation((...values) => {
      add(...values);
      added.push(() => target.removeEventListener(...values));
    });
    return [() => spy.mockRestore(), () => added.forEach((remove) => remove())];
  });
  return () => undo.forEach((step) => step());
}

export class FakeSocket {
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

  static latest() {
    const socket = FakeSocket.all.at(-1);
    if (!socket) throw new Error("no socket was opened");
    return socket;
  }

  /** @param {string} text */
  send(text) {
    this.sent.push(JSON.parse(text));
  }

  close() {
    this.readyState = 3;
  }

  /** Closes the connection as a network failure does. */
  fail() {
    this.readyState = 3;
    this.onclose({ code: 1006 });
  }

  /** @param {object} message */
  receive(message) {
    this.onmessage({ data: JSON.stringify(message) });
  }

  /** @param {import("../static/protocol.js").Phase} phase @param {string} [reason] @param {number} [input] */
  state(phase, reason = "", input = 0) {
    this.receive({ type: "state", phase, reason, input });
  }

  /** What was sent of a type. @param {string} type @returns {any[]} */
  all(type) {
    return this.sent.filter((message) => message.type === type);
  }

  /** The inputs that were sent. @returns {any[]} */
  get inputs() {
    return this.all("inputs").flatMap(({ inputs }) => inputs);
  }
}

/** A frame as the server sends it. @param {{ number: number, step?: number, input?: number, codec?: number, key?: boolean }} head */
export function frame({ number, step = 0, input = 0, codec = 1, key = false }) {
  const buffer = new ArrayBuffer(FRAME_HEAD_BYTES + 3);
  const head = new DataView(buffer);
  head.setUint8(1, codec);
  head.setUint8(2, key ? 1 : 0);
  head.setUint16(4, 640, true);
  head.setUint16(6, 480, true);
  head.setUint32(8, number, true);
  head.setUint32(12, step, true);
  head.setBigUint64(16, BigInt(input), true);
  head.setFloat32(24, 12.5, true);
  return buffer;
}
