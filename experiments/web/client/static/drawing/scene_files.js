// Reads the files of a scene: GLBs in mjsim's look, pictures, and what scene.json says of them.

import { GLTFLoader, Group, Mesh, Texture } from "../vendor/three.js";
import { houseMaterial, lighting } from "./house_material.js";

/** @import { Material, MeshStandardMaterial, Object3D } from "../vendor/three.js" */
/** @import { Headlight, Light, Uniforms } from "./house_material.js" */
/** @import { Box, ContactShadow } from "./shadows.js" */
/**
 * @typedef {(name: string) => string} Resolve URL of a file of a scene by its name
 * @typedef {{ file: string; label: string; bounds: number[][]; boxes: Box[] }} ObjectModel
 * @typedef {{ label: string; polygon: number[][] }} Room
 * @typedef {{ house: string; person: string; objects: Record<string, ObjectModel>; rooms: Room[];
 *   contact_shadow: ContactShadow | null; sky: string | null }} SceneFile what scene.json says
 */

const DECALS = 1; // flat things on floors are drawn before other things that one can see through
export const CLEAR = 3;

/** Reads scene.json. @param {Resolve} resolve @returns {Promise<SceneFile>} */
export async function readScene(resolve) {
  return (await fetched(resolve("scene.json"))).json();
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
 * The content of a GLB in the frame of the house, object or hand, without the node that turns it upright.
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

/**
 * Gives everything the look of mjsim.
 * @param {Object3D} group
 * @param {Uniforms} light
 */
export function dress(group, light) {
  /** @type {Map<Material, Material>} */
  const made = new Map();
  group.traverse((part) => {
    part.updateMatrix();
    part.matrixAutoUpdate = false;
    if (!(part instanceof Mesh)) return;
    const source = /** @type {MeshStandardMaterial} */ (part.material);
    const { specular = 0, shininess = 0, emission = 0 } = source.userData;
    let material = made.get(source);
    if (!material) {
      material = houseMaterial(light, {
        map: source.map,
        blend: source.transparent,
        shine: [specular, shininess, emission],
        shines: Boolean(part.geometry.getAttribute("_shine")),
      });
      made.set(source, material);
      source.dispose();
    }
    part.material = material;
    if (material.transparent) part.renderOrder = source.userData["decal"] ? DECALS : CLEAR;
  });
}

/** @param {Record<string, any>} extras of a house's root node */
export function lightingOf(extras) {
  const { lights = [], headlight } = /** @type {{ lights?: Light[]; headlight: Headlight }} */ (extras);
  return lighting(lights, headlight);
}

/** @param {string} url */
async function fetched(url) {
  const answer = await fetch(url);
  if (!answer.ok) throw new Error(`${url} cannot be read: ${answer.status} ${answer.statusText}`);
  return answer;
}
