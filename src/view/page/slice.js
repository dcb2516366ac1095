// ω in a plane: bands of colour between levels, isolines at them, and a strong line at the surface.

const SLICE_VERTEX = `#version 300 es
precision highp float;
uniform mat4 view, projection;
uniform vec3 corner, along, upwards;
uniform vec2 size;           // nodes of the grid along both sides
out vec2 place;
out vec3 at;
void main() {
  vec2 part = vec2(gl_VertexID & 1, gl_VertexID >> 1);
  place = part * (size - 1.0);
  at = corner + part.x * along + part.y * upwards;
  gl_Position = projection * view * vec4(at, 1.0);
}`;

/** The most levels that there may be. */
const MOST_LEVELS = 24;

const SLICE_FRAGMENT = `#version 300 es
precision highp float;
precision highp int;
in vec2 place;
in vec3 at;
uniform highp sampler2D omega;
uniform vec2 size;
uniform int count, zero;     // the number of levels, and that of the level 0
uniform float levels[${MOST_LEVELS}];
uniform vec3 bands[${MOST_LEVELS + 1}];
out vec4 colour;
float node(vec2 k) { return texelFetch(omega, ivec2(k), 0).r; }
vec2 cell(vec2 p) { return clamp(floor(p), vec2(0.0), size - 2.0); }
vec4 around(vec2 k) { return vec4(node(k), node(k + vec2(1.0, 0.0)), node(k + vec2(0.0, 1.0)), node(k + vec2(1.0, 1.0))); }
float between(vec4 corners, vec2 f) { return mix(mix(corners.x, corners.y, f.x), mix(corners.z, corners.w, f.x), f.y); }
void main() {
  vec2 k = cell(place), f = place - k;
  vec4 corners = around(k);
  float w = between(corners, f);
  // by how much it changes from pixel to pixel, within this cell alone: neighbours may lie behind a kink
  vec2 slope = vec2(mix(corners.y - corners.x, corners.w - corners.z, f.y), mix(corners.z - corners.x, corners.w - corners.y, f.x));
  vec2 right = dFdx(place), up = dFdy(place);
  float rise = max(length(vec2(dot(slope, right), dot(slope, up))), 1e-30);
  // 3e38 stands for what is no number
  if (any(greaterThan(corners, vec4(2e38)))) { colour = vec4(vec3(0.84), 0.9); return; }
  int band = 0;
  float line = 0.0;
  vec2 reached = vec2(1.0, -1.0);
  for (int i = 0; i < ${MOST_LEVELS}; i++) {
    if (i >= count) break;
    if (levels[i] <= w) band = i + 1;
    // half a pixel beside a line it fades
    float here = clamp((i == zero ? 1.7 : 0.9) - abs(w - levels[i]) / rise, 0.0, 1.0) * (i == zero ? 1.0 : 0.5);
    if (here <= line) continue;
    // where slopes of a formula differ much a value is not reached although it seems near
    if (reached.x > reached.y) {
      reached = vec2(w);
      for (int n = 0; n < 8; n++) {
        vec2 p = place + 2.0 * (cos(float(n) * 0.785398) * right + sin(float(n) * 0.785398) * up), c = cell(p);
        float there = between(around(c), clamp(p - c, 0.0, 1.0));
        reached = vec2(min(reached.x, there), max(reached.y, there));
      }
    }
    if (reached.x <= levels[i] && levels[i] <= reached.y) line = here;
  }
  float opacity = max(w >= 0.0 ? 0.96 : 0.62, line);
  colour = vec4(mix(bands[band], vec3(0.1), line) * opacity, opacity);
}`;

// the colours of `rfm check --slice`: orange inside and blue outside, from the surface on
const SLICE_INSIDE = [[255, 237, 211], [247, 176, 102], [208, 103, 30]];
const SLICE_OUTSIDE = [[232, 241, 249], [155, 197, 226], [77, 134, 188]];

/** The colours of the bands between levels, from the lowest on. */
function bandColours(levels) {
  const zero = levels.indexOf(0);
  return Array.from({ length: levels.length + 1 }, (_, band) => {
    const inside = band > zero;
    const [k, last] = inside ? [band - zero - 1, levels.length - zero - 1] : [zero - band, zero];
    const ramp = inside ? SLICE_INSIDE : SLICE_OUTSIDE;
    const part = 2 * (last === 0 ? 0.5 : k / last);
    const from = Math.min(Math.floor(part), 1);
    return ramp[from].map((c, i) => Math.round(c + (ramp[from + 1][i] - c) * (part - from)));
  });
}

