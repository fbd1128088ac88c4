// Drawing. Text from the log is only ever set as text, never as markup.

// Patterns: what colour says, they say too.
function patterns() {
  const of = (id, size, ...shapes) =>
    svg("pattern", { id, width: size, height: size, patternUnits: "userSpaceOnUse" }, ...shapes);
  const line = (d, kind = "p-line") => svg("path", { d, class: kind });
  return svg("svg", { class: "patterns", "aria-hidden": "true" },
    svg("defs", {},
      of("p-shared", 10, line("M-2 12L12 -2M-2 2L2 -2M8 12L12 8")),
      of("p-autonomous", 8, svg("circle", { cx: 2, cy: 2, r: 1.3, class: "p-dot" }),
        svg("circle", { cx: 6, cy: 6, r: 1.3, class: "p-dot" })),
      of("p-hold", 8, line("M4 -1V9")),
      of("p-safe", 10, line("M-1 -1L11 11M-1 11L11 -1")),
      of("p-low", 8, line("M-1 4H9")),
      of("p-outage", 7, line("M-1 8L8 -1", "p-dark")),
      of("p-planned", 8, line("M-1 9L9 -1", "p-soft")),
      of("p-unknown", 9, line("M-1 -1L10 10", "p-unknown"))));
}

const PATTERN = {
  shared: "shared", autonomous: "autonomous", alone: "autonomous", hold: "hold", safe: "safe",
  stuck: "safe", flat: "safe", low: "low", charging: "low", "goal-directed": "autonomous",
  exploratory: "hold", returning: "low", outage: "outage", planned: "planned", proposal: "shared",
};
// These fill so strongly that a word on them stands on a chip of the page's colour.
const BARE = new Set(["goal-operator", "goal-mission", "goal-inherent", "told", "guided", "nominal",
  "aside", "charging"]);

function axis(x, y, height) {
  const group = svg("g");
  for (const { t, text: words } of timeTicks(x)) {
    const at = px(x(t));
    group.append(svg("path", { d: `M${at} ${y}v${height}`, class: "gridline" }));
    const half = widthOf(words) / 2;
    const middle = Math.min(Math.max(at, x.left + half), x.right - half);
    group.append(text(middle, y + height + 15, words, { class: "soft", "text-anchor": "middle" }));
  }
  return group;
}

const plots = [];

// A plot has one time axis with all others: dragging zooms, a click moves the cursor.
class Plot {
  constructor(host, draw, tell = () => "") {
    this.root = svg("svg", { role: "img", "aria-label": host.dataset.label ?? "" });
    this.draw = draw;
    this.tell = tell;
    this.gutter = 0;
    host.replaceChildren(this.root);
    host.classList.add("plot");
    this.host = host;
    plots.push(this);
    this.listen();
  }

  redraw() {
    const width = Math.max(240, Math.floor(this.host.clientWidth));
    this.narrow = width < 560;
    const drawn = this.draw(width, this.narrow);
    this.x = drawn.x;
    this.height = drawn.height;
    this.root.setAttribute("viewBox", `0 0 ${width} ${drawn.height}`);
    this.cursor = svg("path", { class: "cursor" });
    this.root.replaceChildren(...drawn.nodes, this.cursor);
    this.moveCursor();
  }

  moveCursor() {
    const at = this.x(state.t);
    const shown = at >= this.x.left - 1 && at <= this.x.right + 1;
    this.cursor.setAttribute("d", shown ? `M${px(at)} 0V${this.height}` : "");
  }

  listen() {
    let start = null;
    const pick = svg("rect", { class: "pick", y: 0 });
    const local = (event) => {
      const box = this.root.getBoundingClientRect();
      const factor = this.root.viewBox.baseVal.width / box.width;
      const x = (event.clientX - box.left) * factor;
      return { x: Math.min(Math.max(x, this.x.left), this.x.right),
        y: (event.clientY - box.top) * factor };
    };
    this.root.addEventListener("pointerdown", (event) => {
      if (event.button === 0) start = local(event).x;
    });
    this.root.addEventListener("pointermove", (event) => {
      const { x, y } = local(event);
      if (start !== null && Math.abs(x - start) > 6) {
        if (!pick.isConnected) {
          this.root.append(pick);
          this.root.setPointerCapture(event.pointerId);
        }
        pick.setAttribute("x", Math.min(x, start));
        pick.setAttribute("width", Math.abs(x - start));
        pick.setAttribute("height", this.height);
      }
      if (event.pointerType === "mouse") showTip(event, seconds(this.x.at(x)), this.tell(x, y));
    });
    this.root.addEventListener("pointerup", (event) => {
      if (start === null) return;
      const { x } = local(event);
      if (pick.isConnected) zoomTo(this.x.at(Math.min(start, x)), this.x.at(Math.max(start, x)));
      else setTime(this.x.at(x));
      pick.remove();
      start = null;
    });
    this.root.addEventListener("pointercancel", () => { pick.remove(); start = null; });
    this.root.addEventListener("pointerleave", () => showTip(null));
    this.root.addEventListener("dblclick", () => zoomTo(0, state.until));
    this.root.addEventListener("wheel", (event) => {
      if (!event.ctrlKey && !event.metaKey) return;
      event.preventDefault();
      zoomBy(event.deltaY > 0 ? 1.25 : 0.8, this.x.at(local(event).x));
    }, { passive: false });
  }
}

function showTip(event, ...lines) {
  const tip = byId("tip");
  if (event === null) {
    tip.style.display = "none";
    return;
  }
  tip.replaceChildren(...lines.filter(Boolean).map((line) => html("div", {}, line)));
  tip.style.display = "block";
  const beyond = event.clientX + 16 + tip.offsetWidth > innerWidth;
  tip.style.left = `${beyond ? Math.max(0, event.clientX - 12 - tip.offsetWidth) : event.clientX + 14}px`;
  tip.style.top = `${event.clientY + 16}px`;
}
