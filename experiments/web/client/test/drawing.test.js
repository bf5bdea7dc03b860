// @vitest-environment happy-dom
import { beforeEach, describe, expect, test, vi } from "vitest";

import { Markers } from "../static/drawing/markers.js";
import { lighting } from "../static/drawing/house_material.js";
import { ContactShadows } from "../static/drawing/shadows.js";
import { World3D } from "../static/drawing/world.js";
import { Group, Matrix4, Mesh, Quaternion, Texture, Vector3 } from "../static/vendor/three.js";

/** @import { Marker } from "../static/protocol.js" */
/** @import { Camera, InstancedMesh, Object3D, Scene } from "../static/vendor/three.js" */

/** @type {{ scene: Scene; camera: Camera }[]} */
const drawn = vi.hoisted(() => []);

vi.mock("../static/vendor/three.js", async (original) => ({
  .../** @type {object} */ (await original()),
  WebGLRenderer: class {
    info = { render: { calls: 3, triangles: 12 }, memory: { textures: 1 } };
    setPixelRatio() {}
    setSize() {}
    async compileAsync() {}
    initTexture() {}
    dispose() {}
    getContext() {
      return { getExtension: () => null, getParameter: () => "software", RENDERER: 0 };
    }
    /** @param {Scene} scene @param {Camera} camera */
    render(scene, camera) {
      scene.updateMatrixWorld();
      drawn.push({ scene, camera });
    }
  },
}));

const HEADLIGHT = { ambient: [0.5, 0.5, 0.5], diffuse: [0, 0, 0], specular: [0, 0, 0] };
const SPOT = { type: "spot", position: [0, 0, 2], direction: [0, 0, -1], ambient: [0, 0, 0], diffuse: [1, 1, 1], specular: [0, 0, 0] };
const LIGHT = { ...SPOT, type: "directional", direction: [1, 2, -2] };

/** A GLB with nodes that each have the same triangle. @param {object[]} nodes @param {object} [extras] */
function glb(nodes, extras = {}) {
  const floats = new Float32Array([0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 1, 0, 0, 1, ...Array(12).fill(1)]);
  const view = (/** @type {number} */ byteOffset, /** @type {number} */ byteLength) => ({ buffer: 0, byteOffset, byteLength });
  const accessor = (/** @type {number} */ bufferView, /** @type {string} */ type) => ({ bufferView, type, componentType: 5126, count: 3, min: [0, 0, 0], max: [1, 1, 0] });
  const json = JSON.stringify({
    asset: { version: "2.0" }, scene: 0, scenes: [{ nodes: [nodes.length] }],
    nodes: [...nodes.map((node) => ({ mesh: 0, ...node })), { children: nodes.map((_, i) => i), extras }],
    meshes: [{ primitives: [{ attributes: { POSITION: 0, NORMAL: 1, COLOR_0: 2 }, material: 0 }] }],
    materials: [{ extras: { decal: true }, alphaMode: "BLEND" }],
    accessors: [accessor(0, "VEC3"), accessor(1, "VEC3"), accessor(2, "VEC4")],
    bufferViews: [view(0, 36), view(36, 36), view(72, 48)],
    buffers: [{ byteLength: 120, uri: url("application/octet-stream", new Uint8Array(floats.buffer)) }],
  });
  return url("model/gltf+json", new TextEncoder().encode(json));
}

/** @param {string} type @param {Uint8Array} bytes */
function url(type, bytes) {
  return `data:${type};base64,${btoa(String.fromCharCode(...bytes))}`;
}

/** @param {number} side 1 for the left arm */
const armOf = (side) => ({
  rest: [0.3, 0.2 * side, 1], hanging: [0, 0.2 * side, 0.8], shoulder: [0, 0.2 * side, 1.4], wrist: [-0.1, 0, 0],
  tilt: Math.PI / 2, range: 0.1, half: 0.2, eye_height: 1.6,
});

