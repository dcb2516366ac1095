// The exact surface of the obstacle: rays are marched to ω = 0, whose formula has the params as uniforms.
//
// A first pass asks for each cell of a grid whether the range of ω over it holds zero. Rays skip the other cells. Within a cell
// a piece of a ray is halved as long as its range holds zero, until it enters the solid or is a few millionths of the box long: no
// part is missed, however thin.

/** Cells along each side of the box. */
const CELLS = 32;

/** The most ranges that a ray asks for: hostile formulas must not stop the browser. */
const MOST_RANGES = 400;

/** A picture in which marching takes longer than this shows the mesh instead, ms. */
const SLOW = 60;

const FULL_VERTEX = `#version 300 es
precision highp float;
out vec2 ndc;
void main() {
  ndc = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0;
  gl_Position = vec4(ndc, 0.0, 1.0);
}`;

const FIELD_HEAD = `#version 300 es
precision highp float;
precision highp int;
uniform vec3 low, cell;
`;

const CELLS_FRAGMENT = `
out vec4 colour;
void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  vec3 k = vec3(at.x % ${CELLS}, at.y % ${CELLS}, at.x / ${CELLS} + at.y / ${CELLS} * 8);
  // a little more than the cell, against rounding
  vec3 a = low + (k - 0.001) * cell, b = low + (k + 1.001) * cell;
  vec2 r = field_range(vec2(a.x, b.x), vec2(a.y, b.y), vec2(a.z, b.z));
  colour = vec4(r.y <= 0.0 ? 0.0 : 1.0);
}`;

const EXACT_FRAGMENT = `
in vec2 ndc;
uniform mat4 view, projection, unproject;
uniform vec3 first, last;    // corners of the cells that are not empty
uniform vec4 cut;
uniform vec3 base, section;
uniform float parallel, pixel, slack;
uniform highp sampler2D cells;
out vec4 colour;
SHADED
float away;                  // from the eye to where rays begin
bool is_full(ivec3 k) {
  return texelFetch(cells, ivec2(k.x + ${CELLS} * (k.z % 8), k.y + ${CELLS} * (k.z / 8)), 0).r > 0.5;
}
vec2 over(vec3 o, vec3 d, float a, float b) {
  vec3 p = o + a * d, q = o + b * d, e = vec3(slack);
  vec3 l = min(p, q) - e, h = max(p, q) + e;
  return field_range(vec2(l.x, h.x), vec2(l.y, h.y), vec2(l.z, h.z));
}
int left = ${MOST_RANGES};   // how often the range may still be asked for
// the first place of the surface between two places of a ray, or a negative number
float found(vec3 o, vec3 d, float a, float b) {
  float h = b - a, least = 16.0 * slack, before = 1e30;
  while (a < b && left-- > 0) {
    h = min(h, b - a);
    vec2 r = over(o, d, a, a + h);
    // where ω is 0 at most nothing is inside
    if (r.y <= 0.0) { a += h; h *= 2.0; before = 1e30; continue; }
    float fine = max(0.5 * pixel * (parallel > 0.5 ? 1.0 : away + a), least), width = r.y - r.x;
    if (h > fine) { h *= 0.5; before = width; continue; }
    if (field_sign(o + (a + h) * d) > 0.0) {
      float inside = a + h;
      for (int k = 0; k < 10; k++) {
        float m = 0.5 * (a + inside);
        if (field_sign(o + m * d) > 0.0) inside = m; else a = m;
      }
      return inside;
    }
    // what is thin lies between two places outside
    if (h > least) { h *= 0.5; before = width; continue; }
    // a range that does not shrink with its box tells nothing: a jump, a pole, a derivative
    if (width < 0.8 * before) return a;
    a += h;
  }
  return -1.0;
}
void main() {
  vec4 a = unproject * vec4(ndc, -1.0, 1.0), b = unproject * vec4(ndc, 1.0, 1.0);
  vec3 o = a.xyz / a.w, d = normalize(b.xyz / b.w - o);
  away = length((view * vec4(o, 1.0)).xyz);
  d += vec3(lessThan(abs(d), vec3(1e-7))) * 1e-7;
  vec3 t1 = (first - o) / d, t2 = (last - o) / d, near = min(t1, t2), far = max(t1, t2);
  float t = max(max(near.x, near.y), max(near.z, 0.0)), end = min(far.x, min(far.y, far.z));
  vec3 outward = -sign(d) * vec3(equal(near, vec3(t)));
  // what lies beyond the plane of the cut is left out
  float along = dot(cut.xyz, d), beyond = dot(cut.xyz, o) - cut.w;
  bool is_section = false;
  if (along > 0.0) end = min(end, -beyond / along);
  else if (along < 0.0 && -beyond / along > t) { t = -beyond / along; is_section = true; }
  else if (along == 0.0 && beyond > 0.0) discard;
  if (t >= end) discard;
  vec3 normal = is_section ? cut.xyz : outward;
  float hit = field_sign(o + (t + 2.0 * slack) * d) > 0.0 ? t : -1.0;
  if (hit < 0.0) {
    is_section = false;
    ivec3 k = clamp(ivec3(floor((o + t * d - low) / cell)), ivec3(0), ivec3(${CELLS - 1}));
    vec3 ahead = vec3(greaterThan(d, vec3(0.0))), next = (low + (vec3(k) + ahead) * cell - o) / d, width = cell / abs(d);
    ivec3 direction = ivec3(sign(d));
    for (int i = 0; i < ${3 * CELLS}; i++) {
      float until = min(min(next.x, next.y), min(next.z, end));
      if (is_full(k)) {
        hit = found(o, d, t, until);
        if (hit >= 0.0) break;
      }
      t = until;
      if (t >= end) break;
      bvec3 now = lessThanEqual(next, vec3(t));
      next += vec3(now) * width;
      k += ivec3(now) * direction;
      if (any(lessThan(k, ivec3(0))) || any(greaterThan(k, ivec3(${CELLS - 1})))) break;
    }
    if (hit < 0.0) discard;
    normal = -field_gradient(o + hit * d).xyz;
    float size = length(normal);
    normal = size > 0.0 && size < 1e30 ? normal / size : -d;
  }
  vec4 seen = view * vec4(o + hit * d, 1.0), clip = projection * seen;
  gl_FragDepth = 0.5 + 0.5 * clip.z / clip.w;
  vec3 n = normalize(mat3(view) * normal);
  vec3 eye = parallel > 0.5 ? vec3(0.0, 0.0, 1.0) : normalize(-seen.xyz);
  colour = is_section ? vec4(section, 1.0) : vec4(shaded(base, n, eye), 1.0);
}`;

