// Stands for static/drawing/world.js where there is no WebGL: remembers what it was told to draw.

import { vi } from "vitest";

import { Group } from "../static/vendor/three.js";

const rooms = [{ polygon: [[0, 0], [2, 0], [2, 2], [0, 2]] }, { polygon: [[4, 0], [6, 0], [6, 2], [4, 2]] }];

export const world = {
  onLost: () => {},
  onRestored: () => {},
  load: vi.fn(async (/** @type {(name: string) => string} */ resolve) => ({ objects: { mug: {} }, rooms, file: resolve("scene.json") })),
  loadModels: vi.fn(), resize: vi.fn(), setFieldOfView: vi.fn(), setObjects: vi.fn(), setPose: vi.fn(), setPerson: vi.fn(),
  setMarkers: vi.fn(), setOutline: vi.fn(), showCeilings: vi.fn(), draw: vi.fn(),
  camera: { setEye: vi.fn(), setFree: vi.fn(), locate: vi.fn(() => ({ x: 0.25, y: 0.5, inView: true })) },
  onFrame: vi.fn((/** @type {(now: number) => void} */ frame) => {
    const next = (/** @type {number} */ now) => (frame(now), requestAnimationFrame(next));
    requestAnimationFrame(next);
  }),
  info: () => ({ renderer: "a card" }),
  stage: { renderer: {}, scene: new Group(), camera: new Group() },
};

export const World3D = vi.fn(function () {
  return world;
});