/** @type {Record<string, string>} */
const FILES = {
  "scene.json": url("application/json", new TextEncoder().encode(JSON.stringify({
    house: "house.glb", person: "person.glb", rooms: [], sky: null, contact_shadow: null,
    objects: { mug: { file: "mug.glb", label: "Mug", bounds: [], boxes: [[0, 0, 0.05, 0.04, 0.04, 0.05, 1, 0, 0, 0]] } },
  }))),
  "house.glb": glb([{ name: "static_kitchen" }, { name: "lamps", extras: { ceiling: true } }], { lights: [LIGHT, SPOT], headlight: HEADLIGHT }),
  "person.glb": glb([1, -1].flatMap((side) => [
    { name: side > 0 ? "left_hand" : "right_hand", extras: { arm: armOf(side) } },
    { name: side > 0 ? "left_sleeve" : "right_sleeve" },
  ])),
  "mug.glb": glb([{ name: "object" }]),
};

/** @returns {HTMLCanvasElement} */
function canvas() {
  const element = document.createElement("canvas");
  element.width = 800;
  element.height = 400;
  element.getContext = /** @type {any} */ (() => ({}));
  element.getBoundingClientRect = () => new DOMRect(0, 0, 800, 400);
  return element;
}

/** Where a point of a thing is in the house. @param {Object3D | undefined} thing @param {number[]} [point] */
function placed(thing, [x, y, z] = [0, 0, 0]) {
  if (!thing) throw new Error("no such part");
  const at = new Vector3(x, y, z).applyMatrix4(thing.matrixWorld);
  return [at.x, -at.z, at.y].map((value) => Math.round(1e6 * value) / 1e6);
}

/** @type {World3D} */
let world;
/** @type {HTMLCanvasElement} */
let element;

beforeEach(async () => {
  drawn.length = 0;
  element = canvas();
  world = new World3D(element);
  world.resize();
  await world.load((name) => FILES[name] ?? "data:,");
});

/** The parts of the scene by name, as last drawn. @param {string} name */
function part(name) {
  world.draw();
  return drawn.at(-1)?.scene.getObjectByName(name);
}

test("without WebGL 2 the page learns it", () => {
  const old = canvas();
  old.getContext = () => null;
  expect(() => new World3D(old)).toThrow("no WebGL 2");
});

test("reports a lost context", () => {
  const lost = vi.fn();
  world.onLost = lost;
  element.dispatchEvent(new Event("webglcontextlost"));
  expect(lost).toHaveBeenCalledOnce();
});

test("the house frame has z up", () => {
  expect(placed(part("static_kitchen"), [1, 2, 3])).toEqual([1, 2, 3]);
  expect(world.info()).toMatchObject({ calls: 3, triangles: 12, renderer: "software" });
});

test("the ceilings can be hidden", () => {
  world.showCeilings(false);
  expect([part("lamps")?.visible, part("static_kitchen")?.visible]).toEqual([false, true]);
});

describe("the eye", () => {
  const eye = { position: [1, 2, 1.6], heading: Math.PI / 2, pitch: 0 };

  test("sees what is ahead in the middle, and left of it what lies to the left", () => {
    world.camera.setEye(eye);
    world.draw();
    expect(world.camera.locate([1, 5, 1.6])).toMatchObject({ x: expect.closeTo(0.5), y: expect.closeTo(0.5), inView: true });
    expect(world.camera.locate([0, 5, 2]).x).toBeLessThan(0.5);
    expect(world.camera.locate([1, 5, 2]).y).toBeLessThan(0.5);
    expect(world.camera.locate([1, 0, 1.6])).toMatchObject({ ahead: false, inView: false });
  });

  test("has the same horizontal field of view in windows of any shape", () => {
    world.camera.setEye(eye);
    world.setFieldOfView(Math.PI / 2);
    for (const height of [400, 800]) {
      element.height = height;
      world.resize();
      expect(world.camera.locate([2, 3, 1.6]).x).toBeCloseTo(1);
    }
  });

  test("a free camera looks at its target with its own field of view", () => {
    world.camera.setFree({ position: [0, 0, 5], target: [0, 0, 0], fovy: Math.PI / 2 });
    expect(world.camera.locate([0, 0, 0])).toMatchObject({ x: expect.closeTo(0.5), y: expect.closeTo(0.5) });
    expect(world.camera.locate([0, 5, 0]).y).toBeCloseTo(0); // north is up
    world.camera.setEye(eye);
    expect(world.camera.locate([1, 5, 1.6]).inView).toBe(true);
  });
});

