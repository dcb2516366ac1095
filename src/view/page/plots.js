// Small plots of probes over time, with the present time as a line.

const LINE_COLOURS = ["#3b7dd8", "#d9822b", "#4c9a52", "#b04a8f", "#7a6bd0", "#8a8f98"];

class Plots {
  constructor(place) {
    this.place = place;
    this.plots = [];
  }

  /** Takes plots: name, unit, times, and the values of each column. */
  set(plots) {
    this.place.replaceChildren();
    this.plots = plots.map((plot) => {
      const canvas = document.createElement("canvas");
      canvas.setAttribute("role", "img");
      canvas.setAttribute("aria-label", plot.name);
      this.place.append(canvas);
      return { ...plot, canvas };
    });
  }

  draw(time, colours, ratio) {
    for (const plot of this.plots) this.drawOne(plot, time, colours, ratio);
  }

  drawOne(plot, time, colours, ratio) {
    const [width, height] = [260, 110];
    const { canvas } = plot;
    [canvas.width, canvas.height] = [width * ratio, height * ratio];
    const context = canvas.getContext("2d");
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.font = '10px system-ui, "DejaVu Sans", sans-serif';
    context.textBaseline = "middle";
    const values = plot.columns.flatMap((column) => column.values.filter(Number.isFinite));
    let [low, high] = [values.reduce((a, b) => Math.min(a, b), Infinity), values.reduce((a, b) => Math.max(a, b), -Infinity)];
    if (!(low < high)) [low, high] = [low - 1, low + 1];
    const [first, last] = [plot.times[0], plot.times[plot.times.length - 1]];
    const [left, right, top, bottom] = [44, width - 8, 20, height - 16];
    const x = (t) => left + ((right - left) * (t - first)) / (last - first || 1);
    const y = (v) => bottom - ((bottom - top) * (v - low)) / (high - low);
    context.fillStyle = colours.text;
    context.textAlign = "left";
    context.fillText(plot.name, 6, 9);
    context.fillStyle = colours.soft;
    context.textAlign = "right";
    for (const tick of ticks(low, high, 3)) context.fillText(shown(tick), left - 4, y(tick));
    context.textAlign = "center";
    for (const tick of ticks(first, last, 4)) context.fillText(shown(tick), clamp(x(tick), left + 4, right - 8), height - 7);
    context.strokeStyle = colours.line;
    context.strokeRect(left, top, right - left, bottom - top);
    plot.columns.forEach((column, k) => {
      context.strokeStyle = context.fillStyle = LINE_COLOURS[k % LINE_COLOURS.length];
      context.beginPath();
      column.values.forEach((v, i) => Number.isFinite(v) && context.lineTo(x(plot.times[i]), y(v)));
      context.stroke();
      if (plot.columns.length > 1) {
        context.textAlign = "right";
        context.fillText(column.name, width - 8 - 48 * (plot.columns.length - 1 - k), 9);
      }
    });
    if (time >= first && time <= last) {
      context.strokeStyle = colours.soft;
      context.setLineDash([3, 3]);
      context.beginPath();
      context.moveTo(x(time), top);
      context.lineTo(x(time), bottom);
      context.stroke();
      context.setLineDash([]);
    }
  }
}
