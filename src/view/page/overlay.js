// What is written over the picture: the legend, the time, the axes, the lengths of the box. It is part of saved pictures.

/** Draws the overlay on a canvas of so many pixels; `ratio` is the number of pixels for one of the page. */
function drawOverlay(context, size, ratio, look, camera, seen, caption) {
  context.setTransform(1, 0, 0, 1, 0, 0);
  context.clearRect(0, 0, size[0], size[1]);
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  const page = [size[0] / ratio, size[1] / ratio];
  context.font = '12px system-ui, "DejaVu Sans", sans-serif';
  context.textBaseline = "middle";
  if (look.box) drawLengths(context, page, look, seen);
  drawAxes(context, page, look, camera, seen);
  // above the legend of the colours stands what else there is to say
  const height = legendHeight(page, look);
  if (look.legend && height > 0) drawLegend(context, page, look, height);
  const left = look.free.legend + 18;
  let bottom = page[1] - look.free.bottom - 12 - (look.legend ? height + 32 : 0);
  if (look.arrows && look.velocity && look.legend) {
    context.fillStyle = look.colours.soft;
    context.textAlign = "left";
    write(context, look, `arrows: way in ${shown(look.arrowSeconds)} s`, left, bottom);
    bottom -= 18;
  }
  if (look.slice) drawSliceLegend(context, look, look.slice, [left, bottom], height);
  if (caption) {
    context.fillStyle = look.colours.text;
    context.textAlign = "left";
    caption.forEach((line, i) => write(context, look, line, 14, 22 + 18 * i));
  }
}

/** Writes a text with a border in the colour of the paper, so that it can be read over lines. */
function write(context, look, text, x, y) {
  context.save();
  context.lineJoin = "round";
  context.lineWidth = 3.5;
  context.strokeStyle = `rgb(${look.colours.back.map((c) => 255 * c).join()})`;
  context.strokeText(text, x, y);
  context.restore();
  context.fillText(text, x, y);
}

/** The height of a legend below the title; 0 where there is no room for one. */
function legendHeight(page, look) {
  const height = Math.min(190, page[1] * 0.34, page[1] - look.free.bottom - look.free.title - 40);
  return height < 60 ? 0 : height;
}

function drawLegend(context, page, look, height) {
  const width = 14;
  const [left, top] = [18 + look.free.legend, page[1] - look.free.bottom - height - 12];
  const { low, high } = look.range;
  for (let y = 0; y < height; y++) {
    const [r, g, b] = colourAt(look.map, 1 - (y + 0.5) / height);
    context.fillStyle = `rgb(${r},${g},${b})`;
    context.fillRect(left, top + y, width, 1.5);
  }
  context.strokeStyle = look.colours.soft;
  context.lineWidth = 1;
  context.strokeRect(left - 0.5, top - 0.5, width + 1, height + 1);
  // values beyond an end have its colour: the bar ends in a tip there
  for (const [isOpen, part, y, tip] of [[look.isOpen[0], 0, top + height, 7], [look.isOpen[1], 1, top, -7]]) {
    if (!isOpen) continue;
    context.fillStyle = `rgb(${colourAt(look.map, part).join()})`;
    context.beginPath();
    context.moveTo(left - 0.5, y);
    context.lineTo(left + width / 2, y + tip);
    context.lineTo(left + width + 0.5, y);
    context.closePath();
    context.fill();
    context.stroke();
  }
  context.fillStyle = look.colours.text;
  context.textAlign = "left";
  const { name, unit } = look.legend;
  write(context, look, unit ? `${name}, ${unit}` : name, left, top - 14);
  const marks = ticks(low, high, height > 120 ? 5 : 3);
  for (const tick of marks) {
    const y = top + height * (1 - (high > low ? (tick - low) / (high - low) : 0));
    context.beginPath();
    context.moveTo(left + width, y);
    context.lineTo(left + width + 4, y);
    context.stroke();
    write(context, look, shownBy(tick, marks.length > 1 ? marks[1] - marks[0] : 0, 4), left + width + 8, y);
  }
}

