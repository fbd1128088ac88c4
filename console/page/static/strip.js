// The light strip: every word is a slanted line whose slope is the light time.

const STRIP = { left: 52, right: 12, top: 26, bottom: 34 };

class StripDrawing {
  constructor(root) {
    this.root = root;
    this.svg = svg("svg", {});
    const hatch = svg("pattern", { id: "unknown-hatch", width: 8, height: 8, patternUnits: "userSpaceOnUse" },
      svg("path", { d: "M-1 9L9 -1", class: "hatch" }));
    const gap = svg("pattern", { id: "gap-hatch", width: 7, height: 7, patternUnits: "userSpaceOnUse" },
      svg("path", { d: "M-1 -1L8 8M-1 8L8 -1", class: "hatch strong" }));
    const cut = svg("clipPath", { id: "strip-cut" }, this.cut = svg("rect", { y: 0 }));
    this.body = svg("g", { "clip-path": "url(#strip-cut)" });
    this.rails = svg("g", {});
    this.svg.append(svg("defs", {}, hatch, gap, cut), this.body, this.rails);
    root.replaceChildren(this.svg);
    new ResizeObserver(() => { this.measure(); drawSoon(); }).observe(root);
    this.measure();
  }

  measure() {
    this.width = this.root.clientWidth;
    this.height = this.root.clientHeight;
  }

  draw() {
    if (!seen.frame || !this.width || !this.height) return;
    const { strip, now_ns: now } = seen.frame;
    const ends = { top: STRIP.top, bottom: this.height - STRIP.bottom, left: STRIP.left, right: this.width - STRIP.right };
    const span = Math.max(1, strip.until_ns - strip.from_ns);
    const x = (at) => ends.left + (at - strip.from_ns) / span * (ends.right - ends.left);
    this.svg.setAttribute("viewBox", `0 0 ${this.width} ${this.height}`);
    Object.entries({ x: ends.left, width: ends.right - ends.left, height: this.height }).forEach(([name, value]) => this.cut.setAttribute(name, value));
    this.body.replaceChildren(...this.gaps(strip, x, ends), ...this.words(strip, x, ends, now), ...this.unknown(strip, x, ends, now), ...this.marks(strip, x, ends));
    this.rails.replaceChildren(...this.axis(strip, x, ends, now));
  }

  gaps(strip, x, { top, bottom }) {
    return (strip.gaps ?? []).map(([from, until]) => svg("rect", {
      x: px(x(from)), width: px(Math.max(1, x(until) - x(from))), y: top, height: bottom - top, class: "gap" }));
  }

  unknown(strip, x, { top, bottom, right }, now) {
    const d = `M${px(x(now))} ${top}L${px(x(strip.known_ns))} ${bottom}H${right}V${top}z`;
    return [svg("path", { d, class: "unknown" })];
  }

  words(strip, x, { top, bottom }, now) {
    const paths = new Map(), labels = [], free = { up: -Infinity, down: -Infinity };
    for (const word of strip.words ?? []) {
      const [from, to] = word.direction === "down" ? [bottom, top] : [top, bottom];
      const known = word.direction === "down" ? word.arrives_ns <= now : word.arrives_ns <= strip.known_ns;
      const cls = `word ${word.label ? "named" : word.routine ? "routine" : "told"}${known ? "" : " open"}`;
      paths.set(cls, (paths.get(cls) ?? "") + `M${px(x(word.sent_ns))} ${from}L${px(x(word.arrives_ns))} ${to}`);
      const at = x(word.sent_ns);
      if (word.label && at > free[word.direction]) {
        free[word.direction] = at + widthOf(word.label) + 6;
        labels.push(text(at, word.direction === "down" ? bottom + 16 : top - 6, word.label, { "text-anchor": "middle" }));
      }
    }
    const order = ({ 0: cls }) => (cls.includes("named") ? 2 : cls.includes("told") ? 1 : 0);
    return [...[...paths].sort((a, b) => order(a) - order(b)).map(([cls, d]) => svg("path", { d, class: cls })), ...labels];
  }

  // Where each command begins; and from where a take-back would still meet it.
  marks(strip, x, { top, bottom }) {
    const begins = new Map(strip.begins ?? []);
    const nodes = [...begins].map(([number, at]) => svg("g", {}, svg("path", { d: `M${px(x(at))} ${bottom - 7}v14`, class: "begins" }),
      text(x(at), bottom + 20, String(number), { class: "halo", "text-anchor": "middle" })));
    for (const [number, until] of strip.take_backs ?? []) {
      if (begins.has(number)) nodes.push(svg("path", { d: `M${px(x(until))} ${top}L${px(x(begins.get(number)))} ${bottom}`, class: "take-back" }));
      nodes.push(svg("path", { d: `M${px(x(until) - 4)} ${top - 4}l8 8m0 -8l-8 8`, class: "until" }));
    }
    return nodes;
  }

  axis(strip, x, { top, bottom, left, right }, now) {
    const span_s = (strip.until_ns - strip.from_ns) / 1e9, least = span_s / Math.max(1, (right - left) / 90);
    const step = NICE_S.find((nice) => nice >= least) ?? least, ticks = [];
    for (let n = Math.ceil((strip.from_ns - now) / 1e9 / step); n * step * 1e9 <= strip.until_ns - now; n++) {
      const at = x(now + n * step * 1e9), words = `${n > 0 ? "+" : "−"}${Math.abs(n) * step} s`;
      if (n) ticks.push(text(Math.min(Math.max(at, left + 18), right - 18), this.height - 2, words, { class: "soft", "text-anchor": "middle" }));
    }
    return [svg("path", { d: `M${left} ${top}H${right}M${left} ${bottom}H${right}`, class: "rail" }),
      svg("path", { d: `M${px(x(now))} ${top - 10}V${bottom + 8}`, class: "cursor" }), ...ticks,
      text(x(now), this.height - 2, "now", { "text-anchor": "middle" }),
      text(0, top + 5, "here", { class: "soft" }), text(0, bottom + 5, "rover", { class: "soft" })];
  }
}
