// Brings everything together: what is shown, the controls, the keys, and where frames come from.

const byId = (id) => document.getElementById(id);

/** An obstacle that hides more than this part of the fluid at first begins transparent. */
const MOST_HIDDEN = 0.35;

class Viewer {
  constructor(setting) {
    this.canvas = byId("view");
    this.overlay = byId("overlay");
    this.scene = new Scene(this.canvas);
    this.camera = new Camera();
    this.timeline = new Timeline();
    this.plots = new Plots(byId("plots"), (time) => this.seek(time));
    this.meshes = [];
    this.surfaces = [];
    this.carried = null;
    this.values = new Map();
    this.errors = [];
    this.run = { number: 0, playing: false, speed: 1 };
    this.stats = { draws: 0, milliseconds: 0 };
    this.look = {
      colours: sceneColours(), obstacle: "opaque", bodies: Object.create(null), surface: "automatic", water: "transparent", particles: !setting.has_surface, box: true, array: 0, map: "blue–yellow–red", fixed: null, blend: true,
      cutting: { axis: "none", part: 0.5, flipped: false, solid: true, fluid: true }, turns: false, gravityInRoom: true,
      slicing: { axis: "none", part: 0.5 }, arrows: false, arrowLength: 1, trails: false, trailFrames: 12,
    };
    this.begin(setting);
    this.take(setting);
    this.camera.frame(this.look.boxBounds);
    this.scene.setMap(this.look.map);
    this.scene.restored = () => { this.scene.setMap(this.look.map); this.scene.setBox(this.look.boxBounds); this.changed(); };
    this.listen();
    this.showPanel(innerWidth > 720);
    this.showPlots(innerWidth >= 1000);
    if (setting.live) this.live = new Live((kind, content) => this.told(kind, content));
  }

  /** Begins as the scene says that its pictures are drawn. */
  begin({ picture, box: { min, max } }) {
    if (!picture) return;
    const { look } = this;
    this.camera.parallel = picture.parallel;
    if (picture.obstacle) [look.obstacle, this.isJudged] = [picture.obstacle, true];
    for (const name of picture.glass) look.bodies[name] = "transparent";
    for (const name of picture.hide) look.bodies[name] = "hidden";
    if (!picture.cut) return;
    const { axis, at, below } = picture.cut;
    look.cutting = { axis: "xyz"[axis], part: clamp((at - min[axis]) / (max[axis] - min[axis]), 0, 1), flipped: below, solid: true, fluid: false };
  }

  /** Takes what is told of a scene besides its frames. */
  take(setting) {
    this.setting = setting;
    const { look } = this;
    this.values = new Map(setting.params.map(({ name, value }) => [name, value]));
    look.boxBounds = setting.box;
    this.camera.stated = setting.picture;
    look.lattice = setting.lattice ?? setting.box;
    look.radius = setting.radius || 0;
    look.array = Math.min(look.array, Math.max(setting.arrays.length - 1, 0));
    const isAnother = this.solid !== undefined && this.solid !== setting.solids[0];
    this.solid = setting.solids[0];
    if (isAnother) this.camera.frame(look.boxBounds);
    byId("title").textContent = document.title = setting.title;
    byId("facts").textContent = setting.facts;
    this.scene.setBox(setting.box);
    if (setting.plots) this.tellPlots(setting.plots);
    const goesOn = setting.arrays.length > 0 || setting.moves;
    byId("transport").hidden = !goesOn;
    byId("record").hidden = !window.MediaRecorder || !goesOn;
    // a file that has lost its fluid, or the motion of its solid, or has become another: its frames have other arrays
    const arrays = setting.arrays.map((array) => array.name).join();
    const isOther = this.arrays !== undefined && arrays !== this.arrays;
    this.arrays = arrays;
    if ((isOther || !goesOn) && this.timeline.frames.length) {
      this.timeline.clear();
      this.timelineChanged();
      this.tellPlots([]);
      this.camera.frame(look.boxBounds);
    }
    // controls in use stay as they are: only another set of them is built anew
    const kind = JSON.stringify([setting.params.map(({ name, range, unit }) => [name, range, unit]), setting.arrays.map((array) => array.name), [...setting.solids].sort(), setting.bodies]);
    if (kind !== this.kind) buildPanel(byId("panel"), this);
    else showParams(setting.params);
    if (byId("solid")) byId("solid").value = setting.solids[0];
    this.kind = kind;
    this.changed();
  }

