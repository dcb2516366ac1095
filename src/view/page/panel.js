// The controls at the side. They change what is looked at, and tell whoever listens.

/** An element with properties and children; texts among the children are shown as they are. */
function element(tag, properties = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(properties)) {
    if (name.startsWith("on")) made.addEventListener(name.slice(2), value);
    else if (name in made && name !== "list") made[name] = value;
    else made.setAttribute(name, value);
  }
  made.append(...children.filter((child) => child !== null));
  return made;
}

const row = (name, ...controls) => element("div", { className: "row" }, element("span", {}, name), ...controls);

const choice = (id, names, value, changed) =>
  element("select", { id, ariaLabel: id, onchange: (event) => changed(event.target.value) },
    ...names.map((name) => element("option", { value: name, selected: name === value }, name)));

const check = (id, text, value, changed) =>
  element("label", {}, element("input", { id, type: "checkbox", checked: value, onchange: (event) => changed(event.target.checked) }), text);

const slider = (id, [min, max, value], changed) =>
  element("input", { id, type: "range", min, max, step: "any", value, ariaLabel: id, oninput: (event) => changed(Number(event.target.value)) });

const group = (title, open, ...content) => element("details", { open }, element("summary", {}, title), ...content);

/** Builds the controls of a scene. `viewer` has what they change. */
function buildPanel(place, viewer) {
  const { look, camera, setting } = viewer;
  const again = () => viewer.changed();
  const groups = [];
  if (setting.params?.length) groups.push(paramsGroup(viewer));
  if (setting.live && (setting.arrays.length || setting.moves)) groups.push(boxGroup(viewer));
  if (setting.arrays.length) groups.push(colourGroup(viewer));
  const others = setting.solids.length > 1 ? choice("solid", [...setting.solids].sort(), setting.solids[0], (name) => viewer.send({ do: "solid", name })) : null;
  groups.push(group(setting.arrays.length ? "Obstacle" : "Solid", true, others ? row("which", others) : "", choice("obstacle", ["opaque", "transparent", "hidden"], look.obstacle, (value) => { look.obstacle = value; again(); }),
    bodiesGroup(viewer),
    ...(setting.live ? [row("surface", choice("surface", ["automatic", "exact", "mesh"], look.surface, (value) => { look.surface = value; again(); })), element("p", { className: "note", id: "surface-said" })] : [])));
  if (setting.has_surface)
    groups.push(group("Surface of the fluid", true, choice("water", ["opaque", "transparent", "hidden"], look.water, (value) => { look.water = value; again(); })));
  groups.push(cutGroup(viewer));
  if (setting.live) groups.push(sliceGroup(viewer));
  if (setting.arrays.length) groups.push(motionGroup(viewer));
  const direction = (name, d) => element("button", { title: `look along ${name[1]}`, onclick: () => { camera.look(d); again(); } }, name);
  groups.push(group("View", true,
    element("div", { className: "buttons" },
      direction("+x", [1, 0, 0]), direction("−x", [-1, 0, 0]), direction("+y", [0, 1, 0]), direction("−y", [0, -1, 0]), direction("+z", [0, 0, 1]), direction("−z", [0, 0, -1])),
    row("", check("parallel", "parallel projection", camera.parallel, (value) => { camera.parallel = value; again(); })),
    row("", check("box-shown", "box and lengths", look.box, (value) => { look.box = value; again(); })),
    element("div", { className: "buttons" }, element("button", { id: "copy-camera", title: "copy the camera as a key of the scene", onclick: () => viewer.copyCamera() }, "Copy as scene key"))));
  if (setting.arrays.length)
    groups.push(group("Particles", setting.has_surface,
      row("", check("particles-shown", "shown", look.particles, (value) => { look.particles = value; again(); })),
      row("size", slider("size", [0.2, 2, look.radius / setting.radius], (value) => { look.radius = value * setting.radius; again(); })),
      setting.live ? null : row("", check("blend", "blended between frames", look.blend, (value) => { look.blend = value; again(); }))));
  const open = new Map([...place.querySelectorAll("details")].map((old) => [old.firstChild.textContent, old.open]));
  for (const made of groups) made.open = open.get(made.firstChild.textContent) ?? made.open;
  place.replaceChildren(...groups);
}