describe("the arms", () => {
  test("join hands that are in use with the shoulders, in the frame of the body", () => {
    world.setPerson({ x: 1, y: 2, heading: Math.PI / 2, hands: [[0.6, 0.2, 1.4], [0.9, -0.2, 0.5]] });
    expect(placed(part("left_hand"))).toEqual([0.8, 2.6, 1.4]);
    expect(placed(part("right_hand"))).toEqual([1.2, 2.9, 0.5]);
    const ends = (/** @type {string} */ name) => [-0.2, 0.2].map((z) => placed(part(name), [0, 0, z]));
    expect(ends("left_sleeve")).toEqual([[0.8, 2.5, 1.4], [0.8, 2, 1.4]]);
    expect(ends("right_sleeve")).toEqual([[1.2, 2.8, 0.5], [1.2, 2, 1.4]]);
  });

  test("hang at rest while the hands are idle, at the height of the person", () => {
    world.setPerson({ x: 1, y: 2, heading: 0, hands: [[0.3, 0.2, 1], [0.3, -0.2, 1.05]] });
    expect(placed(part("left_hand"))).toEqual([1, 2.2, 0.8]);
    expect(placed(part("left_hand"), [0.1, 0, 0])).toEqual([1, 2.2, 0.7]); // fingers point down
    expect(placed(part("left_sleeve"), [0, 0, -0.2])).toEqual([1, 2.2, 0.9]);
    const [, , half = 0] = placed(part("right_hand"));
    expect(half).toBeCloseTo(0.95); // halfway between both postures
    world.setPerson({ x: 1, y: 2, heading: 0, hands: [[0.3, 0.2, 0.5], [0, 0, 1]], eyeHeight: 0.8 });
    expect(placed(part("left_hand"))).toEqual([1, 2.2, 0.4]);
  });
});

describe("objects", () => {
  const pose = [1, 2, 0, 1, 0, 0, 0];

  test("enter, move, change their model and leave", async () => {
    const loading = world.setObjects({ object_00: { model: "mug", pose } });
    world.draw();
    await loading;
    expect(placed(part("object"))).toEqual([1, 2, 0]);
    world.setPose("object_00", [3, 2, 1, Math.SQRT1_2, 0, 0, Math.SQRT1_2]);
    expect(placed(part("object"), [1, 0, 0])).toEqual([3, 3, 1]);
    world.setPose("object_99", pose); // not known: nothing happens
    await world.loadModels(["mug"]); // known already
    await world.setObjects({});
    expect(part("object")).toBeUndefined();
    await expect(world.setObjects({ object_01: { model: "cup", pose } })).rejects.toThrow("no object model cup");
  });

  test("one is outlined at a time, and the line follows it", async () => {
    await world.setObjects({ object_00: { model: "mug", pose } });
    const parts = () => {
      world.draw();
      let count = 0;
      drawn.at(-1)?.scene.traverse((child) => (count += child instanceof Mesh && placed(child)[0] === 4 ? 1 : 0));
      return count;
    };
    world.setOutline("object_00");
    world.setPose("object_00", [4, 2, 0, 1, 0, 0, 0]);
    expect(parts()).toBe(4); // itself, where it is, two lines
    world.setOutline(null);
    expect(parts()).toBe(1);
  });
});

describe("markers", () => {
  /** @param {Partial<Marker>} more @returns {Marker} */
  const marker = (more) => ({
    shape: "sphere", position: [1, 2, 3], size: [0.04, 0, 0], rgba: [1, 0, 0, 1], role: "breadcrumb", x_ray: false,
    object: null, outlined: false, ...more,
  });
  const markers = new Markers(lighting([], HEADLIGHT));
  const shown = () => markers.children.filter((set) => set.visible).map((set) => /** @type {InstancedMesh} */ (set));

  test("of one shape and kind are one draw", () => {
    markers.show([marker({}), marker({ position: [2, 2, 3] })]);
    expect(shown().map((set) => set.count)).toEqual([2]);
    markers.show([]);
    expect(shown()).toEqual([]);
  });

  test("x-ray ones have a second, faint pass with two lines around it; outlined ones a dark sphere", () => {
    markers.show([marker({ x_ray: true }), marker({ outlined: true }), marker({ shape: "cylinder", rgba: [1, 1, 1, 0.5] })]);
    expect(shown().length).toBe(7);
  });

  test("take their sizes as MuJoCo's geoms do", () => {
    markers.show([marker({ shape: "cylinder", size: [0.1, 0.5, 0] })]);
    const pose = new Matrix4();
    shown()[0]?.getMatrixAt(0, pose);
    expect(new Vector3().setFromMatrixScale(pose).toArray().map((value) => value.toFixed(3))).toEqual(["0.100", "0.100", "0.500"]);
  });
});