  /** Reads the blocks of a saved page, one group after another. */
  async read() {
    const groups = [...document.querySelectorAll('script[type="application/octet-stream"]')];
    let before = null;
    for (const [number, group] of groups.entries()) {
      for (const block of blocksOf(await inflated(group.textContent))) {
        const [head, planes] = opened(block);
        if (head.kind === "mesh") this.meshes.push(meshOf(head, planes));
        else if (head.kind === "surface") this.surfaces.push(surfaceOf(head, planes));
        else {
          before = frameOf(head, planes, before);
          this.timeline.add(before);
        }
      }
      group.remove();
      this.state(number < groups.length - 1 ? `reading ${number + 1} of ${groups.length}` : "");
      this.timelineChanged();
      this.changed();
    }
    this.timeline.speed = this.timeline.natural();
    this.showSpeed();
    if (this.timeline.last > 0 && !matchMedia("(prefers-reduced-motion: reduce)").matches) this.play(true);
  }

  /** Takes a message of a simulation that runs. */
  told(kind, content) {
    const { timeline } = this;
    switch (kind) {
      case "setting":
        this.take(content);
        break;
      case "frame": {
        if (content.run < this.run.number) return;
        if (content.run > this.run.number || content.time < (timeline.frames[timeline.last]?.time ?? 0)) timeline.clear();
        this.run.number = content.run;
        const following = timeline.place >= timeline.last;
        timeline.add(content);
        timeline.thin();
        if (following) timeline.place = timeline.last;
        this.timelineChanged();
        break;
      }
      case "mesh":
        [this.meshes, this.carried] = [[content], null];
        break;
      case "carried":
        this.carried = content;
        break;
      case "field":
        this.field = content;
        this.isTried = false;
        this.scene.exact.set(content);
        break;
      case "slice":
        this.slice = content;
        break;
      case "plots":
        this.tellPlots(content.plots);
        break;
      case "status":
        Object.assign(this.run, { playing: content.playing, speed: content.speed });
        this.notice(content.error);
        this.state(content.text);
        if (byId("latency")) byId("latency").textContent = content.latency ?? "";
        this.showPlaying();
        break;
      case "connection":
        if (!content) this.state("no connection: the program has ended, or is out of reach");
        break;
      default:
        throw new Error(`a message of an unknown kind: ${kind}`);
    }
    this.changed();
  }

  state(text) {
    byId("state").textContent = text;
  }

  /** Shows an error over the last good picture; nothing if there is none. */
  notice(text) {
    if (text === this.noticed) return;
    this.noticed = text;
    byId("notice").hidden = !text;
    // a quoted line stands whole over its marks, everything else breaks where it is too long
    const lines = (text ?? "").trimEnd().split("\n").map((line) => (/^ *\d* *\|/.test(line) ? element("span", { className: "quoted" }, line) : line));
    byId("notice").replaceChildren(...lines.flatMap((line) => [line, "\n"]).slice(0, -1));
  }

  send(command) {
    this.live?.send(command);
  }

  // ---- time

  play(on) {
    if (this.live) this.send({ do: on ? "play" : "pause" });
    else this.timeline.playing = on;
    if (this.live && on) this.timeline.place = this.timeline.last;
    this.before = null;
    this.showPlaying();
    this.changed();
  }

  get playing() {
    return this.live ? this.run.playing : this.timeline.playing;
  }

  step(by) {
    const { timeline } = this;
    this.play(false);
    if (this.live && by > 0 && timeline.place >= timeline.last) this.send({ do: "step" });
    else timeline.step(by);
    this.timelineChanged();
    this.changed();
  }

  seek(time) {
    this.play(false);
    this.timeline.seek(time);
    if (this.live || !this.look.blend) this.timeline.place = Math.round(this.timeline.place);
    this.timelineChanged();
    this.changed();
  }

  restart() {
    if (this.live) this.send({ do: "restart" });
    else this.timeline.place = 0;
    this.timelineChanged();
    this.changed();
  }

  showPlaying() {
    byId("play").textContent = this.playing ? "❚❚" : "▶";
    byId("play").setAttribute("aria-pressed", String(this.playing));
  }

  showSpeed() {
    byId("speed").value = String(this.timeline.speed);
  }

  timelineChanged() {
    const { timeline } = this;
    const scrub = byId("scrub");
    scrub.max = timeline.last;
    scrub.value = timeline.place;
    const frames = timeline.frames.length;
    byId("time").textContent = frames ? `${timeline.timeText(timeline.duration < 1 ? 4 : 3)} s · ${Math.floor(timeline.place + 1e-9) + 1}/${frames}` : "";
  }

