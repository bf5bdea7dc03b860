// A camera from above, and one that the mouse or a finger turns around the house.

const FOV = (50 * Math.PI) / 180;
const NARROW = (20 * Math.PI) / 180; // from far away, so that walls hide little of the floor
const TURN = 0.006; // radians per pixel
/** @type {Record<string, [number, number, number]>} as of a drag and a wheel, px */
const KEYS = { ArrowLeft: [-30, 0, 0], ArrowRight: [30, 0, 0], ArrowUp: [0, 30, 0], ArrowDown: [0, -30, 0], "+": [0, 0, -100], "-": [0, 0, 100] };
const [LOWEST, HIGHEST] = [0.1, 1.5]; // rad above the horizon

/** @typedef {{ position: [number, number, number], target: [number, number, number], fovy: number }} Camera */

export class Orbit {
  #canvas;
  #size;
  #azimuth = -Math.PI / 2;
  #elevation = 0.9;
  #distance;
  /** @type {[number, number, number]} */
  #target;

  /** @param {HTMLCanvasElement} canvas @param {[number, number, number, number]} bounds of the floor, m */
  constructor(canvas, [xMin, yMin, xMax, yMax]) {
    this.#canvas = canvas;
    this.#size = [xMax - xMin, yMax - yMin];
    this.#target = [(xMin + xMax) / 2, (yMin + yMax) / 2, 0];
    this.#distance = Math.hypot(...this.#size);
    canvas.addEventListener("pointermove", (event) => {
      if (event.buttons & 2 || (event.buttons & 1 && event.shiftKey)) this.#shift(event.movementX, event.movementY);
      else if (event.buttons & 1) this.#turn(event.movementX, event.movementY);
    });
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener(
      "wheel",
      (event) => {
        event.preventDefault();
        this.#turn(0, 0, event.deltaY);
      },
      { passive: false },
    );
  }

  /** @returns {Camera} the whole house from above, north up */
  above() {
    const [width = 1, depth = 1] = this.#size;
    const aspect = this.#canvas.clientWidth / Math.max(1, this.#canvas.clientHeight);
    const height = (0.56 * Math.max(depth, width / aspect)) / Math.tan(NARROW / 2);
    const [x, y] = [this.#target[0], this.#target[1]];
    return { position: [x, y - 1e-3, height], target: [x, y, 0], fovy: NARROW };
  }

  /** @returns {Camera} */
  pose() {
    const distance = this.#distance * Math.max(1, (1.3 * this.#canvas.clientHeight) / (this.#canvas.clientWidth || 1)); // narrow views
    const out = distance * Math.cos(this.#elevation);
    const [x, y, z] = this.#target;
    const height = distance * Math.sin(this.#elevation);
    return { position: [x + out * Math.cos(this.#azimuth), y + out * Math.sin(this.#azimuth), z + height], target: [x, y, z], fovy: FOV };
  }

  /** Turns or zooms. Returns true if the key is for the camera. @param {string} key */
  key(key) {
    this.#turn(...(KEYS[key] ?? [0, 0, 0]));
    return key in KEYS;
  }

  /** @param {number} dx px @param {number} dy @param {number} [away] of a wheel */
  #turn(dx, dy, away = 0) {
    this.#distance = Math.min(100, Math.max(0.5, this.#distance * Math.exp(away / 800)));
    this.#azimuth -= TURN * dx;
    this.#elevation = Math.min(HIGHEST, Math.max(LOWEST, this.#elevation + TURN * dy));
  }

  /** @param {number} dx px @param {number} dy */
  #shift(dx, dy) {
    const scale = (2 * this.#distance * Math.tan(FOV / 2)) / Math.max(1, this.#canvas.clientHeight);
    const [c, s] = [Math.cos(this.#azimuth), Math.sin(this.#azimuth)];
    this.#target[0] += scale * (s * dx - c * dy);
    this.#target[1] += scale * (-c * dx - s * dy);
  }
}