/** A slice from a block: its values as floats, row by row from below. */
function sliceOf(head, planes) {
  const n = head.columns * head.rows;
  const bytes = [0, 1, 2, 3].map(() => planes.take(n));
  const bits = new Uint32Array(n);
  for (let i = 0; i < n; i++) bits[i] = bytes[0][i] | (bytes[1][i] << 8) | (bytes[2][i] << 16) | (bytes[3][i] << 24);
  const values = new Float32Array(bits.buffer);
  for (let i = 0; i < n; i++) if (Number.isNaN(values[i])) values[i] = 3e38;
  return { ...head, values, bands: bandColours(head.levels) };
}

class SliceView {
  constructor(scene) {
    this.gl = scene.gl;
    this.program = scene.program(SLICE_VERTEX, SLICE_FRAGMENT);
    this.texture = this.gl.createTexture();
    this.array = this.gl.createVertexArray();
    this.shown = null;
  }

  fill(slice) {
    if (this.shown === slice) return;
    this.shown = slice;
    const { gl } = this;
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.R32F, slice.columns, slice.rows, 0, gl.RED, gl.FLOAT, slice.values);
    for (const [key, value] of [[gl.TEXTURE_MIN_FILTER, gl.NEAREST], [gl.TEXTURE_MAG_FILTER, gl.NEAREST], [gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE], [gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE]])
      gl.texParameteri(gl.TEXTURE_2D, key, value);
  }

  draw(slice, view, projection) {
    const { gl, program } = this;
    const [u, v] = [[1, 2], [0, 2], [0, 1]][slice.axis];
    const corner = [slice.at, slice.at, slice.at];
    [corner[u], corner[v]] = slice.min;
    const [along, upwards] = [[0, 0, 0], [0, 0, 0]];
    [along[u], upwards[v]] = [slice.max[0] - slice.min[0], slice.max[1] - slice.min[1]];
    gl.useProgram(program.program);
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, this.texture);
    this.fill(slice);
    program.set("1i", "omega", 0);
    program.set("Matrix4fv", "view", false, view);
    program.set("Matrix4fv", "projection", false, projection);
    program.set("3f", "corner", ...corner);
    program.set("3f", "along", ...along);
    program.set("3f", "upwards", ...upwards);
    program.set("2f", "size", slice.columns, slice.rows);
    program.set("1i", "count", slice.levels.length);
    program.set("1i", "zero", slice.levels.indexOf(0));
    program.set("1fv", "levels", slice.levels);
    program.set("3fv", "bands", slice.bands.flat().map((c) => c / 255));
    gl.bindVertexArray(this.array);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    // where the scene is cut open there, its section lies in the same plane
    gl.enable(gl.POLYGON_OFFSET_FILL);
    gl.polygonOffset(-1, -16);
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
    gl.disable(gl.POLYGON_OFFSET_FILL);
    gl.disable(gl.BLEND);
  }
}

/** Draws the levels of a slice with the colours between them, upwards from the bottom of the page. */
function drawSliceLegend(context, look, slice, [left, bottom], height) {
  const rows = slice.bands.length;
  const row = Math.min(height / rows, 20);
  const top = bottom - rows * row;
  slice.bands.forEach((colour, k) => {
    context.fillStyle = `rgb(${colour})`;
    context.fillRect(left, bottom - (k + 1) * row, 14, row + 0.5);
  });
  context.lineWidth = 1;
  context.strokeStyle = look.colours.soft;
  context.strokeRect(left - 0.5, top - 0.5, 15, rows * row + 1);
  context.fillStyle = look.colours.text;
  context.textAlign = "left";
  write(context, look, `ω at ${"xyz"[slice.axis]} = ${shown(slice.at)} m`, left, top - 14);
  const every = Math.ceil(12 / row);
  const zero = slice.levels.indexOf(0);
  slice.levels.forEach((level, k) => {
    const y = bottom - (k + 1) * row;
    context.beginPath();
    context.lineWidth = k === zero ? 2 : 1;
    context.moveTo(left, y);
    context.lineTo(left + 18, y);
    context.stroke();
    // the surface always has its number
    if ((k - zero) % every === 0) write(context, look, shown(level), left + 22, y);
  });
  context.lineWidth = 1;
}