  // ---- the picture

  /** Asks for a new picture. */
  changed() {
    if (this.asked) return;
    this.asked = true;
    requestAnimationFrame((now) => {
      this.asked = false;
      if (this.timeline.pass(this.before ? Math.min((now - this.before) / 1000, 0.25) : 0)) {
        this.timelineChanged();
        this.changed();
      }
      this.before = now;
      this.draw();
    });
  }

  /** Settles the range of the colours and the plane of the cut. */
  settle() {
    const { look, setting, timeline, camera } = this;
    const array = setting.arrays[look.array];
    if (array) {
      const ranges = timeline.frames.map((frame) => frame.ranges[look.array]);
      const found = { low: Math.min(...ranges.map((r) => r.low)), high: Math.max(...ranges.map((r) => r.high)) };
      // most arrays of a run that goes on have no range of their own: that of its frames
      look.range = look.fixed ?? array.range ?? (ranges.length ? found : { low: 0, high: 1 });
      // frames and the program round ranges differently
      const slack = 1e-5 * (found.high - found.low);
      look.isOpen = [found.low < look.range.low - slack, found.high > look.range.high + slack];
      look.legend = (look.particles || look.arrows || look.trails) && timeline.frames.length ? array : null;
      this.showRange();
    }
    const { axis, part, flipped } = look.cutting;
    const k = "xyz".indexOf(axis);
    const at = this.placeOf(look.cutting);
    const sign = flipped ? -1 : 1;
    look.cut = k < 0 ? NO_CUT : [0, 1, 2].map((i) => (i === k ? sign : 0)).concat(sign * at);
    [look.cutSolid, look.cutFluid] = [look.cutting.solid, look.cutting.fluid];
    look.free = this.free();
    this.settleMotion();
    if (byId("cut-value")) byId("cut-value").textContent = k < 0 ? "" : `${shown(at)} m`;
    look.parallel = camera.parallel;
    look.looks = setting.bodies.map((name) => look.bodies[name] ?? look.obstacle);
    look.isMixed = look.looks.some((one) => one !== look.obstacle);
    look.gravity = setting.gravity;
    if (setting.live && setting.gravity) {
      look.gravity = look.gravityInRoom ? turned(back(camera.turn), setting.gravity) : setting.gravity;
      const text = look.gravity.map((g) => g.toFixed(4)).join();
      if (this.gravity !== undefined && this.gravity !== text) this.send({ do: "gravity", vector: look.gravity });
      this.gravity = text;
    }
  }

  /** The coordinate of a plane across an axis; 0 if there is none. */
  placeOf({ axis, part }) {
    const k = "xyz".indexOf(axis);
    const { min, max } = this.look.boxBounds;
    return k < 0 ? 0 : min[k] + part * (max[k] - min[k]);
  }

  /** Settles the slice that is shown, and what arrows and trails need. */
  settleMotion() {
    const { look, setting, timeline } = this;
    const k = "xyz".indexOf(look.slicing.axis);
    look.slice = k >= 0 && this.slice?.axis === k ? this.slice : null;
    if (byId("slice-value")) byId("slice-value").textContent = k < 0 ? "" : `${shown(this.placeOf(look.slicing))} m`;
    const components = ["velocity x", "velocity y", "velocity z"].map((name) => setting.arrays.findIndex((array) => array.name === name));
    look.velocity = components.includes(-1) ? null : components;
    look.blended = look.blend && !this.live;
    // the fastest particle of the scale goes an eighth of the box's diagonal, in a round time
    const speed = setting.arrays.find((array) => array.name === "speed")?.range?.high;
    const last = timeline.frames[timeline.last];
    const fastest = speed || (last && look.velocity ? Math.max(...look.velocity.map((array) => Math.max(last.ranges[array].high, -last.ranges[array].low))) : 0);
    look.arrowSeconds = rounded(((this.camera.reach * 0.25) / (fastest || 1)) * look.arrowLength);
    if (byId("arrow-value")) byId("arrow-value").textContent = `way in ${shown(look.arrowSeconds)} s`;
    if (byId("trail-value")) {
      const end = clamp(Math.floor(timeline.place + 1e-9), 0, timeline.last);
      const start = timeline.frames[Math.max(end - look.trailFrames, 0)];
      byId("trail-value").textContent = start ? `${shown(timeline.frames[end].time - start.time)} s` : "";
    }
  }

