// Small plots of quantities over time, with the present time as a line and the values that they have then.

const LINE_COLOURS = ["#3b7dd8", "#d9822b", "#4c9a52", "#b04a8f", "#7a6bd0", "#8a8f98"];

/** Sizes in pixels of the page: the width of a plot, the least and the usual height of its lines, the height of its title, its
 *  numbers and a row of its legend, what lies below the legend, the width of a value, what lies between plots. */
const PLOT = { width: 268, low: 36, lines: 74, title: 22, numbers: 18, row: 14, below: 6, value: 62, gap: 8 };

class Plots {
  /** `sought` is called with a time that was clicked. */
  constructor(place, sought) {
    this.place = place;
    this.plots = [];
    this.sought = sought;
    place.addEventListener("scroll", () => this.fade());
  }

  /** Takes plots: name, unit, times, and the values of each column. Those of the same names keep their place on the page. */
  set(plots) {
    const kind = JSON.stringify(plots.map(({ name, unit, columns }) => [name, unit, columns.map((column) => column.name)]));
    if (kind !== this.kind) {
      this.kind = kind;
      this.plots = plots.map(({ name, unit }) => {
        const canvas = element("canvas", { title: "click: go to that time" });
        canvas.setAttribute("role", "img");
        canvas.setAttribute("aria-label", unit ? `${name}, ${unit}` : name);
        const plot = { canvas };
        canvas.addEventListener("click", (event) => plot.at && this.sought(plot.at(event.offsetX)));
        return plot;
      });
      this.place.replaceChildren(...this.plots.map((plot) => plot.canvas));
    }
    plots.forEach((told, k) => Object.assign(this.plots[k], told, { still: null }));
  }

  draw(time, colours, ratio) {
    if (this.place.hidden) return;
    const lines = this.lines();
    for (const plot of this.plots) {
      if (!plot.still || plot.colours !== colours || plot.ratio !== ratio || plot.lines !== lines) this.prepare(plot, colours, ratio, lines);
      this.mark(plot, time);
    }
    this.fade();
  }

  /** Lets the last plot fade where the column goes on below, so that it does not seem to be cut off. */
  fade() {
    const { scrollHeight, scrollTop, clientHeight } = this.place;
    this.place.classList.toggle("goes-on", scrollHeight - scrollTop > clientHeight + 2);
  }

  /** The height of the lines with which all plots fit below each other, if there is one. */
  lines() {
    const context = this.measure ??= element("canvas").getContext("2d");
    context.font = PLOT_FONT;
    const rest = ({ columns }) => PLOT.title + PLOT.below + PLOT.numbers + PLOT.gap + PLOT.row * legendOf(context, columns).rows;
    // what the style lets the column have; a border is part of the gap
    const room = Number.parseFloat(getComputedStyle(this.place).maxHeight);
    const height = (room - this.plots.reduce((sum, plot) => sum + rest(plot), 0)) / Math.max(this.plots.length, 1);
    return Math.floor(clamp(height, PLOT.low, PLOT.lines));
  }

  /** Draws what does not change with the time that is shown. */
  prepare(plot, colours, ratio, lines) {
    const still = element("canvas");
    const context = still.getContext("2d");
    const begin = () => {
      context.setTransform(ratio, 0, 0, ratio, 0, 0);
      context.font = PLOT_FONT;
      context.textBaseline = "middle";
    };
    begin();
    const legend = legendOf(context, plot.columns);
    const { width } = PLOT;
    const top = PLOT.title + PLOT.row * legend.rows + PLOT.below;
    const bottom = top + lines;
    const height = bottom + PLOT.numbers;
    for (const canvas of [still, plot.canvas]) [canvas.width, canvas.height] = [width * ratio, height * ratio];
    plot.canvas.style.height = `${height}px`;
    begin(); // a new size has undone it
    const [low, high] = rangeOf(plot.columns);
    // one number alone says nothing of the scale
    const marks = [3, 4, 5, 6].map((about) => ticks(low, high, about)).find((found) => found.length > 1) ?? [low];
    const step = marks.length > 1 ? marks[1] - marks[0] : 0;
    const number = (value) => shownBy(value, step);
    const left = 10 + Math.max(...marks.map((mark) => context.measureText(number(mark)).width), 18);
    const right = width - 10;
    const [first, last] = [plot.times[0] ?? 0, plot.times[plot.times.length - 1] ?? 0];
    const x = (t) => left + ((right - left) * (t - first)) / (last - first || 1);
    const y = (v) => bottom - ((bottom - top) * (v - low)) / (high - low);
    context.fillStyle = colours.text;
    context.fillText(plot.unit ? `${plot.name}, ${plot.unit}` : plot.name, 6, 11, width - 12);
    context.fillStyle = colours.soft;
    context.strokeStyle = colours.line;
    for (const mark of marks) {
      context.textAlign = "right";
      context.fillText(number(mark), left - 4, y(mark));
      line(context, [[left, y(mark)], [right, y(mark)]]);
    }
    context.textAlign = "left";
    context.fillText("t, s", 6, height - 8);
    context.textAlign = "center";
    const times = ticks(first, last, 4);
    for (const mark of times) {
      const text = shownBy(mark, times.length > 1 ? times[1] - times[0] : 0);
      const half = context.measureText(text).width / 2;
      context.fillText(text, clamp(x(mark), left + half, right - half), height - 8);
      line(context, [[x(mark), bottom], [x(mark), bottom + 3]]);
    }
    context.strokeRect(left, top, right - left, bottom - top);
    plot.columns.forEach((column, k) => {
      context.strokeStyle = LINE_COLOURS[k % LINE_COLOURS.length];
      context.lineWidth = 1.3;
      // where a value is missing, the line has a gap
      for (const piece of pieces(plot.times, column.values)) {
        line(context, piece.map(([t, v]) => [x(t), y(v)]));
        if (piece.length !== 1) continue;
        context.fillStyle = context.strokeStyle;
        context.fillRect(x(piece[0][0]) - 2, y(piece[0][1]) - 2, 4, 4);
      }
    });
    const at = (pixel) => clamp(first + ((pixel - left) / (right - left)) * (last - first), first, last);
    Object.assign(plot, { still, colours, ratio, lines, legend, x, at, top, bottom, first, last, step, numbers: marks.map(number) });
  }

