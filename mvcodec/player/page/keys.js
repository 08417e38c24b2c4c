// The keys, in one table: it answers them and it writes the help.

const ARROWS = { ArrowLeft: [0, -1], ArrowRight: [0, 1], ArrowUp: [-1, 0], ArrowDown: [1, 0] };

export function keyTable(player) {
  const look = (name) => () => player.toggleLook(name);
  return [
    { keys: [" ", "k"], names: ["Space", "k"], text: "play or pause", run: () => player.togglePlay() },
    { keys: [","], text: "one frame back", run: () => player.step(-1) },
    { keys: ["."], text: "one frame on", run: () => player.step(1) },
    { keys: ["j", "l"], text: "some seconds back, on", run: (event) => player.skip(event.key === "j" ? -1 : 1) },
    { keys: ["Home"], text: "first frame", run: () => player.seek(0) },
    { keys: ["End"], text: "last frame", run: () => player.seek(Infinity) },
    {
      keys: ["ArrowLeft", "ArrowRight", "ArrowUp", "ArrowDown"],
      names: ["←", "→", "↑", "↓"],
      text: "move the viewpoint (Shift: a whole step)",
      run: (event) => player.nudge(...ARROWS[event.key].map((steps) => steps * (event.shiftKey ? 4 : 1))),
    },
    { keys: ["g"], text: "to the nearest place of the grid", run: () => player.snap() },
    { keys: ["o"], text: "loop", run: () => player.toggleLoop() },
    { keys: ["-", "+"], text: "slower, faster", run: (event) => player.changeSpeed(event.key === "-" ? -1 : 1) },
    { keys: ["v"], text: "plain picture", run: look("picture") },
    { keys: ["d"], text: "disparity", run: look("disparity") },
    { keys: ["y"], text: "depth layers", run: look("layers") },
    { keys: ["p"], text: "provenance: seen by how many cameras", run: look("provenance") },
    { keys: ["x"], text: "difference from the nearest real view", run: look("difference") },
    { keys: ["m"], text: "PSNR and SSIM against the original", run: () => player.toggleMeasure() },
    { keys: ["a"], text: "anaglyph, for red-cyan glasses", run: look("anaglyph") },
    { keys: ["s"], text: "two eyes side by side", run: look("side-by-side") },
    { keys: ["n"], text: "nine views", run: look("mosaic") },
    { keys: ["[", "]"], text: "eyes nearer, farther apart", run: (event) => player.changeEyes(event.key === "[" ? -1 : 1) },
    { keys: ["f"], early: true, text: "full screen", run: () => player.toggleFullscreen() },
    { keys: ["i"], early: true, text: "statistics", run: () => player.toggleStatistics() },
    { keys: ["h"], early: true, text: "hide the controls", run: () => player.toggleControls() },
    { keys: ["?"], early: true, text: "these keys", run: () => player.toggleHelp() },
  ];
}

// `ready()`: whether the server has said what there is to see; until then only keys marked `early` answer.
export function listenForKeys(table, help, ready) {
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (help.open && event.key !== "?") return;
    if (belongsTo(event.target, event.key)) return;
    const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
    const found = table.find(({ keys }) => keys.includes(key === "=" ? "+" : key));
    if (!found || !(found.early || ready())) return;
    event.preventDefault();
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
