// From where the scene is seen, and how pointers change that.

/** Half the angle of view, radians. */
const HALF_ANGLE = (17 * Math.PI) / 180;

/** The direction to the eye at the beginning: that of the pictures of `rfm run`. */
const FIRST_DIRECTION = unit([0.48, -1, 0.46]);

class Camera {
  constructor() {
    this.turn = NO_TURN;
    this.parallel = false;
    this.frame({ min: [0, 0, 0], max: [1, 1, 1] });
  }

  /** Takes the box that is to be seen. */
  frame({ min, max }) {
    this.centre = scale(add(min, max), 0.5);
    this.reach = Math.max(norm(sub(max, min)) / 2, 1e-9);
    this.home();
  }

  home() {
    this.look(FIRST_DIRECTION);
    this.target = this.centre;
    this.distance = (this.reach / Math.sin(HALF_ANGLE)) * 1.02;
    this.turn = NO_TURN;
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
    const eye = add(this.target, scale(towards, this.distance));
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
    const seen = (2 * Math.tan(HALF_ANGLE) * this.distance) / Math.min(aspect, 1);
    const zoom = clamp(this.renderedHeight(box, towards, at) / seen, 0.05, 20);
    // places are rounded to a part of the box, which may be millimetres wide
    const digits = clamp(5 - Math.floor(Math.log10(Math.max(...sub(box.max, box.min)))), 0, 20);
    const numbers = (v, places) => `[${v.map((x) => Number(x.toFixed(places)) + 0).join(", ")}]`;
    return `picture { camera: ${numbers(towards, 4)}, look_at: ${numbers(at, digits)}, zoom: ${Number(zoom.toPrecision(4))} }`;
  }

  /** How large `rfm render` draws a box seen from a direction, in a picture of its usual size: the height in metres, about a
   *  point, of what it leaves to the scene. It follows src/render/camera.rs. */
  renderedHeight({ min, max }, towards, point) {
    const [page, margins] = [[1280, 720], [48, 56, 150, 72].map((margin) => (margin * 720) / 960)];
    const room = [page[0] - margins[0] - margins[2], page[1] - margins[1] - margins[3]];
    const right = norm(cross([0, 0, 1], towards)) > 1e-12 ? unit(cross([0, 0, 1], towards)) : [1, 0, 0];
    const up = cross(towards, right);
    const eye = add(scale(add(min, max), 0.5), scale(towards, 3 * norm(sub(max, min))));
    const depth = (p) => dot(sub(eye, p), towards);
    const corners = [0, 1, 2, 3, 4, 5, 6, 7].map((i) => [0, 1, 2].map((axis) => ((i >> axis) & 1 ? max : min)[axis]));
    const seen = corners.map((p) => [right, up].map((axis) => dot(sub(p, eye), axis) / depth(p)));
    const extent = [0, 1].map((k) => Math.max(...seen.map((at) => at[k])) - Math.min(...seen.map((at) => at[k])));
    const focal = Math.min(room[0] / Math.max(extent[0], 1e-12), room[1] / Math.max(extent[1], 1e-12));
    return (room[1] * depth(point)) / focal;
  }

  /** The matrix from the eye to a page of so many pixels, whose middle is that of what the controls leave free. */
  projection([width, height], free) {
    const [w, h] = [Math.max(width - free.left - free.right, 60), Math.max(height - free.top - free.bottom, 60)];
    const aspect = w / h;
    // a narrow window keeps the whole box in its width
    const tangent = Math.tan(HALF_ANGLE) / Math.min(aspect, 1);
    const reach = this.reach * 3 + norm(sub(this.target, this.centre));
    let lens;
    if (this.parallel) {
      const half = tangent * this.distance;
      lens = [1 / (half * aspect), 0, 0, 0, 0, 1 / half, 0, 0, 0, 0, -1 / reach, 0, 0, 0, -this.distance / reach, 1];
    } else {
      const [far, near] = [this.distance + reach, Math.max(this.distance - reach, 0.003 * this.distance)];
      lens = [1 / (tangent * aspect), 0, 0, 0, 0, 1 / tangent, 0, 0, 0, 0, (far + near) / (near - far), -1, 0, 0, (2 * far * near) / (near - far), 0];
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
    const size = (2 * this.distance * Math.tan(HALF_ANGLE)) / height;
    this.target = add(this.target, add(scale(right, -dx * size), scale(up, dy * size)));
  }

  zoom(factor) {
    this.distance = clamp(this.distance * factor, this.reach * 0.05, this.reach * 60);
  }
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
