// What is drawn: particles, obstacles, the edges of the box. It knows WebGL and nothing of time or controls.

/** The most particles that are drawn while the picture moves. */
const MOST_WHILE_MOVING = 250_000;

class Scene {
  constructor(canvas) {
    this.canvas = canvas;
    this.moving = false;
    this.drawn = 0;
    canvas.addEventListener("webglcontextlost", (event) => event.preventDefault());
    canvas.addEventListener("webglcontextrestored", () => { this.prepare(); this.restored?.(); });
    this.prepare();
  }

  prepare() {
    const gl = this.canvas.getContext("webgl2", { alpha: false, antialias: true, stencil: true, powerPreference: "high-performance" });
    if (!gl) throw new Error("this browser has no WebGL 2, which the picture needs");
    this.gl = gl;
    this.points = this.program(POINTS_VERTEX, POINTS_FRAGMENT);
    this.mesh = this.program(MESH_VERTEX, MESH_FRAGMENT);
    this.lines = this.program(LINES_VERTEX, LINES_FRAGMENT);
    this.map = gl.createTexture();
    this.buffers = Object.fromEntries(["from", "to", "level", "edges", "section", "velocity0", "velocity1", "velocity2"].map((name) => [name, gl.createBuffer()]));
    this.pointsArray = gl.createVertexArray();
    this.edgesArray = gl.createVertexArray();
    this.sectionArray = gl.createVertexArray();
    this.parts = { solid: null, water: null };
    this.shown = {};
    this.edges = 0;
    this.slice = new SliceView(this);
    this.motion = new MotionView(this);
    const field = this.exact?.field;
    this.exact = new ExactView(this);
    if (field) this.exact.set(field);
  }