  /** Shows the obstacle with another value of a param. */
  tryParam(name, value) {
    const exact = this.scene.exact.isShown({ ...this.look, onlyMesh: false }) && !this.field.fixed.includes(name);
    this.isTried = !exact;
    if (!exact) return this.send({ do: "try", name, value });
    this.values.set(name, value);
    const began = performance.now();
    this.draw();
    this.scene.wait();
    const took = performance.now() - began;
    byId("latency").textContent = `the obstacle followed in ${took.toFixed(0)} ms, without a mesh`;
    // from near it may take longer than where it was measured
    if (took > 4 * SLOW) this.scene.exact.milliseconds = took;
    // what is shown besides it is found by the program
    if (this.look.slicing.axis !== "none") this.send({ do: "try", name, value });
  }

  /** Asks for ω in the plane that is chosen. */
  askSlice() {
    const { slicing } = this.look;
    this.send({ do: "slice", axis: slicing.axis === "none" ? null : slicing.axis, at: this.placeOf(slicing) });
    this.changed();
  }

  /** What the controls leave free of the page, as distances from its edges. */
  free() {
    const [panel, transport, { look }] = [byId("panel"), byId("transport"), this];
    const bottom = transport.hidden ? 10 : innerHeight - transport.getBoundingClientRect().top;
    const free = { left: 0, right: 0, top: 30, bottom, legend: 0, title: 0 };
    if (innerWidth <= 720) free.title = byId("facts").getBoundingClientRect().bottom;
    const plots = byId("plots");
    if (!plots.hidden && plots.children.length > 0 && innerWidth > 720) {
      free.legend = plots.getBoundingClientRect().right;
      free.left = free.legend + 60;
    }
    if (look.slicing.axis !== "none" && innerWidth > 720) free.left += 30;
    if (panel.hidden) return free;
    if (innerWidth > 720) free.right = innerWidth - panel.getBoundingClientRect().left;
    else {
      // where there is no room beside the controls, they lie over the picture
      const above = panel.getBoundingClientRect().top;
      if (above > Math.max(innerHeight / 3, 200)) free.bottom = innerHeight - above;
    }
    return free;
  }

  showRange() {
    for (const [id, value] of [["low", this.look.range.low], ["high", this.look.range.high]]) {
      const input = byId(id);
      if (input && input !== document.activeElement) input.value = Number(value.toPrecision(4));
    }
  }

  draw(whole = null) {
    const began = performance.now();
    const { canvas, overlay, look, camera, timeline, scene } = this;
    const ratio = Math.min(devicePixelRatio || 1, 2);
    const size = [Math.max(Math.round(canvas.clientWidth * ratio), 1), Math.max(Math.round(canvas.clientHeight * ratio), 1)];
    for (const target of [canvas, overlay]) if (target.width !== size[0] || target.height !== size[1]) [target.width, target.height] = size;
    this.settle();
    if (whole) look.free = whole;
    const frames = timeline.shown(look.blend && !this.live);
    scene.moving = this.dragging || timeline.playing;
    // a param that the formula has no uniform for is seen in the mesh alone
    Object.assign(look, { time: frames?.from.time ?? 0, values: this.values, onlyMesh: this.isTried });
    const { poses, mesh } = frames ? solidsBetween(frames) : {};
    const carried = poses ? this.carried : null;
    scene.setMesh("solid", carried ?? this.meshes[mesh ?? 0] ?? null, this.live && !carried ? null : poses);
    // some frames of a run may have none, and what is not blended is that of the nearer one
    const near = frames && (frames.part < 0.5 ? frames.from : frames.to);
    look.lacksSurface = this.setting.has_surface && look.water !== "hidden" && near?.surface === undefined;
    scene.setMesh("water", this.surfaces[near?.surface ?? -1] ?? null);
    const view = camera.view();
    const page = size.map((x) => x / ratio);
    const projection = camera.projection(page, look.free);
    look.ratio = ratio;
    if (!this.isJudged && scene.solid && frames?.from.count > 0) {
      this.isJudged = true;
      if (scene.hiddenPart(look, view, projection, frames) > MOST_HIDDEN) {
        byId("obstacle").value = look.obstacle = "transparent";
        this.settle();
      }
    }
    scene.draw(look, view, projection, frames, timeline);
    const seen = { view, all: times(projection, view) };
    drawOverlay(overlay.getContext("2d"), size, ratio, look, camera, seen, null);
    this.plots.draw(timeline.time, look.colours, ratio);
    if (byId("surface-said")) byId("surface-said").textContent = scene.exact.said(look);
    this.film?.add(canvas, overlay);
    this.stats.draws++;
    this.stats.milliseconds = performance.now() - began;
  }