/** ω in a plane; on request the scene is cut open there. */
function sliceGroup(viewer) {
  const { look } = viewer;
  const { slicing, cutting } = look;
  const opens = check("slice-cuts", "cut open there", true, () => changed());
  const changed = () => {
    place.disabled = slicing.axis === "none";
    const axis = byId("cut-axis");
    if (opens.firstChild.checked && axis) {
      // the side towards the eye is taken away
      if (axis.value !== slicing.axis) {
        axis.value = slicing.axis;
        axis.dispatchEvent(new Event("change"));
      }
      cutting.part = slicing.part;
      byId("cut-at").value = slicing.part;
    }
    viewer.askSlice();
  };
  const place = slider("slice-at", [0, 1, slicing.part], (part) => { slicing.part = part; changed(); });
  place.disabled = slicing.axis === "none";
  const axis = choice("slice-axis", ["none", "x", "y", "z"], slicing.axis, (value) => { slicing.axis = value; changed(); });
  return group("Slice of ω", slicing.axis !== "none", row("across", axis), row("at", place, element("output", { id: "slice-value" })), row("", opens));
}

/** Arrows and trails. */
function motionGroup(viewer) {
  const { look, setting } = viewer;
  const again = () => viewer.changed();
  const has = setting.arrays.some((array) => array.name === "velocity x");
  return group("Motion", false,
    has ? row("", check("arrows-shown", "arrows of velocity", look.arrows, (value) => { look.arrows = value; again(); })) : null,
    has ? row("length", slider("arrow-length", [-2, 2, Math.log2(look.arrowLength)], (value) => { look.arrowLength = 2 ** value; again(); }), element("output", { id: "arrow-value" })) : null,
    row("", check("trails-shown", "trails", look.trails, (value) => { look.trails = value; again(); })),
    row("of", slider("trail-frames", [1, 60, look.trailFrames], (value) => { look.trailFrames = Math.round(value); again(); }), element("output", { id: "trail-value" })));
}

function colourGroup(viewer) {
  const { look, setting } = viewer;
  const limit = (id, title) => element("input", { id, type: "number", step: "any", title, ariaLabel: title, onchange: (event) => {
    if (event.target.value === "" || !Number.isFinite(Number(event.target.value))) return viewer.showRange();
    look.fixed = { ...look.range, [id === "low" ? "low" : "high"]: Number(event.target.value) };
    viewer.changed();
  } });
  return group("Colour", true,
    row("by", choice("array", setting.arrays.map((array) => array.name), setting.arrays[look.array].name, (name) => {
      look.array = setting.arrays.findIndex((array) => array.name === name);
      look.fixed = null;
      viewer.changed();
    })),
    row("map", choice("map", Object.keys(MAPS), look.map, (name) => { look.map = name; viewer.scene.setMap(name); viewer.changed(); })),
    row("range", limit("low", "least value of the colours"), limit("high", "greatest value of the colours")),
    row("", element("button", { id: "auto", title: "the range of the frames", onclick: () => { look.fixed = null; viewer.changed(); } }, "automatic range")));
}

function cutGroup(viewer) {
  const { look, camera } = viewer;
  const cut = look.cutting;
  const place = slider("cut-at", [0, 1, cut.part], (part) => { cut.part = part; viewer.changed(); });
  place.disabled = cut.axis === "none";
  const axis = choice("cut-axis", ["none", "x", "y", "z"], cut.axis, (value) => {
    cut.axis = value;
    place.disabled = value === "none";
    // the side towards the eye is taken away
    const towards = turned(back(camera.turn), camera.axes().towards);
    if (value !== "none") cut.flipped = towards["xyz".indexOf(value)] < 0;
    viewer.changed();
  });
  return group("Cut", true,
    row("across", axis, element("button", { id: "cut-side", title: "take away the other side", onclick: () => { cut.flipped = !cut.flipped; viewer.changed(); } }, "⇄")),
    row("at", place, element("output", { id: "cut-value" })),
    row("", check("cut-solid", viewer.setting.arrays.length ? "obstacle" : "solid", cut.solid, (value) => { cut.solid = value; viewer.changed(); }),
      viewer.setting.arrays.length ? check("cut-fluid", "fluid", cut.fluid, (value) => { cut.fluid = value; viewer.changed(); }) : null));
}

