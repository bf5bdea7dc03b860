// Short sounds, made here: steps, an object picked or put away, a refusal, the end.

/** @import { HudState } from "./protocol.js" */

const STRIDE = 0.7; // m between two steps
/** @type {Record<string, [frequency: number, at: number][]>} Hz and s */
const TUNES = {
  pick: [[440, 0], [660, 0.07]],
  place: [[660, 0], [880, 0.07]],
  refusal: [[196, 0], [165, 0.09]],
  done: [[523, 0], [659, 0.12], [784, 0.24], [1047, 0.36]],
};

export class Sounds {
  on = true;
  /** @type {AudioContext | null} */
  #audio = null;
  /** @type {HudState | null} */
  #last = null;
  #walked = 0; // m since the last step
  /** @type {[number, number] | null} */
  #place = null;

  /** Browsers let a page sound only once the person has pressed something. */
  unlock() {
    if (!("AudioContext" in window)) return; // switched off in this browser
    this.#audio ??= new AudioContext();
    this.#audio.resume();
  }

  /** Plays what changed. @param {HudState} state */
  hear(state) {
    const last = this.#last;
    this.#last = state;
    if (!last) return;
    const held = (/** @type {HudState} */ some) => some.inventory.filter((slot) => slot?.label).length;
    if (state.delivered > last.delivered) this.play(state.delivered === state.total ? "done" : "place");
    else if (held(state) > held(last)) this.play("pick");
    else if (state.message?.kind === "refusal" && state.message.text !== last.message?.text) this.play("refusal");
  }

  /** @param {number} x m @param {number} y */
  walk(x, y) {
    const [fromX, fromY] = this.#place ?? [x, y];
    this.#place = [x, y];
    this.#walked += Math.hypot(x - fromX, y - fromY);
    if (this.#walked < STRIDE) return;
    this.#walked = 0;
    this.#tone(70, 0, 0.05, 0.25);
  }

  /** @param {keyof typeof TUNES} name */
  play(name) {
    for (const [frequency, at] of TUNES[name] ?? []) this.#tone(frequency, at, 0.14, 0.12);
  }

  /** @param {number} frequency Hz @param {number} after s @param {number} length s @param {number} loudness 0 to 1 */
  #tone(frequency, after, length, loudness) {
    const audio = this.#audio;
    if (!this.on || audio?.state !== "running") return;
    const [start, gain, tone] = [audio.currentTime + after, audio.createGain(), audio.createOscillator()];
    tone.frequency.setValueAtTime(frequency, start);
    gain.gain.setValueAtTime(loudness, start);
    gain.gain.exponentialRampToValueAtTime(0.001, start + length);
    tone.connect(gain).connect(audio.destination);
    tone.start(start);
    tone.stop(start + length);
  }
}
