// @vitest-environment happy-dom
import { beforeEach, describe, expect, test, vi } from "vitest";

import { Screen, bestCodec } from "../static/screen.js";

/** @import { FrameMessage } from "../static/protocol.js" */

/** A decoder whose pictures become ready when the test calls `ready`. */
class Decoder {
  /** @type {Decoder[]} */
  static all = [];
  static isConfigSupported = vi.fn(async () => ({ supported: true }));
  state = "configured";
  /** @type {number[]} */
  came = [];

  /** @param {{ output: (image: object) => void, error: () => void }} on */
  constructor(on) {
    this.on = on;
    Decoder.all.push(this);
  }

  configure() {}

  /** @param {{ timestamp: number, type: string }} chunk */
  decode({ timestamp, type }) {
    if (type === "delta" && !this.came.length) throw new Error("a key frame is required");
    this.came.push(timestamp);
  }

  /** @param {number} timestamp */
  ready(timestamp) {
    this.on.output({ timestamp, close() {} });
  }

  close() {
    this.state = "closed";
  }
}

/** @param {number} number @param {boolean} key @param {"h264" | "jpeg"} codec @returns {FrameMessage} */
const frame = (number, key, codec = "h264") =>
  ({ type: "frame", number, key, codec, width: 320, height: 240, step: 0, input: 0, milliseconds: 0, data: new Uint8Array(3) });

/** @type {HTMLCanvasElement} */
let canvas;
const [drawImage, shown, failed] = [vi.fn(), vi.fn(), vi.fn()];
/** @type {Screen} */
let screen;
const decoder = () => Decoder.all.at(-1);

beforeEach(() => {
  vi.clearAllMocks();
  Decoder.all = [];
  vi.stubGlobal("VideoDecoder", Decoder);
  vi.stubGlobal("EncodedVideoChunk", class { constructor(/** @type {object} */ values) { Object.assign(this, values); } });
  vi.stubGlobal("createImageBitmap", async () => ({ close() {} }));
  vi.stubGlobal("isSecureContext", true);
  canvas = document.createElement("canvas");
  canvas.getContext = /** @type {any} */ (() => ({ drawImage }));
  screen = new Screen(canvas, (found) => shown(found.number), failed);
});

describe("choice of the video codec", () => {
  test("H.264 is requested if the browser can decode it", async () => {
    expect(await bestCodec()).toBe("h264");
  });

  test.each([
    ["the browser does not support H.264", () => Decoder.isConfigSupported.mockResolvedValueOnce({ supported: false })],
    ["the browser cannot determine its support", () => Decoder.isConfigSupported.mockRejectedValueOnce(new Error())],
    ["the page is not secure", () => vi.stubGlobal("isSecureContext", false)],
  ])("JPEG is requested if %s", async (_, given) => {
    given();
    expect(await bestCodec()).toBe("jpeg");
  });
});

test("JPEG frames are drawn at their own size", async () => {
  await screen.show(frame(1, true, "jpeg"));
  expect(drawImage).toHaveBeenCalledOnce();
  expect([canvas.width, canvas.height]).toEqual([320, 240]);
  expect(shown).toHaveBeenCalledWith(1);
});

test("an outdated frame is not drawn but is reported as shown", async () => {
  await Promise.all([screen.show(frame(1, true)), screen.show(frame(2, false)), screen.show(frame(3, false))]);
  for (const number of [1, 3, 2]) decoder()?.ready(number);
  expect(drawImage).toHaveBeenCalledTimes(2);
  expect(shown.mock.calls.flat()).toEqual([1, 3, 2]);
});

test("a new video stream starts with its first key frame", async () => {
  await screen.show(frame(1, false));
  expect(decoder()).toBeUndefined();
  await screen.show(frame(2, true));
  const first = decoder();
  await screen.show(frame(1, true));
  expect(first?.state).toBe("closed");
  expect(decoder()?.came).toEqual([1]);
  decoder()?.ready(7); // a frame of the previous stream
  expect(drawImage).not.toHaveBeenCalled();
});

test("an error of the decoder is reported so that the page can switch to JPEG", async () => {
  await screen.show(frame(1, true));
  decoder()?.on.error();
  expect(failed).toHaveBeenCalledTimes(1);
  const broken = decoder();
  if (broken) broken.decode = () => { throw new Error(); };
  await screen.show(frame(2, false));
  expect(failed).toHaveBeenCalledTimes(2);
});

test("frames are requested in display pixels, up to the server's maximum size", () => {
  vi.stubGlobal("devicePixelRatio", 2);
  canvas.getBoundingClientRect = () => new DOMRect(0, 0, 640.3, 5000);
  expect(screen.size).toEqual({ width: 1281, height: 8192 });
});