  /** The picture with its legend and title on a canvas of its own. */
  composed() {
    const whole = { left: 0, right: 0, top: 20, bottom: 10, legend: 0, title: 0 };
    this.draw(whole);
    const { canvas, look, camera, timeline } = this;
    const picture = element("canvas", { width: canvas.width, height: canvas.height });
    const context = picture.getContext("2d");
    context.drawImage(canvas, 0, 0);
    const ratio = canvas.width / canvas.clientWidth;
    const labels = element("canvas", { width: canvas.width, height: canvas.height });
    const view = camera.view();
    const seen = { view, all: times(camera.projection([canvas.width / ratio, canvas.height / ratio], whole), view) };
    const caption = [this.setting.title].concat(timeline.frames.length ? [`t = ${timeline.timeText(3)} s`] : []);
    drawOverlay(labels.getContext("2d"), [canvas.width, canvas.height], ratio, look, camera, seen, caption);
    context.drawImage(labels, 0, 0);
    this.changed();
    return picture;
  }

  screenshot() {
    this.composed().toBlob((blob) => this.save(blob, "png"), "image/png");
  }

  save(blob, ending) {
    const name = this.setting.title.replace(/[^\p{L}\p{N}._-]+/gu, "-").replace(/^[-.]+|[-.]+$/g, "") || "rfm";
    const link = element("a", { href: URL.createObjectURL(blob), download: `${name}.${ending}` });
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
  }

  /** Begins or ends a video of what is shown. */
  record() {
    if (this.film) {
      this.film.recorder.stop();
      this.film = null;
    } else {
      const canvas = element("canvas", { width: this.canvas.width & ~1, height: this.canvas.height & ~1 });
      const context = canvas.getContext("2d");
      const recorder = new MediaRecorder(canvas.captureStream(30), { mimeType: "video/webm", videoBitsPerSecond: 12e6 });
      const parts = [];
      const film = { recorder, bytes: 0 };
      recorder.ondataavailable = ({ data }) => { parts.push(data); film.bytes += data.size; };
      recorder.onstop = () => this.save(new Blob(parts, { type: "video/webm" }), "webm");
      // in pieces, so that a slow machine has not encoded all of it at the end
      recorder.start(250);
      this.film = Object.assign(film, { add: (...layers) => layers.forEach((layer) => context.drawImage(layer, 0, 0)) });
      this.changed();
    }
    byId("record").setAttribute("aria-pressed", String(!!this.film));
  }

  copyCamera() {
    const { canvas, look } = this;
    const text = this.camera.key(look.boxBounds, [canvas.clientWidth, canvas.clientHeight], this.free());
    const said = text + besides(look, this.setting.bodies, this.placeOf(look.cutting), this.scene.solid);
    const copied = navigator.clipboard?.writeText(text) ?? Promise.reject();
    copied.then(() => this.state(`copied: ${said}`), () => this.state(said));
  }

  home() {
    this.camera.home();
    this.changed();
  }

  showPanel(on) {
    byId("panel").hidden = !on;
    if (on && isNarrow()) this.showPlots(false);
    byId("show-panel").setAttribute("aria-expanded", String(on));
    this.changed();
  }

  tellPlots(plots) {
    this.plots.set(plots);
    byId("show-plots").hidden = plots.length === 0;
  }

  showPlots(on) {
    byId("plots").hidden = !on;
    if (on && isNarrow()) this.showPanel(false);
    byId("show-plots").setAttribute("aria-expanded", String(on));
    this.changed();
  }

  // ---- controls