class ExactView {
  constructor(scene) {
    this.scene = scene;
    this.gl = scene.gl;
    this.array = this.gl.createVertexArray();
    this.cells = this.gl.createTexture();
    this.target = this.gl.createFramebuffer();
    this.field = null;
    /** Why there is no exact surface, and how long its picture takes, ms; null before it is measured. */
    this.reason = "";
    this.milliseconds = null;
  }

  /** Takes the formula of the obstacle; its programs are made only if it is another one. */
  set(field) {
    const same = this.field?.source === field?.source && this.programs;
    this.field = field;
    this.known = null;
    this.reason = field?.reason ?? "";
    if (same) return;
    this.programs?.forEach(({ program }) => this.gl.deleteProgram(program));
    this.programs = null;
    this.milliseconds = null;
    if (!field?.source) return;
    const head = FIELD_HEAD + field.source;
    try {
      this.programs = [CELLS_FRAGMENT, EXACT_FRAGMENT.replace("SHADED", SHADED)].map((main) => this.scene.program(FULL_VERTEX, head + main));
    } catch (error) {
      this.reason = `the graphics processor refuses its formula: ${error.message.split("\n")[0]}`;
    }
  }

  /** Whether rays are marched; if the choice is automatic only where they are fast. */
  isShown({ surface, obstacle, isMixed, onlyMesh }) {
    if (!this.programs || surface === "mesh" || obstacle !== "opaque" || isMixed || onlyMesh) return false;
    return surface === "exact" || (this.milliseconds !== null && this.milliseconds <= SLOW);
  }

  /** What is said of the surface that is shown. */
  said(look) {
    const took = this.milliseconds === null ? "" : `${this.milliseconds.toFixed(0)} ms`;
    if (this.isShown(look)) return `exact, by rays${took && `, ${took}`}`;
    if (!this.programs) return this.reason ? `mesh: ${this.reason}` : "";
    return look.surface === "automatic" && took && !look.onlyMesh ? `mesh: rays take ${took} here` : "mesh";
  }