/** How the slider of a param goes: its ends, and by powers where the range has several of ten. */
function scaleOf(param) {
  const [low, high] = param.range ?? (param.value > 0 ? [param.value / 4, param.value * 4] : param.value < 0 ? [param.value * 4, param.value / 4] : [-1, 1]);
  const powers = low > 0 && high / low >= 500;
  return { low, high, powers, to: powers ? Math.log : (x) => x, from: powers ? Math.exp : (x) => x };
}

const inUnit = (param, value) => Number((value / param.factor).toPrecision(6));

/** Shows the values of params in the controls that there are, but not in a field in which somebody writes. */
function showParams(params) {
  for (const param of params) {
    const { low, high, to } = scaleOf(param);
    const [number, track] = [byId(`value-${param.name}`), byId(`param-${param.name}`)];
    if (number !== document.activeElement || !number.isWritten) number.value = inUnit(param, param.value);
    track.value = to(clamp(param.value, low, high));
  }
}

/** The looks of single obstacles: of several, but not of so many that nobody would look for one, unless one has a look already. */
function bodiesGroup(viewer) {
  const { look, setting: { bodies } } = viewer;
  const isShort = bodies.length > 1 && bodies.length <= 40;
  if (!isShort && Object.keys(look.bodies).length === 0) return null;
  const one = (name, k) =>
    row(name, choice(`body-${k}`, ["as all", "opaque", "transparent", "hidden"], look.bodies[name] ?? "as all", (value) => {
      if (value === "as all") delete look.bodies[name];
      else look.bodies[name] = value;
      viewer.changed();
    }));
  return group("One by one", Object.keys(look.bodies).length > 0, ...bodies.map(one));
}

/** The params of the file. A drag moves the obstacle at once; the run starts again when the slider is let go. */
function paramsGroup(viewer) {
  const rows = viewer.setting.params.map((param) => {
    const { low, high, powers, to, from } = scaleOf(param);
    const tell = (what, value) => {
      number.value = inUnit(param, value);
      track.value = to(clamp(value, low, high));
      if (what === "try") viewer.tryParam(param.name, value);
      else viewer.send({ do: what, name: param.name, value });
    };
    const rounded = (value) => {
      // three digits of the range are as fine as a slider is
      const step = 10 ** (Math.floor(Math.log10(powers ? value : high - low)) - 2);
      return clamp(Math.round(value / step) * step, low, high);
    };
    const number = element("input", { type: "number", step: "any", value: inUnit(param, param.value), ariaLabel: param.name, id: `value-${param.name}`,
      oninput: () => (number.isWritten = true),
      // what the file refuses gives way to the last good value, and nothing to that of the file
      onchange: () => {
        number.isWritten = false;
        if (number.value === "") viewer.send({ do: "unset", name: param.name });
        else tell("set", Number(number.value) * param.factor);
      } });
    const track = element("input", { type: "range", min: to(low), max: to(high), step: "any", value: to(clamp(param.value, low, high)), ariaLabel: `${param.name}, slider`, id: `param-${param.name}`,
      oninput: (event) => tell("try", rounded(from(Number(event.target.value)))),
      onchange: (event) => tell("set", rounded(from(Number(event.target.value)))) });
    return element("div", { className: "param" },
      element("div", { className: "name" }, element("b", {}, param.name), element("span", {}, number, param.unit ? " " + param.unit : "")),
      track, param.doc ? element("small", {}, param.doc) : null);
  });
  const reset = element("button", { id: "params-reset", title: "the values of the file", onclick: () => viewer.send({ do: "reset" }) }, "Values of the file");
  return group("Params", true, ...rows, element("div", { className: "buttons" }, reset), element("p", { className: "note", id: "latency" }));
}

function boxGroup(viewer) {
  const { look, camera } = viewer;
  return group("Box", true,
    row("drag", choice("drag", ["turns the view", "turns the box"], look.turns ? "turns the box" : "turns the view", (value) => { look.turns = value === "turns the box"; })),
    row("gravity", choice("gravity", ["with the room", "with the box"], look.gravityInRoom ? "with the room" : "with the box", (value) => {
      look.gravityInRoom = value === "with the room";
      viewer.changed();
    })),
    element("div", { className: "buttons" }, element("button", { id: "upright", onclick: () => { camera.turn = NO_TURN; viewer.changed(); } }, "Upright")));
}
