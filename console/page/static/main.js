// What the server calls: the chart, the heat when it changed, and a drawing for each change.

const drawings = { map: null, strip: null };
let due = 0, fresh = false;

function drawSoon() {
  due ||= requestAnimationFrame(() => {
    due = 0;
    for (const [name, kind] of [["map", MapDrawing], ["strip", StripDrawing]]) {
      const root = document.querySelector(`.farside-${name}`);
      if (root && drawings[name]?.root !== root) drawings[name] = new kind(root);
      drawings[name]?.draw();
    }
    tellCue();
    if (fresh) farside.frames++;
    fresh = false;
  });
}

const farside = window.farside = {
  frames: 0, meanings,
  answer, choose, pause, acknowledge,
  draw(frame) {
    seen.frame = frame;
    fresh = true;
    learnMeanings(frame);
    drawSoon();
  },
  chart(chart) { seen.chart = chart; farside.view(seen.view); },
  heat(heat) { seen.heat = heat; farside.view(seen.view); },
  view(view) {
    seen.view = view;
    if (drawings.map) drawings.map.drawn = "";
    drawSoon();
  },
  cues(cues) { table = cues; },
};

listen();
poll();
