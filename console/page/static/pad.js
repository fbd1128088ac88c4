// A gamepad: its left stick chooses as the arrows do, and feels the cue of where it points.

const NEAR = 0.25, CHOSEN = 0.8, BACK = 0.4, INSIST_MS = 1000;
const stick = { action: null, chosen: false, since: 0, felt: "", buttons: [] };

function pointing(pad) {
  const [x = 0, y = 0] = pad.axes, far = Math.min(1, Math.hypot(x, y));
  if (far < NEAR) return { action: null, far: 0 };
  return { far, action: Math.abs(x) > Math.abs(y) ? (x > 0 ? "E" : "W") : y > 0 ? "S" : "N" };
}

function feel(pad, option, far) {
  const kind = option?.kind ?? "", step = kind === "problematic" ? Math.floor(far * 4) : 0;
  const felt = `${option?.action ?? ""} ${kind} ${step}`;
  if (felt === stick.felt) return;
  stick.felt = felt;
  rumble(pad, option, far);
}

async function rumble(pad, option, far) {
  const actuator = pad.vibrationActuator, pulses = patterns[option?.kind] ?? [];
  if (!actuator?.playEffect) return;
  const mine = stick.felt;
  for (const { ms, strength, pause_ms: wait } of pulses) {
    if (stick.felt !== mine) return;
    const much = Math.min(1, strength * (option.kind === "problematic" ? option.severity * far : 1));
    actuator.playEffect("dual-rumble", { duration: ms, strongMagnitude: much, weakMagnitude: much });
    await new Promise((done) => setTimeout(done, ms + wait));
  }
}

function push(action, now) {
  const option = optionOf(action);
  if (!option || stick.chosen) return;
  const insist = option.kind === "invalid";
  if (insist && now - stick.since < INSIST_MS) return;
  stick.chosen = true;
  choose(action, insist);
}

function readPad(pad, now) {
  const { action, far } = pointing(pad);
  if (far < BACK) stick.chosen = false;
  if (action !== stick.action || far < CHOSEN) stick.since = now;
  if (action !== stick.action || action) showCue(action, far);
  stick.action = action;
  feel(pad, optionOf(action), far);
  if (action && far >= CHOSEN) push(action, now);
  [["approve", 0], ["veto", 1]].forEach(([what, number]) => {
    const isDown = Boolean(pad.buttons[number]?.pressed);
    if (isDown && !stick.buttons[number] && !opened()) answer(what);
    stick.buttons[number] = isDown;
  });
}

const plugged = () => [...navigator.getGamepads?.() ?? []].find((pad) => pad?.connected);

function poll(now) {
  const pad = plugged();
  if (!pad) {
    setTimeout(() => poll(performance.now()), 250);
    return;
  }
  readPad(pad, now);
  requestAnimationFrame(poll);
}