/** Where a point of the box is on the page; null behind the eye. */
function onPage(seen, page, p) {
  const [x, y, , w] = transformed(seen.all, p);
  return w > 0 ? [(0.5 + (0.5 * x) / w) * page[0], (0.5 - (0.5 * y) / w) * page[1]] : null;
}

/** Writes the extent of the box along one edge of each axis: that farthest from the middle of the picture. */
function drawLengths(context, page, look, seen) {
  const { min, max } = look.boxBounds;
  const middle = onPage(seen, page, scale(add(min, max), 0.5));
  if (!middle) return;
  context.fillStyle = look.colours.soft;
  context.textAlign = "center";
  const taken = [];
  for (let axis = 0; axis < 3; axis++) {
    const [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
    const edges = [];
    for (const a of [min, max])
      for (const b of [min, max]) {
        const from = [0, 0, 0];
        [from[u], from[v], from[axis]] = [a[u], b[v], min[axis]];
        const to = [...from];
        to[axis] = max[axis];
        const [p, q] = [onPage(seen, page, from), onPage(seen, page, to)];
        if (p && q) edges.push({ p, q, low: axis === 2 ? -(p[0] + q[0]) : p[1] + q[1] });
      }
    // the vertical axis is labelled at the left, the others below
    edges.sort((a, b) => b.low - a.low);
    const edge = edges[0];
    if (!edge || Math.hypot(edge.p[0] - edge.q[0], edge.p[1] - edge.q[1]) < 60) continue;
    const out = unit([(edge.p[0] + edge.q[0]) / 2 - middle[0], (edge.p[1] + edge.q[1]) / 2 - middle[1], 0]);
    const along = (t) => [edge.p[0] + (edge.q[0] - edge.p[0]) * t, edge.p[1] + (edge.q[1] - edge.p[1]) * t];
    // what rounding has left of 0 is 0
    const rounded = (x) => (Math.abs(x) < 1e-9 * (max[axis] - min[axis]) ? 0 : x);
    // where two edges meet, a number that would touch another one stands further along its own edge
    const label = (parts, text) => {
      const half = context.measureText(text).width / 2 + 4;
      const touches = ([x, y]) => taken.some((other) => Math.abs(x - other.x) < half + other.half && Math.abs(y - other.y) < 15);
      const places = parts.map(along).map((p) => [p[0] + out[0] * 17, p[1] + out[1] * 13]);
      const [x, y] = places.find((place) => !touches(place)) ?? places[0];
      taken.push({ x, y, half });
      write(context, look, text, x, y);
    };
    label([0.06, 0.12, 0.18, 0.24, 0.3], shown(rounded(min[axis])));
    label([0.5], `${"xyz"[axis]}, m`);
    label([0.94, 0.88, 0.82, 0.76, 0.7], shown(rounded(max[axis])));
  }
}

/** The axes and gravity, in the corner. */
function drawAxes(context, page, look, camera, seen) {
  const [x, y, length] = [page[0] - look.free.right - 48, page[1] - look.free.bottom - 46, 26];
  const arms = [0, 1, 2].map((axis) => ({ d: [seen.view[4 * axis], seen.view[4 * axis + 1], seen.view[4 * axis + 2]], text: "xyz"[axis], colour: ["#cc4b42", "#4c9a52", "#4777c8"][axis] }));
  if (look.gravity && norm(look.gravity) > 0) {
    const g = unit(look.gravity);
    const d = [0, 1, 2].map((row) => g[0] * seen.view[row] + g[1] * seen.view[4 + row] + g[2] * seen.view[8 + row]);
    arms.push({ d, text: "g", colour: look.colours.soft });
  }
  arms.sort((a, b) => a.d[2] - b.d[2]);
  context.textAlign = "center";
  for (const { d, text, colour } of arms) {
    const [ex, ey] = [x + d[0] * length, y - d[1] * length];
    context.strokeStyle = context.fillStyle = colour;
    context.lineWidth = 2;
    context.beginPath();
    context.moveTo(x, y);
    context.lineTo(ex, ey);
    context.stroke();
    write(context, look, text, x + d[0] * (length + 10), y - d[1] * (length + 10));
  }
}
