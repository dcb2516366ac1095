// Frames and meshes from blocks: the length of a head, the head as JSON, planes of bytes.

const unfold = (x) => (x >>> 1) ^ -(x & 1);

/** Numbers of 16 bits from a plane of low bytes and one of high bytes. */
class Planes {
  constructor(bytes) {
    this.bytes = bytes;
    this.at = 0;
  }
  take(count) {
    if (this.at + count > this.bytes.length) throw new Error("a block of data is cut off");
    return this.bytes.subarray(this.at, (this.at += count));
  }
}

/** The head and the planes of a block. */
function opened(bytes) {
  const length = new DataView(bytes.buffer, bytes.byteOffset).getUint32(0, true);
  const head = JSON.parse(new TextDecoder().decode(bytes.subarray(4, 4 + length)));
  return [head, new Planes(bytes.subarray(4 + length))];
}

/** The blocks of a group, each behind its length. */
function* blocksOf(bytes) {
  for (let at = 0; at < bytes.length; ) {
    const length = new DataView(bytes.buffer, bytes.byteOffset + at).getUint32(0, true);
    yield bytes.subarray(at + 4, (at += 4 + length));
  }
}

/** The value of every level of a range. */
const valuesOf = ({ low, high }) => Float64Array.from({ length: 256 }, (_, level) => low + (level / 254) * (high - low));

/** Adds the speeds that velocities let expect to what is left of them. */
function addSpeeds(levels, { velocity, speed }, values, { low, high }) {
  const [x, y, z] = velocity.map((k, axis) => Float64Array.from(levels[k], (level) => values[axis][level] * values[axis][level]));
  const left = levels[speed];
  const width = high - low;
  if (!(width > 0)) return;
  for (let i = 0; i < left.length; i++)
    left[i] += Math.floor(Math.min(Math.max(((Math.sqrt(x[i] + y[i] + z[i]) - low) / width) * 254, 0), 254) + 0.5);
}

/** A frame; one that follows holds differences from the frame before. */
function frameOf(head, planes, before) {
  const n = head.count;
  const sites = new Uint16Array(3 * n);
  if (head.follows && before?.count !== n) throw new Error("a frame is missing");
  const axes = [0, 1, 2].map(() => [planes.take(n), planes.take(n)]);
  const { motion } = head;
  const levels = head.ranges.map((_, k) => {
    const plane = planes.take(n);
    if (!head.follows || k === motion?.speed) return plane.slice();
    const then = before.levels[k];
    return plane.map((x, i) => x + then[i]);
  });
  const velocities = motion?.velocity.map((k) => valuesOf(head.ranges[k]));
  if (motion && motion.speed !== null) addSpeeds(levels, motion, velocities, head.ranges[motion.speed]);
  axes.forEach(([low, high], axis) => {
    const then = head.follows ? before.sites : new Uint16Array(3 * n);
    const from = head.follows ? unfold : (x) => x;
    for (let i = 0, j = axis; i < n; i++, j += 3) sites[j] = then[j] + from(low[i] | (high[i] << 8));
    if (!motion || !head.follows) return;
    const [values, k] = [velocities[axis], motion.velocity[axis]];
    const [early, late] = [before.levels[k], levels[k]];
    for (let i = 0, j = axis; i < n; i++, j += 3) sites[j] += Math.floor(motion.steps[axis] * (values[early[i]] + values[late[i]]) + 0.5);
  });
  return { ...head, sites, levels };
}

/** Vectors between two corners of a box. */
function vectorsOf(planes, n, low, high) {
  const out = new Float32Array(3 * n);
  for (let axis = 0; axis < 3; axis++) {
    const [lower, upper] = [planes.take(n), planes.take(n)];
    const step = (high[axis] - low[axis]) / 65534;
    for (let i = 0, site = 0; i < n; i++) {
      site = (site + unfold(lower[i] | (upper[i] << 8))) & 65535;
      out[3 * i + axis] = low[axis] + site * step;
    }
  }
  return out;
}

/** A mesh: positions and normals as floats, corners as indices. */
function meshOf(head, planes) {
  const n = head.count;
  const positions = vectorsOf(planes, n, head.min, head.max);
  const normals = vectorsOf(planes, n, [-1, -1, -1], [1, 1, 1]);
  const m = 3 * head.triangles;
  const bytes = [0, 1, 2, 3].map(() => planes.take(m));
  const corners = new Uint32Array(m);
  for (let i = 0, corner = 0; i < m; i++) {
    corner = (corner + unfold((bytes[0][i] | (bytes[1][i] << 8) | (bytes[2][i] << 16) | (bytes[3][i] << 24)) >>> 0)) >>> 0;
    corners[i] = corner;
  }
  return { ...head, positions, normals, corners };
}

/** The surface of a fluid: a corner is new, or was new so many vertices ago. Its normals are those of its triangles. */
function surfaceOf(head, planes) {
  const positions = vectorsOf(planes, head.count, head.min, head.max);
  const m = 3 * head.triangles;
  const bytes = [0, 1, 2, 3].map(() => planes.take(m));
  const corners = new Uint32Array(m);
  for (let i = 0, next = 0; i < m; i++) {
    const ago = bytes[0][i] | (bytes[1][i] << 8) | (bytes[2][i] << 16) | (bytes[3][i] << 24);
    corners[i] = ago === 0 ? next++ : next - ago;
  }
  const normals = new Float32Array(3 * head.count);
  for (let i = 0; i < m; i += 3) {
    const [a, b, c] = [3 * corners[i], 3 * corners[i + 1], 3 * corners[i + 2]];
    const [ux, uy, uz] = [positions[b] - positions[a], positions[b + 1] - positions[a + 1], positions[b + 2] - positions[a + 2]];
    const [vx, vy, vz] = [positions[c] - positions[a], positions[c + 1] - positions[a + 1], positions[c + 2] - positions[a + 2]];
    const [x, y, z] = [uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx];
    for (const k of [a, b, c]) [normals[k], normals[k + 1], normals[k + 2]] = [normals[k] + x, normals[k + 1] + y, normals[k + 2] + z];
  }
  return { ...head, positions, normals, corners };
}

/** The bytes of a block of a saved page. */
async function inflated(base64) {
  const text = atob(base64.trim());
  const bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; i++) bytes[i] = text.charCodeAt(i);
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate-raw"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}
