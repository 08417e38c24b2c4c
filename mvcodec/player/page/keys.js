// The keys, in one table: it answers them and it writes the help.

const AHEAD = 0.2; // of the farthest
const ARROWS = { ArrowLeft: [0, -1], ArrowRight: [0, 1], ArrowUp: [-1, 0], ArrowDown: [1, 0] };

export function keyTable(player) {
  return [
    { keys: [" ", "k"], names: ["Space", "k"], text: "play, pause", run: () => player.togglePlay() },
    { keys: [",", "."], text: "one frame back, on", run: (event) => player.step(event.key === "," ? -1 : 1) },
    { keys: ["j", "l"], text: "some seconds back, on", run: (event) => player.skip(event.key === "j" ? -1 : 1) },
    { keys: ["Home", "End"], text: "first frame, last frame", run: (event) => player.seek(event.key === "Home" ? 0 : Infinity) },
    {
      keys: ["ArrowLeft", "ArrowRight", "ArrowUp", "ArrowDown"],
      names: ["←", "→", "↑", "↓"],
      text: "look around (Shift: a whole step)",
      run: (event) => player.nudge(...ARROWS[event.key].map((steps) => steps * (event.shiftKey ? 4 : 1))),
    },
    { keys: ["w", "s"], text: "move ahead, back", run: (event) => player.goAhead(event.key.toLowerCase() === "w" ? AHEAD : -AHEAD) },
    { keys: ["h"], text: "follow the pointer, or not", run: () => player.hover.toggle() },
    { keys: ["g"], text: "to the nearest place of the array", run: () => player.snap() },
    { keys: ["-", "+"], text: "slower, faster", run: (event) => player.changeSpeed(event.key === "-" ? -1 : 1) },
    { keys: ["a", "b"], text: "loop from here, to here; again: off", run: (event) => player.mark(event.key === "a" ? 0 : 1) },
    { keys: ["r"], text: "begin again at the end, or not", run: () => player.toggleLoop() },
    { keys: ["v"], text: "what is shown", run: () => player.nextLook() },
    { keys: ["e"], text: "one view, red-cyan, side by side, nine views", run: () => player.nextEyes() },
    { keys: ["[", "]"], text: "eyes nearer, farther apart", run: (event) => player.changeEyes(event.key === "[" ? -1 : 1) },
    { keys: ["m"], text: "PSNR and SSIM against the original", run: () => player.toggleMeasure() },
    { keys: ["p"], text: "save the picture", run: () => player.savePicture() },
    { keys: ["c"], text: "copy a link to this view and time", run: () => player.copyLink() },
    { keys: ["f"], early: true, text: "full screen", run: () => player.toggleFullscreen() },
    { keys: ["i"], early: true, text: "statistics", run: () => player.toggleStatistics() },
    { keys: ["?"], early: true, text: "this list", run: () => player.toggleHelp() },
  ];
}

// `ready()`: whether the server has said what there is to see; until then only keys marked `early` answer. `touched()` comes before each.
export function listenForKeys(table, help, ready, touched) {
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (help.open && event.key !== "?") return;
    if (belongsTo(event.target, event.key)) return;
    const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
    const found = table.find(({ keys }) => keys.includes(key === "=" ? "+" : key));
    if (!found || !(found.early || ready())) return;
    event.preventDefault();
    touched();
    found.run(event);
  });
}

// A control keeps the keys that it works with.
function belongsTo(target, key) {
  if (target instanceof HTMLSelectElement) return key.length > 1 || key === " ";
  if (target instanceof HTMLInputElement) return ["ArrowLeft", "ArrowRight", "ArrowUp", "ArrowDown", "PageUp", "PageDown"].includes(key);
  return target instanceof HTMLButtonElement && (key === " " || key === "Enter");
}

export function writeHelp(list, table) {
  for (const { keys, names = keys, text } of table) {
    const term = document.createElement("dt");
    for (const name of names) {
      const kbd = document.createElement("kbd");
      kbd.textContent = name;
      term.append(kbd);
    }
    const meaning = document.createElement("dd");
    meaning.textContent = text;
    const pair = document.createElement("div");
    pair.append(term, meaning);
    list.append(pair);
  }
}
