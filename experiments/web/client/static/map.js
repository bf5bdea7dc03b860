// The mini-map: the house from above, north up.

/** @import { MiniMap } from "./protocol.js" */

const PERSON = [[7, 0], [-5, -5], [-2.5, 0], [-5, 5]]; // px, looking to the right
const DARK = "#0d1118";

/**
 * @param {HTMLCanvasElement} canvas
 * @param {MiniMap | null} map
 * @param {HTMLImageElement | null | undefined} picture
 */
export function drawMap(canvas, map, picture) {
  canvas.hidden = !map;
  const context = canvas.getContext("2d");
  if (!map || !context) return;
  const [west, south, east, north] = map.bounds;
  const scale = 400 / Math.max(east - west, north - south); // px per metre
  canvas.width = Math.round(scale * (east - west));
  canvas.height = Math.round(scale * (north - south));
  if (picture?.complete) context.drawImage(picture, 0, 0, canvas.width, canvas.height);
  const disc = (/** @type {[number, number]} */ [x, y], /** @type {number} */ radius, /** @type {string} */ colour) => {
    for (const [size, fill] of /** @type {[number, string][]} */ ([[radius + 2, DARK], [radius, colour]])) {
      context.beginPath();
      context.arc(scale * (x - west), scale * (north - y), size, 0, 2 * Math.PI);
      context.fillStyle = fill;
      context.fill();
    }
  };
  for (const point of map.path) disc(point, 3, "#d55e00");
  for (const point of map.objects) disc(point, 5, "#e69f00");
  if (map.goal) disc(map.goal, 8, "#56b4e9");
  context.translate(scale * (map.position[0] - west), scale * (north - map.position[1]));
  context.rotate(-map.heading);
  context.beginPath();
  for (const [x = 0, y = 0] of PERSON) context.lineTo(2 * x, 2 * y);
  context.closePath();
  context.lineWidth = 4;
  context.strokeStyle = DARK;
  context.stroke();
  context.fillStyle = "#f0e442";
  context.fill();
}
