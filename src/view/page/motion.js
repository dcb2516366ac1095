// Where particles go: an arrow for the velocity of a part of them, and the way that a part of them has come.

/** The most arrows and trails. More hide each other. */
const MOST_ARROWS = 2500;
const MOST_TRAILS = 1200;

const ARROWS_VERTEX = `#version 300 es
precision highp float;
layout(location = 0) in vec3 from;
layout(location = 1) in vec3 to;
layout(location = 2) in float level;
layout(location = 3) in float vx;
layout(location = 4) in float vy;
layout(location = 5) in float vz;
uniform mat4 view, projection;
uniform vec3 low, size, slowest, spread;
uniform float part, seconds;
uniform vec2 page, tone;
uniform vec4 cut;
out float place;
void main() {
  vec3 levels = vec3(vx, vy, vz);
  vec3 p = low + mix(from, to, part) * (65535.0 / 65534.0) * size;
  gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
  // a level of 255 stands for no number
  if (from.x == 1.0 || to.x == 1.0 || any(greaterThan(levels, vec3(0.998))) || dot(cut.xyz, p) > cut.w) return;
  vec3 way = (slowest + levels * (255.0 / 254.0) * spread) * seconds;
  vec4 tail = projection * view * vec4(p, 1.0), tip = projection * view * vec4(p + way, 1.0);
  if (tail.w <= 0.0 || tip.w <= 0.0) return;
  vec2 a = tail.xy / tail.w * page, b = tip.xy / tip.w * page;
  float length_ = length(b - a);
  vec2 d = length_ > 1e-6 ? (b - a) / length_ : vec2(1.0, 0.0), n = vec2(-d.y, d.x);
  // a shaft of two triangles and a head of one, in pixels
  float head = min(8.0, 0.6 * length_), half_ = 0.9;
  vec2 neck = b - d * head;
  int k = gl_VertexID;
  vec2 corner = k == 0 || k == 3 ? a - n * half_ : k == 1 ? a + n * half_ : k == 2 || k == 4 ? neck + n * half_ : k == 5 ? neck - n * half_
    : k == 6 ? neck + n * head * 0.42 : k == 7 ? neck - n * head * 0.42 : b;
  float along = clamp(dot(corner - a, d) / max(length_, 1e-6), 0.0, 1.0);
  float depth = mix(tail.z / tail.w, tip.z / tip.w, along);
  gl_Position = vec4(corner / page, depth, 1.0);
  place = level > 0.998 ? -1.0 : level * (255.0 / 254.0) * tone.x + tone.y;
}`;

const TRAILS_VERTEX = `#version 300 es
precision highp float;
layout(location = 0) in vec3 position;
layout(location = 1) in vec2 told;
uniform mat4 view, projection;
uniform vec4 cut;
out float place, age;
void main() {
  place = told.x;
  age = told.y;
  gl_Position = dot(cut.xyz, position) > cut.w ? vec4(2.0, 2.0, 2.0, 1.0) : projection * view * vec4(position, 1.0);
}`;

const MOTION_FRAGMENT = (age) => `#version 300 es
precision highp float;
in float place${age ? ", age" : ""};
uniform sampler2D map;
out vec4 colour;
void main() {
  vec3 base = place < -0.5 ? vec3(0.5) : texture(map, vec2(clamp(place, 0.0, 1.0) * (255.0 / 256.0) + 0.5 / 256.0, 0.5)).rgb;
  float opacity = ${age ? "1.0 - age" : "1.0"};
  colour = vec4(base * opacity, opacity);
}`;

