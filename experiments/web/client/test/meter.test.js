import { beforeEach, expect, test, vi } from "vitest";

import { Meter, isStill } from "../static/meter.js";

/** @import { FrameMessage } from "../static/protocol.js" */

/** @type {Meter} */
let meter;
beforeEach(() => {
  vi.useFakeTimers();
  meter = new Meter();
});

/** @param {number} input */
const frame = (input) => /** @type {FrameMessage} */ ({ input, data: new Uint8Array(1000) });

test("the meter reports the frame rate, the times between frames, and the number of dropped frames", () => {
  for (let i = 0; i < 100; i++) {
    vi.advanceTimersByTime(i % 10 === 9 ? 140 : 40);
    meter.came(frame(0));
    if (i < 98) meter.shown(frame(0));
  }
  expect(meter.take()).toEqual({ seconds: 5, frames_per_s: 19.6, frame_ms: 40, frame_ms_95: 140, dropped: 2, latency_ms: null, kilobits: 160 });
  expect(meter.take()).toMatchObject({ frames_per_s: 0, dropped: 0, kilobits: 0 });
});

test("latency is measured once per input, until the first frame that shows it", () => {
  meter.sent(1);
  vi.advanceTimersByTime(10);
  meter.sent(2);
  vi.advanceTimersByTime(50);
  meter.answered(1);
  meter.answered(1);
  vi.advanceTimersByTime(100);
  meter.shown(frame(2));
  expect(meter.take().latency_ms).toBe(60);
  meter.answered(2);
  expect(meter.take().latency_ms).toBeNull();
});

test("a picture of the server that does not change is no slow picture", () => {
  const report = { ...meter.take(), draw: /** @type {"server"} */ ("server") };
  expect(isStill(report)).toBe(true);
  expect(isStill({ ...report, draw: "browser" })).toBe(false);
  expect(isStill({ ...report, latency_ms: 40 })).toBe(false);
  expect(isStill({ ...report, dropped: 1 })).toBe(false);
  expect(isStill({ ...report, frame_ms: 40 })).toBe(false);
});
