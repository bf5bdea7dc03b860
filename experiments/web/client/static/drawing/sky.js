// What shows where nothing else does: the model's skybox, or black.

import { BackSide, BoxGeometry, CubeTexture, Mesh, NoColorSpace, ShaderMaterial } from "../vendor/three.js";

/**
 * @param {ImageBitmap} strip the six faces below each other: right, left, up, down, front, back
 * @returns {Promise<Mesh>}
 */
export async function skyOf(strip) {
  const side = strip.width;
  const faces = await Promise.all([0, 1, 2, 3, 4, 5].map((face) => createImageBitmap(strip, 0, face * side, side, side)));
  const texture = new CubeTexture(faces);
  texture.colorSpace = NoColorSpace;
  texture.generateMipmaps = false;
  texture.minFilter = texture.magFilter;
  texture.needsUpdate = true;
  const material = new ShaderMaterial({
    side: BackSide,
    depthWrite: false,
    uniforms: { faces: { value: texture } },
    vertexShader: `
varying vec3 vDirection;
void main() {
  vDirection = position;
  gl_Position = (projectionMatrix * vec4(mat3(viewMatrix) * position, 1.0)).xyww;
}`,
    fragmentShader: `
uniform samplerCube faces;
varying vec3 vDirection;
void main() { gl_FragColor = vec4(textureCube(faces, vDirection).rgb, 1.0); }`,
  });
  const sky = new Mesh(new BoxGeometry(2, 2, 2), material);
  sky.renderOrder = 100; // the last of what is opaque: most of it is hidden
  sky.frustumCulled = false;
  return sky;
}