class MotionView {
  constructor(scene) {
    const { gl } = scene;
    this.scene = scene;
    this.gl = gl;
    this.arrows = scene.program(ARROWS_VERTEX, MOTION_FRAGMENT(false));
    this.trails = scene.program(TRAILS_VERTEX, MOTION_FRAGMENT(true));
    this.array = gl.createVertexArray();
    this.ways = { array: gl.createVertexArray(), buffer: gl.createBuffer(), count: 0, kind: null };
    gl.bindVertexArray(this.ways.array);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.ways.buffer);
    for (const [place, size, at] of [[0, 3, 0], [1, 2, 12]]) {
      gl.enableVertexAttribArray(place);
      gl.vertexAttribPointer(place, size, gl.FLOAT, false, 20, at);
    }
    gl.bindVertexArray(null);
  }

  begin(program, look, view, projection) {
    const { gl } = this;
    gl.useProgram(program.program);
    program.set("Matrix4fv", "view", false, view);
    program.set("Matrix4fv", "projection", false, projection);
    program.set("4f", "cut", ...(look.cutFluid ? look.cut : NO_CUT));
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, this.scene.map);
    program.set("1i", "map", 0);
  }

  /** Draws the way that particles would go in a time. */
  drawArrows(look, view, projection, { from, to, part }) {
    const { gl, arrows, scene } = this;
    const next = to.count === from.count ? to : from;
    const skip = Math.ceil(from.count / MOST_ARROWS);
    scene.fill("from", from, from.sites);
    if (next !== from) scene.fill("to", next, next.sites);
    scene.fill("level", from.levels[look.array], from.levels[look.array]);
    look.velocity.forEach((array, k) => scene.fill("velocity" + k, from.levels[array], from.levels[array]));
    gl.bindVertexArray(this.array);
    const sources = [["from", 3], [next === from ? "from" : "to", 3], ["level", 1], ["velocity0", 1], ["velocity1", 1], ["velocity2", 1]];
    sources.forEach(([buffer, size], place) => {
      gl.bindBuffer(gl.ARRAY_BUFFER, scene.buffers[buffer]);
      gl.enableVertexAttribArray(place);
      const [kind, bytes] = size === 3 ? [gl.UNSIGNED_SHORT, 6] : [gl.UNSIGNED_BYTE, 1];
      gl.vertexAttribPointer(place, size, kind, true, bytes * skip, 0);
      gl.vertexAttribDivisor(place, 1);
    });
    this.begin(arrows, look, view, projection);
    arrows.set("3f", "low", ...look.lattice.min);
    arrows.set("3f", "size", ...sub(look.lattice.max, look.lattice.min));
    arrows.set("1f", "part", next === from ? 0 : part);
    const ranges = look.velocity.map((array) => from.ranges[array]);
    arrows.set("3f", "slowest", ...ranges.map((range) => range.low));
    arrows.set("3f", "spread", ...ranges.map((range) => range.high - range.low));
    arrows.set("1f", "seconds", look.arrowSeconds);
    arrows.set("2f", "page", scene.canvas.width / 2 / look.ratio, scene.canvas.height / 2 / look.ratio);
    arrows.set("2f", "tone", ...toneOf(from.ranges[look.array], look.range));
    this.drawn = Math.floor((from.count - 1) / skip) + 1;
    gl.drawArraysInstanced(gl.TRIANGLES, 0, 9, this.drawn);
  }

  /** Draws where particles have been in the frames before `place`, the newer the stronger. */
  drawTrails(look, view, projection, frames, place) {
    const { gl, ways } = this;
    const kind = [frames.length, place, look.trailFrames, look.array, look.range.low, look.range.high, frames[frames.length - 1].time].join();
    if (ways.kind !== kind) {
      ways.kind = kind;
      const points = trails(look, frames, place);
      gl.bindBuffer(gl.ARRAY_BUFFER, ways.buffer);
      gl.bufferData(gl.ARRAY_BUFFER, points, gl.DYNAMIC_DRAW);
      ways.count = points.length / 5;
    }
    if (ways.count === 0) return;
    this.begin(this.trails, look, view, projection);
    gl.bindVertexArray(ways.array);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.depthMask(false);
    gl.drawArrays(gl.LINES, 0, ways.count);
    gl.depthMask(true);
    gl.disable(gl.BLEND);
  }
}

/** From a level of a frame to a place on the map: a factor and a summand. */
function toneOf(range, whole) {
  const width = whole.high - whole.low || 1;
  return [(range.high - range.low) / width, (range.low - whole.low) / width];
}

/** The lines of the trails up to a place between frames: position, place on the map and age of both ends of each piece. */
function trails(look, frames, place) {
  const last = Math.min(Math.floor(place + 1e-9), frames.length - 1);
  let first = last;
  // other particles have other ways
  while (first > 0 && last - first < look.trailFrames && frames[first - 1].count === frames[last].count) first--;
  const { count } = frames[last];
  const skip = Math.ceil(count / MOST_TRAILS);
  const { min } = look.lattice;
  const step = scale(sub(look.lattice.max, min), 1 / 65534);
  const tones = frames.slice(first, last + 1).map((frame) => toneOf(frame.ranges[look.array], look.range));
  // the piece up to the instant between two frames comes last
  const part = place - last;
  const next = part > 1e-6 && frames[last + 1]?.count === count ? frames[last + 1] : null;
  const length = last - first + (next ? part : 0);
  const found = new Float32Array(Math.ceil(count / skip) * (last - first + (next ? 1 : 0)) * 10);
  let at = 0;
  const put = (i, frame, other, share, tone, age) => {
    for (let k = 0; k < 3; k++) {
      const site = frame.sites[3 * i + k];
      found[at++] = min[k] + step[k] * (site + (other ? (other.sites[3 * i + k] - site) * share : 0));
    }
    const level = frame.levels[look.array][i];
    found[at++] = level === 255 ? -1 : (level / 254) * tone[0] + tone[1];
    found[at++] = age;
  };
  for (let i = 0; i < count; i += skip)
    for (let k = first; k < last + (next ? 1 : 0); k++) {
      const [frame, after] = [frames[k], frames[k + 1]];
      if (frame.sites[3 * i] === 65535 || after.sites[3 * i] === 65535) continue;
      const age = (j) => clamp(1 - (j - first) / Math.max(length, 1e-9), 0, 1);
      put(i, frame, null, 0, tones[k - first], age(k));
      if (k < last) put(i, after, null, 0, tones[k - first + 1], age(k + 1));
      else put(i, frame, after, part, tones[k - first], 0);
    }
  return found.subarray(0, at);
}