  /** Measures how long a picture takes, unless that is known: by small ones, which do not stop a slow machine. */
  measure(look, ...rest) {
    if (!this.programs || this.milliseconds !== null || look.surface !== "automatic") return;
    const { gl } = this;
    const small = gl.createTexture();
    const time = (part) => {
      const size = [gl.canvas.width, gl.canvas.height].map((side) => Math.ceil(side / part));
      gl.bindTexture(gl.TEXTURE_2D, small);
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA8, ...size, 0, gl.RGBA, gl.UNSIGNED_BYTE, null);
      gl.bindFramebuffer(gl.FRAMEBUFFER, this.target);
      gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, small, 0);
      const began = performance.now();
      this.paint(look, size, ...rest);
      this.scene.wait();
      gl.bindFramebuffer(gl.FRAMEBUFFER, null);
      return performance.now() - began;
    };
    this.findCells(look.boxBounds, rest[3], rest[2]);
    // the first one waits for the driver's compiler
    time(64);
    const coarse = time(8);
    // what every picture takes besides its pixels does not count
    this.milliseconds = coarse > 4 * SLOW ? 64 * coarse : Math.max(((time(4) - coarse) * 64) / 3, 0);
    gl.deleteTexture(small);
    gl.viewport(0, 0, gl.canvas.width, gl.canvas.height);
  }

  /** Gives the formula its params and the time. */
  give(program, values, time) {
    program.set("1f", "field_time", time);
    for (const [uniform, param] of this.field.uniforms) program.set("1f", uniform, values.get(param));
  }

  /** Finds the cells that the surface may cross, unless they are known for these values. */
  findCells({ min, max }, values, time) {
    const { gl } = this;
    const wanted = JSON.stringify([this.field.uniforms.map(([, param]) => values.get(param)), this.field.moves ? time : 0, min, max]);
    if (this.known === wanted) return;
    this.known = wanted;
    const [width, height] = [8 * CELLS, (CELLS / 8) * CELLS];
    const cell = scale(sub(max, min), 1 / CELLS);
    gl.bindTexture(gl.TEXTURE_2D, this.cells);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.R8, width, height, 0, gl.RED, gl.UNSIGNED_BYTE, null);
    for (const key of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, key, gl.NEAREST);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.target);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, this.cells, 0);
    gl.viewport(0, 0, width, height);
    gl.disable(gl.DEPTH_TEST);
    const [program] = this.programs;
    gl.useProgram(program.program);
    program.set("3f", "low", ...min);
    program.set("3f", "cell", ...cell);
    this.give(program, values, time);
    gl.bindVertexArray(this.array);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    const full = new Uint8Array(4 * width * height);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, full);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.enable(gl.DEPTH_TEST);
    const [low, high] = [[CELLS, CELLS, CELLS], [0, 0, 0]];
    for (let i = 0; i < width * height; i++) {
      if (full[4 * i] < 128) continue;
      const [x, y] = [i % width, Math.floor(i / width)];
      [x % CELLS, y % CELLS, Math.floor(x / CELLS) + 8 * Math.floor(y / CELLS)].forEach((k, axis) => {
        low[axis] = Math.min(low[axis], k);
        high[axis] = Math.max(high[axis], k + 1);
      });
    }
    const corner = (k) => k.map((n, axis) => min[axis] + n * cell[axis]);
    this.extent = high[0] > low[0] ? { first: corner(low), last: corner(high), cell } : null;
  }

  /** Draws the surface. `values` are those of the params, by their names. */
  draw(look, view, projection, time, values) {
    const { width, height } = this.gl.canvas;
    this.findCells(look.boxBounds, values, time);
    this.paint(look, [width, height], view, projection, time, values);
  }

  /** Draws the surface on a canvas of a size, of which it needs the known cells. */
  paint(look, [width, height], view, projection, time, values) {
    const { gl } = this;
    gl.viewport(0, 0, width, height);
    if (!this.extent) return;
    const { first, last, cell } = this.extent;
    const all = times(projection, view);
    const program = this.programs[1];
    gl.useProgram(program.program);
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, this.cells);
    program.set("1i", "cells", 0);
    for (const [name, matrix] of [["view", view], ["projection", projection], ["unproject", inverse(all)]]) program.set("Matrix4fv", name, false, matrix);
    for (const [name, vector] of [["low", look.boxBounds.min], ["cell", cell], ["first", first], ["last", last], ["base", look.colours.solid], ["section", look.colours.section]]) program.set("3f", name, ...vector);
    program.set("4f", "cut", ...(look.cutSolid ? look.cut : NO_CUT));
    program.set("1f", "parallel", look.parallel ? 1 : 0);
    program.set("1f", "pixel", 2 / (projection[5] * gl.canvas.height));
    program.set("1f", "slack", 1e-6 * norm(sub(look.boxBounds.max, look.boxBounds.min)));
    this.give(program, values, time);
    gl.bindVertexArray(this.array);
    this.within(all, [width, height], first, last, () => gl.drawArrays(gl.TRIANGLES, 0, 3));
  }

  /** Draws within the rectangle of the picture that a box covers. */
  within(all, [width, height], first, last, draw) {
    const { gl } = this;
    const corners = Array.from({ length: 8 }, (_, i) => transformed(all, [0, 1, 2].map((axis) => ((i >> axis) & 1 ? last : first)[axis])));
    if (corners.every((corner) => corner[3] > 0)) {
      const side = (axis, size) => {
        const at = corners.map((corner) => (0.5 + (0.5 * corner[axis]) / corner[3]) * size);
        const low = clamp(Math.floor(Math.min(...at)) - 1, 0, size);
        return [low, clamp(Math.ceil(Math.max(...at)) + 1, low, size) - low];
      };
      const [[x, w], [y, h]] = [side(0, width), side(1, height)];
      gl.enable(gl.SCISSOR_TEST);
      gl.scissor(x, y, w, h);
    }
    draw();
    gl.disable(gl.SCISSOR_TEST);
  }
}
