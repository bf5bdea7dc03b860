// Shows frames as JPEG, or as H.264 if the browser can decode it.

/** @import { Codec, FrameMessage } from "./protocol.js" */

const H264 = { codec: "avc1.42E01F", optimizeForLatency: true };

/**
 * Returns the best codec that this browser decodes.
 * @returns {Promise<Codec>}
 */
export async function bestCodec() {
  if (!window.isSecureContext || !("VideoDecoder" in window)) return "jpeg";
  try {
    return (await VideoDecoder.isConfigSupported(H264)).supported ? "h264" : "jpeg";
  } catch {
    return "jpeg";
  }
}

export class Screen {
  #canvas;
  /** @type {CanvasRenderingContext2D | null} */
  #context = null; // created with the first frame, so that the canvas is transparent before
  #shown;
  #failed;
  /** @type {VideoDecoder | null} */
  #decoder = null;
  /** @type {Map<number, FrameMessage>} */
  #waiting = new Map(); // frames being decoded, by number
  #newest = 0; // number of the shown frame
  #last = 0; // number of the last received frame

  /**
   * @param {HTMLCanvasElement} canvas
   * @param {(frame: FrameMessage) => void} shown is called with every frame that was shown
   * @param {() => void} failed is called when H.264 cannot be decoded
   */
  constructor(canvas, shown, failed) {
    this.#canvas = canvas;
    this.#shown = shown;
    this.#failed = failed;
  }

  /** Size of the canvas, in device pixels. */
  get size() {
    const box = this.#canvas.getBoundingClientRect();
    const scale = window.devicePixelRatio || 1;
    const limit = (/** @type {number} */ length) => Math.min(8192, Math.max(1, Math.round(length * scale)));
    return { width: limit(box.width), height: limit(box.height) };
  }

  /** Forgets frames of an earlier connection. */
  reset() {
    this.#newest = 0;
    this.#waiting.clear();
    if (this.#decoder && this.#decoder.state !== "closed") this.#decoder.close();
    this.#decoder = null;
  }

  /** @param {FrameMessage} frame */
  async show(frame) {
    if (frame.number <= this.#last) this.reset(); // numbers restart with every view
    this.#last = frame.number;
    if (frame.codec === "h264") this.#decode(frame);
    else this.#draw(await createImageBitmap(new Blob([frame.data], { type: "image/jpeg" })), frame);
  }

  /** @param {FrameMessage} frame */
  #decode(frame) {
    if (!this.#decoder) {
      if (!frame.key) return;
      this.#decoder = new VideoDecoder({
        output: (image) => {
          const decoded = this.#waiting.get(image.timestamp);
          this.#waiting.delete(image.timestamp);
          if (decoded) this.#draw(image, decoded);
          else image.close();
        },
        error: () => this.#failed(),
      });
      this.#decoder.configure(H264);
    }
    if (this.#decoder.state === "closed") return;
    this.#waiting.set(frame.number, frame);
    try {
      this.#decoder.decode(
        new EncodedVideoChunk({ type: frame.key ? "key" : "delta", timestamp: frame.number, data: frame.data }),
      );
    } catch {
      this.#failed();
    }
  }

  /** @param {ImageBitmap | VideoFrame} image @param {FrameMessage} frame */
  #draw(image, frame) {
    if (frame.number > this.#newest) {
      this.#newest = frame.number;
      if (this.#canvas.width !== frame.width) this.#canvas.width = frame.width;
      if (this.#canvas.height !== frame.height) this.#canvas.height = frame.height;
      this.#context ??= this.#canvas.getContext("2d", { alpha: false });
      this.#context?.drawImage(image, 0, 0, frame.width, frame.height);
    }
    image.close();
    this.#shown(frame);
  }
}
