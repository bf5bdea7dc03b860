// Reads the files of a scene: GLBs in mjsim's look, pictures, and what scene.json says of them.

import { GLTFLoader, Group, Mesh, Texture } from "../vendor/three.js";
import { houseMaterial } from "./house_material.js";

/** @import { MeshStandardMaterial, Object3D } from "../vendor/three.js" */
/** @import { Uniforms } from "./house_material.js" */
/** @import { Box, ContactShadow } from "./shadows.js" */
/**
 * @typedef {(name: string) => string} Resolve URL of a file of a scene by its name
 * @typedef {{ file: string; label: string; bounds: number[][]; boxes: Box[] }} ObjectModel
 * @typedef {{ house: string; person: string; objects: Record<string, ObjectModel>; rooms: { label: string; polygon: number[][] }[];
 *   contact_shadow: ContactShadow | null; sky: string | null }} SceneFile what scene.json says
 */

// In the order of drawing: MuJoCo draws flat things on floors before the rest that one can see through.
const DECALS = 1;
const CLEAR = 3;

/** @param {string} url @returns {Promise<SceneFile>} */
export async function readScene(url) {
  return (await fetched(url)).json();
}

/** A picture as it is stored. @param {string} url */
export async function readPicture(url) {
  const picture = await (await fetched(url)).blob();
  return createImageBitmap(picture, { colorSpaceConversion: "none", premultiplyAlpha: "none" });
}

/** @param {string} url */
export async function readTexture(url) {
  const texture = new Texture(await readPicture(url));
  texture.flipY = false;
  texture.needsUpdate = true;
  return texture;
}

/**
 * The content of a GLB, without its root node, which turns z up into y up, and what that node says.
 * @param {string} url
 * @returns {Promise<{ group: Group; extras: Record<string, any> }>}
 */
export async function readModel(url) {
  const { scene } = await new GLTFLoader().loadAsync(url);
  const root = scene.children[0];
  if (!root) throw new Error(`${url} has no node`);
  const group = new Group();
  group.add(...root.children);
  return { group, extras: root.userData };
}

/** Gives everything the look of mjsim. @param {Object3D} group @param {Uniforms} light */
export function dress(group, light) {
  group.traverse((part) => {
    part.updateMatrix();
    part.matrixAutoUpdate = false;
    if (!(part instanceof Mesh)) return;
    const { map, transparent, userData } = /** @type {MeshStandardMaterial} */ (part.material);
    part.material = houseMaterial(light, { map, blend: transparent });
    if (transparent) part.renderOrder = userData["decal"] ? DECALS : CLEAR;
  });
}

/** @param {string} url */
async function fetched(url) {
  const answer = await fetch(url);
  if (!answer.ok) throw new Error(`${url} cannot be read: ${answer.status} ${answer.statusText}`);
  return answer;
}
