// The look of mjsim's frames: light of OpenGL's fixed functions, in the space of the display, clamped before the
// texture. There is no tone mapping, and what one can see through is blended as often as MuJoCo blends it: twice.

import { LinearSRGBColorSpace, Matrix3, NoColorSpace, ShaderMaterial, Vector3 } from "../vendor/three.js";

/** @import { IUniform, Texture } from "../vendor/three.js" */
/**
 * @typedef {{ type: string; position: number[]; direction: number[]; ambient: number[]; diffuse: number[];
 *   specular: number[]; cutoff?: number; exponent?: number; attenuation?: number[] }} Light direction in the house
 *   frame, colours 0 to 1; the rest is for those of type `spot`: cutoff in degrees, attenuation by powers of distance
 * @typedef {{ ambient: number[]; diffuse: number[]; specular?: number[] }} Headlight shines along the view
 * @typedef {Record<string, IUniform>} Uniforms
 */

export const OUTPUT = LinearSRGBColorSpace; // colours leave the shader as the display takes them

/**
 * Uniforms that all materials of a scene share.
 * @param {Light[]} lights
 * @param {Headlight} headlight
 * @returns {Uniforms}
 */
export function lighting(lights, headlight) {
  return {
    lights: {
      value: lights.map((light) => ({
        spot: light.type === "spot",
        position: upright(light.position),
        direction: upright(light.direction).normalize(),
        ambient: new Vector3(...light.ambient),
        diffuse: new Vector3(...light.diffuse),
        specular: new Vector3(...light.specular),
        attenuation: new Vector3(...(light.attenuation ?? [1, 0, 0])),
        cutoff: Math.cos(((light.cutoff ?? 45) * Math.PI) / 180),
        exponent: light.exponent ?? 10,
      })),
    },
    headAmbient: { value: new Vector3(...headlight.ambient) },
    headDiffuse: { value: new Vector3(...headlight.diffuse) },
    headSpecular: { value: new Vector3(...(headlight.specular ?? [0, 0, 0])) },
  };
}

/** The house frame has z up, three.js has y up. @param {number[]} vector */
function upright([x = 0, y = 0, z = 0]) {
  return new Vector3(x, z, -y);
}

/**
 * @param {Uniforms} light from `lighting`
 * @param {object} look
 * @param {Texture | null} [look.map]
 * @param {boolean} [look.blend] whether one can see through it
 * @param {boolean} [look.tinted] whether instances have a `tint` instead of vertex colours
 * @param {boolean} [look.flat] whether it has its exact colour without any light
 * @param {boolean} [look.behind] whether instances are shifted behind themselves, seen from the eye
 * @param {[number, number, number]} [look.shine] specular, shininess and emission, each of the whole material
 * @param {boolean} [look.shines] whether each vertex has its own `_shine` instead
 */
export function houseMaterial(light, look) {
  const { map = null, blend = false, shine = [0, 0, 0] } = look;
  if (map) {
    map.colorSpace = NoColorSpace;
    map.updateMatrix();
  }
  return new ShaderMaterial({
    transparent: blend,
    depthWrite: !blend,
    defines: {
      LIGHTS: light["lights"]?.value.length ?? 0,
      ...(map && { TEXTURED: 1 }),
      ...(blend && { BLEND: 1 }),
      ...(look.tinted && { TINTED: 1 }),
      ...(look.flat && { FLAT: 1 }),
      ...(look.behind && { BEHIND: 1 }),
      ...(look.shines && { SHINES: 1 }),
    },
    uniforms: {
      ...light,
      map: { value: map },
      mapping: { value: map?.matrix ?? new Matrix3() },
      shine: { value: new Vector3(...shine) },
    },
    vertexShader: VERTEX,
    fragmentShader: FRAGMENT,
  });
}

const LIGHT = `
#if LIGHTS > 0
struct Light {
  bool spot;
  vec3 position, direction, ambient, diffuse, specular, attenuation;
  float cutoff, exponent;
};
uniform Light lights[LIGHTS];
#endif
uniform vec3 headAmbient, headDiffuse, headSpecular;

// Colour of a place with normal n; shine is specular, shininess and emission.
vec3 lit(vec3 colour, vec3 shine, vec3 n, vec3 place) {
  vec3 v = normalize(cameraPosition - place);
  vec3 ahead = vec3(viewMatrix[0][2], viewMatrix[1][2], viewMatrix[2][2]);
  float facing = max(dot(n, ahead), 0.0), power = max(128.0 * shine.y, 1e-4);
  vec3 sum = shine.z + headAmbient + headDiffuse * facing;
  vec3 gloss = headSpecular * step(1e-6, facing) * pow(max(dot(n, normalize(ahead + v)), 0.0), power);
  #if LIGHTS > 0
  for (int i = 0; i < LIGHTS; i++) {
    vec3 l = -lights[i].direction;
    float strength = 1.0;
    if (lights[i].spot) {
      vec3 to = lights[i].position - place;
      float d = length(to), along = dot(to / d, l);
      l = to / d;
      strength = step(lights[i].cutoff, along) * pow(max(along, 0.0), lights[i].exponent)
        / dot(lights[i].attenuation, vec3(1.0, d, d * d));
    }
    float k = dot(n, l);
    sum += strength * (lights[i].ambient + lights[i].diffuse * max(k, 0.0));
    if (k > 0.0) gloss += strength * lights[i].specular * pow(max(dot(n, normalize(l + v)), 0.0), power);
  }
  #endif
  return clamp(sum * colour + shine.x * gloss, 0.0, 1.0);
}`;

const VERTEX = `
#ifdef TINTED
attribute vec4 tint;
#else
attribute vec4 color;
#endif
#ifdef SHINES
attribute vec3 _shine;
#define shine _shine
#else
uniform vec3 shine;
#endif
uniform mat3 mapping;
varying vec4 vColour;
varying vec2 vMap;
${LIGHT}

vec3 displayed(vec3 c) { return mix(12.92 * c, 1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, step(0.0031308, c)); }

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
  #ifdef BEHIND
  vec3 centre = placed[3].xyz;
  float radius = length(placed[0].xyz);
  place.xyz += (centre - cameraPosition) * radius / max(distance(centre, cameraPosition), radius);
  #endif
  #ifndef FLAT
  // The columns are orthogonal: this is the inverse transpose, but for its length.
  vec3 squares = vec3(dot(placed[0], placed[0]), dot(placed[1], placed[1]), dot(placed[2], placed[2]));
  vColour.rgb = lit(vColour.rgb, shine, normalize(mat3(placed) * (normal / squares)), place.xyz);
  #endif
  gl_Position = projectionMatrix * viewMatrix * place;
}`;

const FRAGMENT = `
uniform sampler2D map;
varying vec4 vColour;
varying vec2 vMap;

void main() {
  gl_FragColor = vColour;
  #ifdef TEXTURED
  gl_FragColor *= texture2D(map, vMap);
  #endif
  #ifdef FLAT
  gl_FragColor.rgb = min(gl_FragColor.rgb, 1.0);
  #elif defined(BLEND)
  gl_FragColor.a = 1.0 - (1.0 - gl_FragColor.a) * (1.0 - gl_FragColor.a);
  #else
  gl_FragColor.a = 1.0;
  #endif
}`;