  listen() {
    const { canvas, camera, look, timeline } = this;
    listenToPointers(canvas, camera, {
      changed: () => this.changed(),
      begun: () => (this.dragging = true),
      ended: () => { this.dragging = false; this.changed(); },
      turns: () => look.turns,
    });
    let wasNarrow = isNarrow();
    addEventListener("resize", () => {
      if (isNarrow() && !wasNarrow) {
        this.showPanel(false);
        this.showPlots(false);
      }
      wasNarrow = isNarrow();
      if (!byId("panel").hidden) this.showPanel(true);
      this.changed();
    });
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { look.colours = sceneColours(); this.changed(); });
    const clicks = { play: () => this.play(!this.playing), back: () => this.step(-1), forward: () => this.step(1), restart: () => this.restart(),
      home: () => this.home(), screenshot: () => this.screenshot(), record: () => this.record(), "show-help": () => byId("help").showModal(),
      "show-panel": () => this.showPanel(byId("panel").hidden), "show-plots": () => this.showPlots(byId("plots").hidden) };
    for (const [id, act] of Object.entries(clicks)) byId(id).addEventListener("click", act);
    byId("scrub").addEventListener("input", (event) => {
      if (!this.live) this.play(false);
      timeline.place = Number(event.target.value);
      if (this.live || !look.blend) timeline.place = Math.round(timeline.place);
      this.timelineChanged();
      this.changed();
    });
    byId("speed").append(...SPEEDS.map((speed) => element("option", { value: String(speed) }, `${speed}×`)));
    this.showSpeed();
    byId("speed").addEventListener("change", (event) => {
      timeline.speed = Number(event.target.value);
      this.send({ do: "speed", value: timeline.speed });
    });
    this.listenToKeys();
  }

  listenToKeys() {
    const towards = (d) => () => { this.camera.look(d); this.changed(); };
    const keys = [
      [[" "], "space", "play or pause", clicked("play")],
      [["ArrowLeft"], "←", "one frame back", clicked("back")],
      [["ArrowRight"], "→", "one frame on", clicked("forward")],
      [["0"], "0", "back to the start", clicked("restart")],
      [["h"], "h", "the view of the beginning", clicked("home")],
      [["x"], "x", "look along the x axis", towards([1, 0, 0])],
      [["y"], "y", "look along the y axis", towards([0, -1, 0])],
      [["z"], "z", "look along the z axis", towards([0, 0, 1])],
      [["p"], "p", "parallel projection", clicked("parallel")],
      [["o"], "o", "obstacle: opaque, transparent, hidden", () => { nextOf("obstacle"); }],
      [["f"], "f", "surface of the fluid: opaque, transparent, hidden", () => { nextOf("water"); }],
      [["c"], "c", "cut across x, y, z, or not", () => { nextOf("cut-axis"); }],
      [["a"], "a", "arrows of the velocity", clicked("arrows-shown")],
      [["t"], "t", "trails of the particles", clicked("trails-shown")],
      [["s"], "s", "save the picture", clicked("screenshot")],
      [["v"], "v", "begin or end a video", clicked("record")],
      [["m"], "m", "show or hide the controls", clicked("show-panel")],
      [["d"], "d", "show or hide the plots over time", clicked("show-plots")],
      [["?"], "?", "this list", clicked("show-help")],
    ];
    const mouse = [["drag", "turn the view, or the box"], ["right drag, shift", "move the view"], ["wheel, pinch", "nearer or farther"]];
    byId("keys").append(...[...keys.map(([, name, what]) => [name, what]), ...mouse].flatMap(([name, what]) => [element("dt", {}, name), element("dd", {}, what)]));
    addEventListener("keydown", (event) => {
      if (event.ctrlKey || event.metaKey || event.altKey || byId("help").open) return;
      const { tagName, type } = event.target;
      const types = tagName === "SELECT" || (tagName === "INPUT" && type !== "checkbox");
      // a button that has the focus takes the space for itself
      if (types || (event.key === " " && (tagName === "BUTTON" || tagName === "INPUT" || tagName === "SUMMARY"))) return;
      const key = keys.find(([names]) => names.includes(event.key));
      if (!key) return;
      event.preventDefault();
      key[3]();
    });
  }
}

/** Whether the window has room for either the controls or the plots. */
const isNarrow = () => innerWidth <= 720;

const clicked = (id) => () => byId(id)?.click();

/** Goes on to the next of a list of choices. */
function nextOf(id) {
  const list = byId(id);
  if (!list) return;
  list.selectedIndex = (list.selectedIndex + 1) % list.options.length;
  list.dispatchEvent(new Event("change"));
}

try {
  // tests look at it
  window.viewer = new Viewer(JSON.parse(byId("setting").textContent));
  window.viewer.read().catch((error) => window.viewer.notice(`the data of this page cannot be read: ${error.message}`));
} catch (error) {
  byId("notice").hidden = false;
  byId("notice").textContent = error.message;
  throw error;
}