  /** Draws a plot with a line at a time, and the values at the nearest sample. */
  mark(plot, time) {
    const { canvas, still, colours, ratio, legend, x, top, bottom, first, last, step } = plot;
    const context = canvas.getContext("2d");
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.clearRect(0, 0, canvas.width, canvas.height);
    context.drawImage(still, 0, 0);
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.font = PLOT_FONT;
    context.textBaseline = "middle";
    const k = nearest(plot.times, time);
    plot.columns.forEach((column, n) => {
      const [left, row] = legend.places[n];
      const middle = PLOT.title + PLOT.row * (row + 0.5);
      context.fillStyle = LINE_COLOURS[n % LINE_COLOURS.length];
      context.fillRect(left, middle - 1, 10, 2);
      context.fillStyle = colours.text;
      context.fillText(column.name, left + 14, middle);
      context.fillStyle = colours.soft;
      context.textAlign = "right";
      context.fillText(shownBy(column.values[k] ?? NaN, step / 10, 3), left + legend.width, middle);
      context.textAlign = "left";
    });
    if (last > first && time >= first && time <= last) {
      context.strokeStyle = colours.text;
      context.setLineDash([3, 3]);
      line(context, [[x(time), top], [x(time), bottom]]);
    }
    context.setLineDash([]);
  }
}

const PLOT_FONT = '10.5px system-ui, "DejaVu Sans", sans-serif';

function line(context, points) {
  context.beginPath();
  points.forEach(([x, y]) => context.lineTo(x, y));
  context.stroke();
}

/** The rows of a legend: how many there are, the width of an entry, and for each column its left end and its row. */
function legendOf(context, columns) {
  const width = 14 + Math.max(...columns.map((column) => context.measureText(column.name).width), 0) + PLOT.value;
  let [left, row] = [6, 0];
  const places = columns.map(() => {
    if (left > 6 && left + width > PLOT.width - 6) [left, row] = [6, row + 1];
    const place = [left, row];
    left += width + 12;
    return place;
  });
  return { rows: row + 1, places, width };
}

/** The range of all values, with room above and below. */
function rangeOf(columns) {
  let [low, high] = [Infinity, -Infinity];
  for (const column of columns)
    for (const value of column.values) if (Number.isFinite(value)) [low, high] = [Math.min(low, value), Math.max(high, value)];
  if (low > high) return [0, 1];
  // a line that does not rise still needs a height around it
  const size = high - low > 1e-9 * Math.max(Math.abs(low), Math.abs(high)) ? high - low : Math.abs(high) || 1;
  return [low - 0.06 * size, high + 0.06 * size];
}

/** The stretches of a line without the values that are not numbers. */
function pieces(times, values) {
  const found = [[]];
  values.forEach((value, k) => {
    if (Number.isFinite(value)) found[found.length - 1].push([times[k], value]);
    else if (found[found.length - 1].length) found.push([]);
  });
  return found;
}

/** The number of the time that is nearest; times rise. */
function nearest(times, time) {
  let [low, high] = [0, times.length - 1];
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (times[middle] > time) high = middle;
    else low = middle;
  }
  return Math.abs(times[high] - time) < Math.abs(times[low] - time) ? high : low;
}
