// From where the scene is seen, and how pointers change that.

/** The distance of the eye from the middle of the box, in diagonals of the box: as in src/render/camera.rs. */
const EYE = 3;

/** The height of the first picture, in halves of that diagonal: a ball around the box is seen whole. */
const WHOLE = (2 * 1.02) / Math.sqrt(1 - 1 / (2 * EYE) ** 2);

/** How many times as large or small as at first things may become. */
const MOST_ZOOM = 20;

/** The direction to the eye at the beginning: that of the pictures of `rfm run`. */
const FIRST_DIRECTION = unit([0.48, -1, 0.46]);

/** The eye stays where it is when things become larger, as in the pictures of `rfm render`: so both have one perspective. */
class Camera {
  constructor() {
    this.turn = NO_TURN;
    this.parallel = false;
    this.frame({ min: [0, 0, 0], max: [1, 1, 1] });
  }

  /** Takes the box that is to be seen. */
  frame({ min, max }) {
    this.box = { min, max };
    this.centre = scale(add(min, max), 0.5);
    this.reach = Math.max(norm(sub(max, min)) / 2, 1e-9);
    this.home();
  }

  /** The view of the beginning: that which the scene states for its pictures, as far as it does. */
  home() {
    const { camera, look_at, zoom } = this.stated ?? {};
    this.look(camera ?? FIRST_DIRECTION);
    this.target = look_at ?? this.centre;
    /** The height of what is seen about the target, m, where the picture is no narrower than it is high. */
    this.height = WHOLE * this.reach;
    if (zoom) this.height = this.renderedHeight(this.box, this.axes().towards, this.target) / zoom;
    this.turn = NO_TURN;
  }

  /** The distance of the eye from the middle of the box, m. */
  get distance() {
    return 2 * EYE * this.reach;
  }

  /** Looks from a direction. */
  look(direction) {
    const d = unit(direction);
    this.elevation = Math.asin(clamp(d[2], -1, 1));
    if (Math.hypot(d[0], d[1]) > 1e-6) this.azimuth = Math.atan2(d[1], d[0]);
    else this.azimuth = -Math.PI / 2;
  }

  axes() {
    const [ca, sa, ce, se] = [Math.cos(this.azimuth), Math.sin(this.azimuth), Math.cos(this.elevation), Math.sin(this.elevation)];
    const towards = [ce * ca, ce * sa, se];
    const right = [-sa, ca, 0];
    return { right, up: cross(towards, right), towards };
  }

  /** The matrix from the box to the eye. */
  view() {
    const { right, up, towards } = this.axes();
    const eye = add(this.centre, scale(towards, this.distance));
    const look = new Float32Array([
      right[0], up[0], towards[0], 0, right[1], up[1], towards[1], 0, right[2], up[2], towards[2], 0,
      -dot(right, eye), -dot(up, eye), -dot(towards, eye), 1,
    ]);
    return times(look, turnMatrix(this.turn, this.centre));
  }

  /** The camera as a scene states it: the direction to the eye, the place in the middle, how large the picture is. */
  key(box, [width, height], free) {
    const towards = turned(back(this.turn), this.axes().towards);
    const at = add(this.centre, turned(back(this.turn), sub(this.target, this.centre)));
    const aspect = Math.max(width - free.left - free.right, 60) / Math.max(height - free.top - free.bottom, 60);
    const zoom = clamp((this.renderedHeight(box, towards, at) / this.height) * Math.min(aspect, 1), 0.05, 20);
    // places are rounded to a part of the box, which may be millimetres wide
    const digits = clamp(5 - Math.floor(Math.log10(Math.max(...sub(box.max, box.min)))), 0, 20);
    const numbers = (v, places) => `[${v.map((x) => Number(x.toFixed(places)) + 0).join(", ")}]`;
    const projection = this.parallel ? ", projection: parallel" : "";
    return `picture { camera: ${numbers(towards, 4)}, look_at: ${numbers(at, digits)}, zoom: ${Number(zoom.toPrecision(4))}${projection} }`;
  }

  /** How large `rfm render` draws a box seen from a direction, in a picture of its usual size: the height in metres, about a
   *  point, of what it leaves to the scene. It follows src/render/camera.rs. */
  renderedHeight({ min, max }, towards, point) {
    const [page, margins] = [[1280, 720], [48, 56, 150, 72].map((margin) => (margin * 720) / 960)];
    const room = [page[0] - margins[0] - margins[2], page[1] - margins[1] - margins[3]];
    const right = norm(cross([0, 0, 1], towards)) > 1e-12 ? unit(cross([0, 0, 1], towards)) : [1, 0, 0];
    const up = cross(towards, right);
    const eye = add(scale(add(min, max), 0.5), scale(towards, EYE * norm(sub(max, min))));
    const depth = (p) => (this.parallel ? 1 : dot(sub(eye, p), towards));
    const corners = [0, 1, 2, 3, 4, 5, 6, 7].map((i) => [0, 1, 2].map((axis) => ((i >> axis) & 1 ? max : min)[axis]));
    const seen = corners.map((p) => [right, up].map((axis) => dot(sub(p, eye), axis) / depth(p)));
    const extent = [0, 1].map((k) => Math.max(...seen.map((at) => at[k])) - Math.min(...seen.map((at) => at[k])));
    const focal = Math.min(room[0] / Math.max(extent[0], 1e-12), room[1] / Math.max(extent[1], 1e-12));
    return (room[1] * depth(point)) / focal;
  }

