// The programs of the graphics processor.

const POINTS_VERTEX = `#version 300 es
precision highp float;
layout(location = 0) in vec3 from;
layout(location = 1) in vec3 to;
layout(location = 2) in float level;
uniform mat4 view, projection;
uniform vec3 low, size;
uniform float part, radius, height;
uniform vec4 cut;            // what lies on the positive side of this plane is left out
uniform vec2 tone;           // from a level to a place on the map
out float place;
void main() {
  // a site of 65535 stands for no position
  if (from.x == 1.0 || to.x == 1.0) { gl_Position = vec4(2.0, 2.0, 2.0, 1.0); gl_PointSize = 1.0; return; }
  vec3 p = low + mix(from, to, part) * (65535.0 / 65534.0) * size;
  if (dot(cut.xyz, p) > cut.w) { gl_Position = vec4(2.0, 2.0, 2.0, 1.0); gl_PointSize = 1.0; return; }
  vec4 seen = view * vec4(p, 1.0);
  vec4 centre = projection * seen;
  gl_PointSize = clamp(radius * projection[1][1] * height / centre.w, 1.5, 512.0);
  // a particle is a point and may touch walls: its ball stands in front of them
  seen.z += radius;
  gl_Position = projection * seen;
  place = level > 0.998 ? -1.0 : level * (255.0 / 254.0) * tone.x + tone.y;
}`;

const POINTS_FRAGMENT = `#version 300 es
precision highp float;
in float place;
uniform sampler2D map;
out vec4 colour;
void main() {
  vec2 q = 2.0 * gl_PointCoord - 1.0;
  float r2 = dot(q, q);
  if (r2 > 1.0) discard;
  vec3 normal = vec3(q.x, -q.y, sqrt(1.0 - r2));
  vec3 base = place < -0.5 ? vec3(0.5) : texture(map, vec2(clamp(place, 0.0, 1.0) * (255.0 / 256.0) + 0.5 / 256.0, 0.5)).rgb;
  float light = max(dot(normal, normalize(vec3(-0.4, 0.65, 0.75))), 0.0);
  float sky = 0.5 + 0.5 * normal.y;
  float gloss = pow(max(dot(normal, normalize(vec3(-0.22, 0.37, 0.95))), 0.0), 40.0);
  colour = vec4(base * (0.42 + 0.16 * sky + 0.5 * light) + 0.14 * gloss, 1.0);
}`;

const MESH_VERTEX = `#version 300 es
precision highp float;
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 direction;
uniform mat4 view, projection, pose;
out vec3 normal, seen, place;
void main() {
  vec4 now = pose * vec4(position, 1.0);
  vec4 p = view * now;
  place = now.xyz;
  seen = p.xyz;
  normal = mat3(view) * mat3(pose) * direction;
  gl_Position = projection * p;
}`;

/** The colour of a surface with a normal, seen from a direction. */
const SHADED = `
vec3 shaded(vec3 base, vec3 n, vec3 eye) {
  vec3 lamp = normalize(vec3(-0.4, 0.65, 0.75));
  float light = max(dot(n, lamp), 0.0), sky = 0.5 + 0.5 * n.y;
  float gloss = pow(max(dot(n, normalize(lamp + eye)), 0.0), 30.0);
  return base * (0.4 + 0.22 * sky + 0.42 * light) + 0.08 * gloss;
}`;

const MESH_FRAGMENT = `#version 300 es
precision highp float;
in vec3 normal, seen, place;
uniform vec3 base, section;
uniform float opacity, parallel;
uniform vec4 cut;
out vec4 colour;
${SHADED}
void main() {
  if (dot(cut.xyz, place) > cut.w) discard;
  vec3 n = normalize(normal);
  vec3 eye = parallel > 0.5 ? vec3(0.0, 0.0, 1.0) : normalize(-seen);
  if (!gl_FrontFacing) {
    // the inside of a solid that is cut open looks like the plane of the cut
    if (opacity > 0.99 && dot(cut.xyz, cut.xyz) > 0.0) { colour = vec4(section, 1.0); return; }
    n = -n;
  }
  float rim = 1.0 - abs(dot(n, eye));
  float alpha = opacity > 0.99 ? 1.0 : mix(opacity, min(1.0, opacity + 0.55), rim * rim * rim);
  colour = vec4(shaded(base, n, eye) * alpha, alpha);
}`;

const LINES_VERTEX = `#version 300 es
precision highp float;
layout(location = 0) in vec3 position;
uniform mat4 view, projection;
void main() { gl_Position = projection * view * vec4(position, 1.0); }`;

const LINES_FRAGMENT = `#version 300 es
precision highp float;
uniform vec4 paint;
out vec4 colour;
void main() { colour = paint; }`;
