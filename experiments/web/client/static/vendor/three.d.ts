// Types of three.js, the bundle beside this file.
export * from "three";
export { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
