// The look of mjsim's frames: light of OpenGL's fixed functions at every vertex, in the space of the display, clamped
// before the texture. There is no tone mapping, and what one can see through is blended as MuJoCo does it: twice.

import { Matrix3, NoColorSpace, ShaderMaterial, Vector3 } from "../vendor/three.js";
import { upright } from "./camera.js";

/** @import { IUniform, Texture } from "../vendor/three.js" */
/**
 * @typedef {{ type: string; position: number[]; direction: number[]; ambient: number[]; diffuse: number[];
 *   specular: number[]; cutoff?: number; exponent?: number; attenuation?: number[] }} Light in the house frame; the last
 *   three count for type `spot`: cutoff in degrees, attenuation by powers of the distance
 * @typedef {Pick<Light, "ambient" | "diffuse" | "specular">} Headlight shines along the view
 * @typedef {Record<string, IUniform>} Uniforms
 * @typedef {object} Look
 * @property {Texture | null} [map]
 * @property {boolean} [blend] whether one can see through it
 * @property {boolean} [tinted] whether instances have a `tint`, and all the same `shine`, instead of `color` and `_shine` of vertices
 * @property {boolean} [flat] whether it has its exact colour without any light
 * @property {number} [grown] how much instances are grown in every direction, as a share of the picture's height
 * @property {boolean} [behind] whether instances are shifted behind themselves, seen from the eye
 * @property {number[]} [shine] specular, shininess and emission
 */

const KINDS = ["headlight", "directional", "spot"];

/** The uniform that all materials of a scene share. @param {Light[]} lights @param {Headlight} headlight @returns {Uniforms} */
export function lighting(lights, headlight) {
  const head = { type: "headlight", position: [0, 0, 0], direction: [0, 0, -1], ...headlight };
  const value = [head, ...lights].map((/** @type {Light} */ light) => ({
    kind: KINDS.indexOf(light.type),
    position: upright(new Vector3(), light.position),
    direction: upright(new Vector3(), light.direction).normalize(),
    ambient: new Vector3(...light.ambient),
    diffuse: new Vector3(...light.diffuse),
    specular: new Vector3(...light.specular),
    attenuation: new Vector3(...(light.attenuation ?? [1, 0, 0])),
    cutoff: Math.cos(((light.cutoff ?? 45) * Math.PI) / 180),
    exponent: light.exponent ?? 10,
  }));
  return { lights: { value: value.filter((light) => light.kind >= 0) } };
}

/** @param {Uniforms} light from `lighting` @param {Look} look */
export function houseMaterial(light, { map = null, blend = false, shine = [0, 0, 0], ...look }) {
  if (map) {
    map.colorSpace = NoColorSpace;
    map.updateMatrix();
  }
  const flags = { TEXTURED: map, BLEND: blend, TINTED: look.tinted, FLAT: look.flat, GROWN: look.grown, BEHIND: look.behind };
  const set = Object.entries(flags).filter(([, value]) => value);
  return new ShaderMaterial({
    transparent: blend,
    depthWrite: !blend,
    defines: { LIGHTS: light["lights"]?.value.length, ...Object.fromEntries(set.map(([flag, value]) => [flag, Number(value) || 1])) },
    uniforms: { ...light, map: { value: map }, mapping: { value: map?.matrix ?? new Matrix3() }, shine: { value: new Vector3(...shine) } },
    vertexShader: VERTEX,
    fragmentShader: FRAGMENT,
  });
}

const VERTEX = `
struct Light {
  int kind;
  vec3 position, direction, ambient, diffuse, specular, attenuation;
  float cutoff, exponent;
};
uniform Light lights[LIGHTS];
uniform mat3 mapping;
#ifdef TINTED
attribute vec4 tint;
uniform vec3 shine;
#else
attribute vec4 color;
attribute vec3 _shine;
#define shine _shine
#endif
varying vec4 vColour;
varying vec2 vMap;

vec3 displayed(vec3 c) { return mix(12.92 * c, 1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, step(0.0031308, c)); }

vec3 lit(vec3 colour, vec3 n, vec3 place) {
  vec3 eye = normalize(cameraPosition - place), sum = vec3(shine.z), gloss = vec3(0.0);
  for (int i = 0; i < LIGHTS; i++) {
    vec3 l = -lights[i].direction;
    float strength = 1.0;
    if (lights[i].kind == 0) l = vec3(viewMatrix[0][2], viewMatrix[1][2], viewMatrix[2][2]);
    if (lights[i].kind == 2) {
      vec3 to = lights[i].position - place;
      float d = length(to), along = dot(to / d, l);
      l = to / d;
      strength = step(lights[i].cutoff, along) * pow(max(along, 0.0), lights[i].exponent)
        / dot(lights[i].attenuation, vec3(1.0, d, d * d));
    }
    float facing = dot(n, l);
    sum += strength * (lights[i].ambient + lights[i].diffuse * max(facing, 0.0));
    float mirrored = pow(max(dot(n, normalize(l + eye)), 0.0), max(128.0 * shine.y, 1e-4));
    if (facing > 0.0) gloss += strength * lights[i].specular * mirrored;
  }
  return clamp(sum * colour + shine.x * gloss, 0.0, 1.0);
}

void main() {
  mat4 placed = modelMatrix;
  #ifdef TINTED
  placed *= instanceMatrix;
  vColour = tint;
  #else
  vColour = vec4(displayed(color.rgb), color.a);
  #endif
  #ifdef TEXTURED
  vMap = (mapping * vec3(uv, 1.0)).xy;
  #endif
  vec4 place = placed * vec4(position, 1.0);
  #ifdef GROWN
  float away = max(-(viewMatrix * placed[3]).z, 0.0);
  place.xyz += mat3(modelMatrix) * position * 2.0 * GROWN * away / projectionMatrix[1][1];
  #endif
  #ifdef BEHIND
  vec3 centre = placed[3].xyz;
  float radius = length(placed[0].xyz);
  place.xyz += (centre - cameraPosition) * radius / max(distance(centre, cameraPosition), radius);
  #endif
  #ifndef FLAT
  // The columns are orthogonal, so this is the inverse transpose up to its length.
  vec3 squares = vec3(dot(placed[0], placed[0]), dot(placed[1], placed[1]), dot(placed[2], placed[2]));
  vColour.rgb = lit(vColour.rgb, normalize(mat3(placed) * (normal / squares)), place.xyz);
  #endif
  gl_Position = projectionMatrix * viewMatrix * place;
}`;

const FRAGMENT = `
uniform sampler2D map;
varying vec4 vColour;
varying vec2 vMap;

void main() {
  gl_FragColor = min(vColour, 1.0);
  #ifdef TEXTURED
  gl_FragColor *= texture2D(map, vMap);
  #endif
  #ifdef BLEND
  gl_FragColor.a = 1.0 - (1.0 - gl_FragColor.a) * (1.0 - gl_FragColor.a);
  #elif !defined(FLAT)
  gl_FragColor.a = 1.0;
  #endif
}`;