  program(vertex, fragment) {
    const gl = this.gl;
    const program = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS) && !gl.isContextLost()) throw new Error(gl.getShaderInfoLog(shader));
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost()) throw new Error(gl.getProgramInfoLog(program));
    const places = new Map();
    return {
      program,
      /** Sets a uniform by its name. */
      set(kind, name, ...values) {
        if (!places.has(name)) places.set(name, gl.getUniformLocation(program, name));
        gl["uniform" + kind](places.get(name), ...values);
      },
    };
  }

  /** Gives the box: lowest and highest corner. */
  setBox({ min, max }) {
    const gl = this.gl;
    const corner = (i) => [0, 1, 2].map((axis) => ((i >> axis) & 1 ? max : min)[axis]);
    const lines = [];
    for (let i = 0; i < 8; i++) for (let axis = 0; axis < 3; axis++) if (!((i >> axis) & 1)) lines.push(...corner(i), ...corner(i | (1 << axis)));
    gl.bindVertexArray(this.edgesArray);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffers.edges);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(lines), gl.STATIC_DRAW);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 0, 0);
    gl.bindVertexArray(null);
    this.edges = lines.length / 3;
  }

  setMap(name) {
    const gl = this.gl;
    gl.bindTexture(gl.TEXTURE_2D, this.map);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, 256, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, mapTexels(name));
    for (const [key, value] of [[gl.TEXTURE_MIN_FILTER, gl.LINEAR], [gl.TEXTURE_MAG_FILTER, gl.LINEAR], [gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE], [gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE]])
      gl.texParameteri(gl.TEXTURE_2D, key, value);
  }

  get solid() {
    return this.parts.solid;
  }

  /** Whether a part of the solids has a look. A mesh may hold several bodies as one part; the last bodies may have none. */
  hasLook(look, k, wanted) {
    const [parts, names] = [this.solid.triangles.length, look.looks.length];
    return (parts <= names && (parts > 1 || names === 1) ? look.looks[k] : look.obstacle) === wanted;
  }

  /** Whether any part of the solids has a look. */
  anyHas(look, wanted) {
    return this.solid?.triangles.some((_, k) => this.hasLook(look, k, wanted)) ?? false;
  }

  /** Gives the mesh that is shown as the solids or as the water, and where its parts are; `null`: where they were. */
  setMesh(name, mesh, poses = null) {
    if (this.shown[name] !== mesh) this.fillMesh(name, mesh);
    if (this.parts[name]) this.parts[name].poses = poses;
  }

  fillMesh(name, mesh) {
    this.shown[name] = mesh;
    const gl = this.gl;
    if (this.parts[name]) {
      gl.deleteVertexArray(this.parts[name].array);
      this.parts[name].buffers.forEach((buffer) => gl.deleteBuffer(buffer));
      this.parts[name] = null;
    }
    if (!mesh || mesh.corners.length === 0) return;
    const array = gl.createVertexArray();
    gl.bindVertexArray(array);
    const buffers = [mesh.positions, mesh.normals].map((data, place) => {
      const buffer = gl.createBuffer();
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
      gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW);
      gl.enableVertexAttribArray(place);
      gl.vertexAttribPointer(place, 3, gl.FLOAT, false, 0, 0);
      return buffer;
    });
    const corners = gl.createBuffer();
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, corners);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, mesh.corners, gl.STATIC_DRAW);
    gl.bindVertexArray(null);
    this.parts[name] = { array, buffers: [...buffers, corners], triangles: mesh.parts, poses: null };
  }

  fill(name, owner, data) {
    if (this.shown[name] === owner) return;
    this.shown[name] = owner;
    this.gl.bindBuffer(this.gl.ARRAY_BUFFER, this.buffers[name]);
    this.gl.bufferData(this.gl.ARRAY_BUFFER, data, this.gl.DYNAMIC_DRAW);
  }

  /** Waits until the picture has been drawn. */
  wait() {
    this.gl.readPixels(0, 0, 1, 1, this.gl.RGBA, this.gl.UNSIGNED_BYTE, new Uint8Array(4));
  }

  /** Draws everything. `look` says how; `frames` are the two between which the time lies, of the frames of `timeline`. */
  draw(look, view, projection, frames, timeline) {
    const gl = this.gl;
    const [width, height] = [this.canvas.width, this.canvas.height];
    gl.viewport(0, 0, width, height);
    gl.clearColor(...look.colours.back, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT | gl.STENCIL_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.depthMask(true);
    gl.disable(gl.BLEND);
    if (look.obstacle === "opaque") this.exact.measure(look, view, projection, look.time, look.values);
    if (this.exact.isShown(look)) this.exact.draw(look, view, projection, look.time, look.values);
    else if (this.anyHas(look, "opaque")) this.drawMesh("solid", look, view, projection, 1);
    if (this.parts.water && look.water === "opaque") this.drawMesh("water", look, view, projection, 1);
    const fluid = frames?.from.count > 0;
    if (fluid && (look.particles || look.lacksSurface)) this.drawPoints(look, view, projection, frames);
    if (fluid && look.arrows && look.velocity) this.motion.drawArrows(look, view, projection, frames);
    this.drawLines(look, view, projection);
    if (fluid && look.trails) this.motion.drawTrails(look, view, projection, timeline.frames, look.blended ? timeline.place : Math.floor(timeline.place + 1e-9));
    if (look.slice) this.slice.draw(look.slice, view, projection);
    if (this.parts.water && look.water === "transparent") this.drawMesh("water", look, view, projection, 0.45);
    if (this.anyHas(look, "transparent")) this.drawMesh("solid", look, view, projection, 0.3);
  }

  /** The part of what is seen of the particles that the obstacle hides. */
  hiddenPart(look, view, projection, frames) {
    const gl = this.gl;
    const [width, height] = [240, 180];
    const [target, colours, depths] = [gl.createFramebuffer(), gl.createTexture(), gl.createRenderbuffer()];
    gl.bindTexture(gl.TEXTURE_2D, colours);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA8, width, height, 0, gl.RGBA, gl.UNSIGNED_BYTE, null);
    gl.bindRenderbuffer(gl.RENDERBUFFER, depths);
    gl.renderbufferStorage(gl.RENDERBUFFER, gl.DEPTH_COMPONENT24, width, height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, target);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, colours, 0);
    gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.RENDERBUFFER, depths);
    gl.viewport(0, 0, width, height);
    gl.enable(gl.DEPTH_TEST);
    gl.clearColor(0, 0, 0, 0);
    const [seen, left] = [false, true].map((isBehind) => {
      gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
      gl.colorMask(false, false, false, false);
      if (isBehind) this.drawMesh("solid", { ...look, cutSolid: false }, view, projection, 1);
      gl.colorMask(true, true, true, true);
      this.drawPoints(look, view, projection, frames, height);
      const pixels = new Uint8Array(4 * width * height);
      gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
      return pixels.reduce((sum, value, k) => sum + (k % 4 === 3 && value > 0 ? 1 : 0), 0);
    });
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.deleteFramebuffer(target);
    gl.deleteTexture(colours);
    gl.deleteRenderbuffer(depths);
    return seen > 0 ? 1 - left / seen : 0;
  }

  drawLines(look, view, projection) {
    const gl = this.gl;
    gl.useProgram(this.lines.program);
    this.lines.set("Matrix4fv", "view", false, view);
    this.lines.set("Matrix4fv", "projection", false, projection);
    this.lines.set("4f", "paint", ...look.colours.edges, 1);
    gl.bindVertexArray(this.edgesArray);
    if (look.box) gl.drawArrays(gl.LINES, 0, this.edges);
  }

  drawMesh(name, look, view, projection, opacity) {
    const gl = this.gl;
    const { mesh } = this;
    const part = this.parts[name];
    const isWater = name === "water";
    gl.useProgram(mesh.program);
    mesh.set("Matrix4fv", "view", false, view);
    mesh.set("Matrix4fv", "projection", false, projection);
    mesh.set("3f", "base", ...(isWater ? look.colours.water : look.colours.solid));
    mesh.set("3f", "section", ...(isWater ? look.colours.depth : look.colours.section));
    mesh.set("1f", "opacity", opacity);
    mesh.set("1f", "parallel", look.parallel ? 1 : 0);
    mesh.set("4f", "cut", ...((isWater ? look.cutFluid : look.cutSolid) ? look.cut : NO_CUT));
    gl.bindVertexArray(part.array);
    const draw = () => {
      let first = 0;
      part.triangles.forEach((triangles, k) => {
        mesh.set("Matrix4fv", "pose", false, poseMatrix(part.poses?.[k]));
        const isDrawn = isWater || this.hasLook(look, k, opacity === 1 ? "opaque" : "transparent");
        if (isDrawn) gl.drawElements(gl.TRIANGLES, 3 * triangles, gl.UNSIGNED_INT, 12 * first);
        first += triangles;
      });
    };
    if (opacity === 1) {
      draw();
      if ((isWater ? look.cutFluid : look.cutSolid) && look.cut !== NO_CUT) this.drawSection(draw, look, view, projection, isWater ? look.colours.depth : look.colours.section);
      return;
    }
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.depthMask(false);
    gl.enable(gl.CULL_FACE);
    gl.cullFace(gl.FRONT);
    draw();
    gl.cullFace(gl.BACK);
    draw();
    gl.disable(gl.CULL_FACE);
    gl.depthMask(true);
    gl.disable(gl.BLEND);
  }

  /** Closes a mesh that is cut open with its section: where its inner sides prevail, the plane lies within it. */
  drawSection(draw, look, view, projection, colour) {
    const gl = this.gl;
    gl.colorMask(false, false, false, false);
    gl.depthMask(false);
    gl.disable(gl.DEPTH_TEST);
    gl.enable(gl.STENCIL_TEST);
    gl.stencilFunc(gl.ALWAYS, 0, 255);
    gl.stencilOpSeparate(gl.FRONT, gl.KEEP, gl.KEEP, gl.DECR_WRAP);
    gl.stencilOpSeparate(gl.BACK, gl.KEEP, gl.KEEP, gl.INCR_WRAP);
    draw();
    gl.colorMask(true, true, true, true);
    gl.depthMask(true);
    gl.enable(gl.DEPTH_TEST);
    gl.stencilFunc(gl.NOTEQUAL, 0, 255);
    gl.stencilOp(gl.KEEP, gl.KEEP, gl.KEEP);
    const [nx, ny, nz, offset] = look.cut;
    const axis = [nx, ny, nz].findIndex((n) => n !== 0);
    const [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
    const { min, max } = look.boxBounds;
    const room = norm(sub(max, min));
    const corners = [[-1, -1], [1, -1], [-1, 1], [1, 1]].flatMap(([a, b]) => {
      const corner = scale(add(min, max), 0.5).map((x, k) => x + room * (k === u ? a : k === v ? b : 0));
      corner[axis] = offset / look.cut[axis];
      return corner;
    });
    gl.bindVertexArray(this.sectionArray);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffers.section);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(corners), gl.DYNAMIC_DRAW);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 0, 0);
    gl.useProgram(this.lines.program);
    this.lines.set("Matrix4fv", "view", false, view);
    this.lines.set("Matrix4fv", "projection", false, projection);
    this.lines.set("4f", "paint", ...colour, 1);
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
    gl.disable(gl.STENCIL_TEST);
    gl.clear(gl.STENCIL_BUFFER_BIT);
  }

  drawPoints(look, view, projection, { from, to, part }, height = this.canvas.height) {
    const gl = this.gl;
    const { points } = this;
    // frames with other particles cannot be blended
    const next = to.count === from.count ? to : from;
    this.fill("from", from, from.sites);
    if (next !== from) this.fill("to", next, next.sites);
    this.fill("level", from.levels[look.array], from.levels[look.array]);
    const skip = this.moving ? Math.ceil(from.count / MOST_WHILE_MOVING) : 1;
    gl.bindVertexArray(this.pointsArray);
    for (const [place, buffer, size, kind, bytes] of [
      [0, "from", 3, gl.UNSIGNED_SHORT, 6],
      [1, next === from ? "from" : "to", 3, gl.UNSIGNED_SHORT, 6],
      [2, "level", 1, gl.UNSIGNED_BYTE, 1],
    ]) {
      gl.bindBuffer(gl.ARRAY_BUFFER, this.buffers[buffer]);
      gl.enableVertexAttribArray(place);
      gl.vertexAttribPointer(place, size, kind, true, bytes * skip, 0);
    }
    gl.useProgram(points.program);
    points.set("Matrix4fv", "view", false, view);
    points.set("Matrix4fv", "projection", false, projection);
    points.set("3f", "low", ...look.lattice.min);
    points.set("3f", "size", ...sub(look.lattice.max, look.lattice.min));
    points.set("1f", "part", next === from ? 0 : part);
    points.set("1f", "radius", look.radius);
    points.set("1f", "height", height);
    // balls that stand out of a plane would hide what is seen in it
    const cut = look.cutFluid ? look.cut : NO_CUT;
    const isSeen = cut !== NO_CUT && (look.slice || (look.cutSolid && this.anyHas(look, "opaque")));
    points.set("4f", "cut", ...cut.slice(0, 3), isSeen ? cut[3] - 1.1 * look.radius : cut[3]);
    points.set("2f", "tone", ...toneOf(from.ranges[look.array], look.range));
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, this.map);
    points.set("1i", "map", 0);
    this.drawn = Math.floor(from.count / skip);
    gl.drawArrays(gl.POINTS, 0, this.drawn);
  }
}

/** A pose, the columns of a rotation and a translation, as a matrix. */
const poseMatrix = (pose) =>
  pose ? [0, 1, 2, 3].flatMap((k) => [...pose.slice(3 * k, 3 * k + 3), k === 3 ? 1 : 0]) : [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];

/** A plane that leaves nothing out. */
const NO_CUT = [0, 0, 0, 1];
