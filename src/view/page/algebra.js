// Vectors are arrays of three numbers; matrices are columns one after another, as WebGL takes them.

const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
const sub = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const scale = (a, s) => [a[0] * s, a[1] * s, a[2] * s];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const norm = (a) => Math.hypot(a[0], a[1], a[2]);
const unit = (a) => (norm(a) > 0 ? scale(a, 1 / norm(a)) : a);
const clamp = (x, low, high) => Math.min(Math.max(x, low), high);

/** The product a·b of two 4 × 4 matrices. */
function times(a, b) {
  const c = new Float32Array(16);
  for (let column = 0; column < 4; column++)
    for (let row = 0; row < 4; row++)
      for (let k = 0; k < 4; k++) c[4 * column + row] += a[4 * k + row] * b[4 * column + k];
  return c;
}

/** The inverse of a 4 × 4 matrix, by elimination with pivots. */
function inverse(m) {
  const rows = [0, 1, 2, 3].map((row) => [0, 1, 2, 3, 4, 5, 6, 7].map((k) => (k < 4 ? m[4 * k + row] : k - 4 === row ? 1 : 0)));
  for (let k = 0; k < 4; k++) {
    const pivot = rows.slice(k).reduce((best, row, i) => (Math.abs(row[k]) > Math.abs(rows[best][k]) ? k + i : best), k);
    [rows[k], rows[pivot]] = [rows[pivot], rows[k]];
    rows[k] = rows[k].map((x) => x / rows[k][k]);
    rows.forEach((row, i) => { if (i !== k) rows[i] = row.map((x, j) => x - row[k] * rows[k][j]); });
  }
  return Float32Array.from({ length: 16 }, (_, i) => rows[i % 4][4 + Math.floor(i / 4)]);
}

/** A point through a 4 × 4 matrix, with four coordinates. */
function transformed(m, p) {
  return [0, 1, 2, 3].map((row) => m[row] * p[0] + m[4 + row] * p[1] + m[8 + row] * p[2] + m[12 + row]);
}

/** Rotations as quaternions [x, y, z, w]. */
const NO_TURN = [0, 0, 0, 1];

function turnAbout(axis, angle) {
  const s = Math.sin(angle / 2);
  return [axis[0] * s, axis[1] * s, axis[2] * s, Math.cos(angle / 2)];
}

function afterTurn(a, b) {
  const [v, w] = [a.slice(0, 3), b.slice(0, 3)];
  const xyz = add(add(scale(w, a[3]), scale(v, b[3])), cross(v, w));
  const q = [...xyz, a[3] * b[3] - dot(v, w)];
  const length = Math.hypot(...q);
  return q.map((x) => x / length);
}

function turned(q, p) {
  const v = q.slice(0, 3);
  const t = scale(cross(v, p), 2);
  return add(add(p, scale(t, q[3])), cross(v, t));
}

const back = (q) => [-q[0], -q[1], -q[2], q[3]];

/** The matrix that turns points about a centre. */
function turnMatrix(q, centre) {
  const columns = [[1, 0, 0], [0, 1, 0], [0, 0, 1]].map((axis) => turned(q, axis));
  const rest = sub(centre, turned(q, centre));
  return new Float32Array([...columns[0], 0, ...columns[1], 0, ...columns[2], 0, ...rest, 1]);
}

/** The pose between two others: it goes straight, or turns about a line, or both, evenly. */
function poseBetween(from, to, part) {
  const [a, b] = [from, to].map((pose) => [0, 3, 6, 9].map((k) => pose.slice(k, k + 3)));
  // the rotation from one to the other, its rows, and how far it moves what is at 0
  const rows = [0, 1, 2].map((i) => [0, 1, 2].map((j) => b[0][i] * a[0][j] + b[1][i] * a[1][j] + b[2][i] * a[2][j]));
  const way = sub(b[3], rows.map((row) => dot(row, a[3])));
  const twice = [rows[2][1] - rows[1][2], rows[0][2] - rows[2][0], rows[1][0] - rows[0][1]];
  const angle = Math.atan2(norm(twice), rows[0][0] + rows[1][1] + rows[2][2] - 1);
  const straight = norm(twice) < 1e-9;
  // half a turn has no side on which it goes
  if (straight && angle > 1) return part < 0.5 ? from : to;
  if (straight) return a.slice(0, 3).flat().concat(add(a[3], scale(way, part)));
  const axis = unit(twice);
  const along = scale(axis, dot(axis, way));
  const across = sub(way, along);
  const middle = scale(add(across, scale(cross(axis, across), 1 / Math.tan(angle / 2))), 0.5);
  const turn = turnAbout(axis, angle * part);
  const place = add(middle, turned(turn, sub(a[3], middle)));
  return a.slice(0, 3).flatMap((column) => turned(turn, column)).concat(add(place, scale(along, part)));
}

/** A number for people: three or four digits, and a power of ten where it is far from 1. */
function shown(x, digits = 3) {
  if (!Number.isFinite(x)) return "–";
  if (x === 0) return "0";
  const size = Math.abs(x);
  if (size >= 1e5 || size < 1e-3) {
    const [mantissa, power] = x.toExponential(digits - 1).split("e");
    const small = [...String(Number(power))].map((c) => (c === "-" ? "⁻" : "⁰¹²³⁴⁵⁶⁷⁸⁹"[Number(c)])).join("");
    const factor = String(Number(mantissa));
    return (factor === "1" ? "" : factor === "-1" ? "−" : factor.replace("-", "−") + "·") + "10" + small;
  }
  return String(Number(x.toPrecision(Math.max(digits, Math.ceil(Math.log10(size)))))).replace("-", "−");
}

/** A number for people with the digits that tell it apart from others which are this step away; `least` of them at least. */
function shownBy(x, step, least = 2) {
  if (x === 0 || !(step > 0)) return shown(x);
  const power = (value) => Math.floor(Math.log10(value) + 1e-9);
  // a step like 2.5 has two digits of its own
  const own = (step / 10 ** power(step)).toPrecision(6) % 1 ? 2 : 1;
  return shown(x, clamp(power(Math.abs(x)) - power(step) + own, least, 12));
}

/** The nearest of 1, 2, 5, 10, … at or below a number above 0. */
function rounded(x) {
  const power = 10 ** Math.floor(Math.log10(x));
  return Number(([5, 2, 1].find((k) => k * power <= x * (1 + 1e-9)) * power).toPrecision(6));
}

/** Round numbers between two values, about so many. */
function ticks(low, high, about = 5) {
  const width = high - low;
  if (!(width > 0) || !Number.isFinite(width)) return [low];
  const power = 10 ** Math.floor(Math.log10(width / about));
  const step = [1, 2, 2.5, 5, 10].map((k) => k * power).find((s) => width / s <= about * 1.01) ?? 10 * power;
  const found = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * width; k++) found.push(Number((k * step).toPrecision(12)));
  return found;
}