  /** The matrix from the eye to a page of so many pixels. The target is in the middle of what the controls leave free. */
  projection([width, height], free) {
    const [w, h] = [Math.max(width - free.left - free.right, 60), Math.max(height - free.top - free.bottom, 60)];
    const aspect = w / h;
    // a narrow window keeps the whole box in its width
    const half = this.height / Math.min(aspect, 1) / 2;
    const [sx, sy] = [1 / (half * aspect), 1 / half];
    const { right, up, towards } = this.axes();
    const [tx, ty, tz] = [right, up, towards].map((axis) => dot(axis, sub(this.target, this.centre)));
    const [reach, depth] = [3 * this.reach, this.distance - tz];
    let lens;
    if (this.parallel) lens = [sx, 0, 0, 0, 0, sy, 0, 0, 0, 0, -1 / reach, 0, -sx * tx, -sy * ty, -this.distance / reach, 1];
    else {
      const [far, near] = [this.distance + reach, this.distance - reach];
      lens = [sx * depth, 0, 0, 0, 0, sy * depth, 0, 0, sx * tx, sy * ty, (far + near) / (near - far), -1, 0, 0, (2 * far * near) / (near - far), 0];
    }
    const [x, y] = [(2 * free.left + w) / width - 1, 1 - (2 * free.top + h) / height];
    const place = new Float32Array([w / width, 0, 0, 0, 0, h / height, 0, 0, 0, 0, 1, 0, x, y, 0, 1]);
    return times(place, lens);
  }

  orbit(dx, dy) {
    this.azimuth -= dx * 0.0075;
    this.elevation = clamp(this.elevation + dy * 0.0075, -Math.PI / 2, Math.PI / 2);
  }

  /** Turns the box itself, about the axes of the picture. */
  turnBox(dx, dy) {
    const { right, up } = this.axes();
    this.turn = afterTurn(afterTurn(turnAbout(up, dx * 0.0075), turnAbout(right, dy * 0.0075)), this.turn);
  }

  pan(dx, dy, height) {
    const { right, up } = this.axes();
    const size = this.height / height;
    const off = sub(add(this.target, add(scale(right, -dx * size), scale(up, dy * size))), this.centre);
    // it stays before the eye from wherever it is looked at
    this.target = add(this.centre, scale(off, Math.min(1, (2 * this.reach) / Math.max(norm(off), 1e-300))));
  }

  zoom(factor) {
    const first = WHOLE * this.reach;
    this.height = clamp(this.height * factor, first / MOST_ZOOM, first * MOST_ZOOM);
  }
}

/** What makes the picture of `rfm render` that of the viewer besides the camera, in words. `at` is where the cut is, m. */
function besides({ cutting: { axis, solid, fluid }, obstacle, looks }, bodies, at, hasSolid) {
  const flags = [];
  if (axis !== "none" && (solid || fluid)) flags.push(`--cut ${axis}=${Number(at.toPrecision(4))}${fluid ? " --cut-fluid" : ""}`);
  else if (hasSolid) flags.push("--cut none");
  const alone = bodies.length ? looks.map((look, k) => [look, bodies[k]]) : [[hasSolid ? obstacle : "opaque", "NAME"]];
  for (const [look, name] of alone) if (look !== "opaque") flags.push(`${look === "hidden" ? "--hide" : "--glass"} ${name}`);
  return flags.length ? `; beside it: ${flags.join(" ")}` : "";
}

/** Listens to pointers on the canvas. `changed` is called after each change, `turns` says whether a drag turns the box. */
function listenToPointers(canvas, camera, { changed, begun, ended, turns }) {
  const pointers = new Map();
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("pointerdown", (event) => {
    canvas.focus({ preventScroll: true });
    canvas.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, [event.clientX, event.clientY]);
    begun();
  });
  canvas.addEventListener("pointermove", (event) => {
    const before = pointers.get(event.pointerId);
    if (!before) return;
    const now = [event.clientX, event.clientY];
    const [dx, dy] = [now[0] - before[0], now[1] - before[1]];
    if (pointers.size === 2) {
      const other = [...pointers].find(([id]) => id !== event.pointerId)[1];
      const length = (p) => Math.hypot(p[0] - other[0], p[1] - other[1]);
      camera.zoom(length(before) / Math.max(length(now), 1));
      camera.pan(dx / 2, dy / 2, canvas.clientHeight);
    } else if (event.buttons & 6 || event.shiftKey) camera.pan(dx, dy, canvas.clientHeight);
    else if (turns()) camera.turnBox(dx, dy);
    else camera.orbit(dx, dy);
    pointers.set(event.pointerId, now);
    changed();
  });
  for (const end of ["pointerup", "pointercancel"])
    canvas.addEventListener(end, (event) => {
      pointers.delete(event.pointerId);
      if (pointers.size === 0) ended();
    });
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    const lines = event.deltaMode === 1 ? 33 : 1;
    camera.zoom(Math.exp(clamp(event.deltaY * lines, -200, 200) * 0.0015));
    changed();
  }, { passive: false });
}
