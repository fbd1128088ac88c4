// An option's cue on the screen.

let table = null;  // of the cues, as the server has it

const optionOf = (action) => seen.frame?.options.find((option) => option.action === action);
const buttonOf = (action) => document.querySelector(`[data-option="${CSS.escape(action)}"]`);

// Show what an action would do: its ghost on the map and its words. `near`: how near a stick is.
function showCue(action, near = 0) {
  document.querySelectorAll("[data-near]").forEach((button) => { if (button.dataset.option !== action) delete button.dataset.near; });
  if (action && near) buttonOf(action)?.setAttribute("data-near", near >= 1 ? "there" : "near");
  if (seen.ghost !== action) {
    seen.ghost = action;
    drawSoon();
  }
  tellCue();
}

function tellCue() {
  const place = document.querySelector(".farside-cue"), option = optionOf(seen.ghost);
  const told = option ? [option.does, option.why].filter(Boolean) : [];
  if (!place || place.dataset.told === told.join("\n")) return;
  place.dataset.told = told.join("\n");
  place.replaceChildren(...told.map((words) => html("div", {}, words)));
}
