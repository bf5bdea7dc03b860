// `?debug`: round trip from an input to the frame that shows it, frames a second, size, codec.

const SHOWN = 500; // ms between two updates

export class Debug {
  #element;
  #times = new Map(); // number of an input -> when it was sent, ms
  #trips = [];
  #frames = [];
  #bytes = 0;
  #at = 0;

  constructor(element, on) {
    this.#element = element;
    element.hidden = !on;
  }

  sent(number) {
    if (!this.#element.hidden) this.#times.set(number, performance.now());
  }

  shown(frame, pending) {
    if (this.#element.hidden) return;
    const now = performance.now();
    for (const [number, time] of this.#times) {
      if (number > frame.input) continue;
      this.#trips.push(now - time);
      this.#times.delete(number);
    }
    this.#frames.push(now);
    this.#bytes += frame.data.length;
    if (now - this.#at < SHOWN) return;
    const rate = (1000 * this.#frames.length) / Math.max(1, now - this.#at);
    const kilobits = (8 * this.#bytes) / Math.max(1, now - this.#at);
    const trips = this.#trips.sort((a, b) => a - b);
    const trip = trips.length ? `${trips[trips.length >> 1].toFixed(0)} ms` : "no input";
    this.#element.textContent = `round trip ${trip} · ${rate.toFixed(0)} fps · ${kilobits.toFixed(0)} kbit/s · ${frame.width}x${frame.height} ${frame.codec} · drawn in ${frame.milliseconds.toFixed(0)} ms · ${pending} not taken`;
    this.#trips = [];
    this.#frames = [];
    this.#bytes = 0;
    this.#at = now;
  }
}
