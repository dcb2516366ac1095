// Maps from a part of a range to a colour. The first is that of the pictures of `rfm run`.

const MAPS = {
  "blue–yellow–red": ["2c62bc", "6cb0e2", "fada58", "f0802e", "be1822"],
  viridis: ["440154", "472d7b", "3b528b", "2c728e", "21918c", "28ae80", "5ec962", "addc30", "fde725"],
  cividis: ["00224e", "123570", "3b496c", "575d6d", "707173", "8a8678", "a59c74", "c3b369", "e1cc55", "fee838"],
  "blue–white–red": ["2a4a9e", "7d9fd3", "efefef", "dd8f79", "9e2230"],
  grey: ["1c1c1c", "f2f2f2"],
};

/** The colour of a value that is not a number. */
const UNKNOWN_COLOUR = [128, 128, 128];

const rgb = (hex) => [0, 2, 4].map((at) => parseInt(hex.slice(at, at + 2), 16));

/** The colour at a part of a map, 0 … 1. */
function colourAt(name, part) {
  const stops = MAPS[name];
  const position = clamp(part, 0, 1) * (stops.length - 1);
  const k = Math.min(Math.floor(position), stops.length - 2);
  const [from, to] = [rgb(stops[k]), rgb(stops[k + 1])];
  return from.map((c, i) => Math.round(c + (to[i] - c) * (position - k)));
}

/** A map as 256 texels. */
function mapTexels(name) {
  const texels = new Uint8Array(256 * 4);
  for (let i = 0; i < 256; i++) texels.set([...colourAt(name, i / 255), 255], 4 * i);
  return texels;
}

/** The colours of the scene, which follow the theme of the system. */
function sceneColours() {
  const dark = matchMedia("(prefers-color-scheme: dark)").matches;
  const style = getComputedStyle(document.documentElement);
  const named = (name) => style.getPropertyValue(name).trim();
  return {
    back: rgb(named("--back").slice(1)).map((c) => c / 255),
    text: named("--text"),
    soft: named("--soft"),
    pane: named("--pane"),
    line: named("--line"),
    accent: named("--accent"),
    edges: dark ? [0.47, 0.52, 0.6] : [0.5, 0.54, 0.6],
    solid: dark ? [0.72, 0.74, 0.78] : [0.8, 0.81, 0.84],
    water: dark ? [0.25, 0.5, 0.78] : [0.36, 0.6, 0.86],
    depth: dark ? [0.12, 0.27, 0.47] : [0.62, 0.78, 0.93],
    section: dark ? [0.5, 0.4, 0.33] : [0.86, 0.66, 0.5],
  };
}