test("what a scene has of sky and spots is loaded, and the sky fills what is left of the picture", async () => {
  const pictures = vi.fn(async () => ({ width: 4, height: 24, close() {} }));
  vi.stubGlobal("createImageBitmap", pictures);
  const picture = url("image/webp", new Uint8Array([1]));
  const scene = { ...JSON.parse(atob((FILES["scene.json"] ?? "").split(",")[1] ?? "")), sky: "sky.webp",
    contact_shadow: { rgba: [0, 0, 0, 0.8], border: 0.05, lift: 0.006, reach: 0.3, texture: "spot.webp" } };
  const files = { ...FILES, "scene.json": url("application/json", new TextEncoder().encode(JSON.stringify(scene))), "sky.webp": picture, "spot.webp": picture };
  await world.load((name) => files[/** @type {keyof typeof files} */ (name)] ?? "data:,");
  const calls = /** @type {unknown[][]} */ (pictures.mock.calls);
  const faces = calls.filter((call) => call.length > 2).map((call) => call.slice(1));
  expect(faces).toEqual([0, 4, 8, 12, 16, 20].map((top) => [0, top, 4, 4])); // of the strip
  await world.setObjects({ object_00: { model: "mug", pose: [1, 2, 0, 1, 0, 0, 0] } });
  world.draw();
  const shown = /** @type {any[]} */ ([]);
  drawn.at(-1)?.scene.traverse((child) => shown.push(child));
  expect(shown.find((child) => child instanceof ContactShadows)?.count).toBe(1);
  expect(shown.filter((child) => child.material?.uniforms?.faces).map((sky) => sky.renderOrder)).toEqual([100]);
});

test("a file that cannot be read is named", async () => {
  vi.stubGlobal("fetch", async () => new Response("", { status: 404, statusText: "Not Found" }));
  await expect(world.load((name) => `/scene/${name}`)).rejects.toThrow("/scene/scene.json cannot be read: 404 Not Found");
  vi.unstubAllGlobals();
});

test("a contact shadow is as wide as the object's boxes and fades as that is lifted", () => {
  const settings = { rgba: [0, 0, 0, 0.8], border: 0.05, lift: 0.006, reach: 0.3, texture: "" };
  const shadows = new ContactShadows(lighting([], HEADLIGHT), settings, new Texture());
  const object = new Group();
  const spot = (/** @type {number} */ height, /** @type {number} */ turn) => {
    object.position.set(1, 2, height);
    object.quaternion.setFromAxisAngle(new Vector3(0, 0, 1), turn);
    object.updateMatrix();
    shadows.empty();
    shadows.under(object, [[0, 0, 0.1, 0.2, 0.1, 0.1, 1, 0, 0, 0]]);
    const pose = new Matrix4(), place = new Vector3(), scale = new Vector3();
    shadows.getMatrixAt(0, pose);
    pose.decompose(place, new Quaternion(), scale);
    const opacity = /** @type {number} */ (shadows.geometry.getAttribute("tint").getW(0));
    return [...place.toArray(), scale.x, scale.y, opacity].map((value) => Math.round(1000 * value) / 1000);
  };
  expect(spot(0, 0)).toEqual([1, 2, 0.006, 0.25, 0.15, 0.8]);
  expect(spot(0.15, Math.PI / 2)).toEqual([1, 2, 0.156, 0.15, 0.25, 0.4]);
  spot(0.3, 0);
  expect(shadows.visible).toBe(false);
});
