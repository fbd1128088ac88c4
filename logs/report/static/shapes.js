// Shapes, texts and times, for the report and the console. Text is only ever set as text, never as
// markup.

const SVG = "http://www.w3.org/2000/svg";

function svg(name, attributes = {}, ...children) {
  const node = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
  node.append(...children);
  return node;
}

function html(name, attributes = {}, ...children) {
  const node = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
  node.append(...children);
  return node;
}

const byId = (id) => document.getElementById(id);
const px = (value) => Math.round(value * 10) / 10;

function text(x, y, words, attributes = {}) {
  return svg("text", { x: px(x), y: px(y), ...attributes }, words);
}

let measuring = null;
const widths = new Map();
function widthOf(words) {
  if (!widths.has(words)) {
    measuring ??= document.createElement("canvas").getContext("2d");
    measuring.font = "14px system-ui, sans-serif";
    if (widths.size > 5000) widths.clear();
    widths.set(words, measuring.measureText(words).width);
  }
  return widths.get(words);
}

// Steps of a time axis that are easily read, in seconds.
const NICE_S = [0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 900, 1800,
  3600, 7200, 10800, 21600, 43200, 86400, 172800, 432000, 864000];

function clock(t, digits = 0) {
  const unit = 10 ** digits;
  const whole = Math.floor(t / 1000 * unit + 1e-6);
  const s = Math.floor(whole / unit);
  const two = (n) => String(n).padStart(2, "0");
  const part = digits ? "." + String(whole % unit).padStart(digits, "0") : "";
  return `${Math.floor(s / 3600)}:${two(Math.floor(s / 60) % 60)}:${two(s % 60)}${part}`;
}
