"use strict";
const byId = name => document.getElementById(name);
function add(parent, tag, attributes = {}, text = "") {
  const node = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) node.setAttribute(name, value);
  node.textContent = text;
  parent.append(node);
  return node;
}
function numbers(text, kind) {
  const bytes = Uint8Array.from(atob(text), c => c.charCodeAt(0));
  return new kind(bytes.buffer);
}
const swatch = k => data.palette[k % data.palette.length];
const colour = k => new THREE.Color(k < 0 ? "#999999" : swatch(k));
const vector = values => new THREE.Vector3(...values);
const AXIS = "#e0304a", ERROR_STOPS = ["#2b7bba", "#e8c33b", "#d02a2a"];  // told apart on light and on dark

document.title = data.title;
document.querySelector("h1").textContent = data.title;
for (const note of data.notes) add(byId("notes"), "p", {}, note);
for (const note of data.warnings) add(byId("notes"), "p", {class: "warning"}, "Warning: " + note);

// The scene ------------------------------------------------------------------------------------------------------
// Every thing in it has a layer, a part and, where estimate and truth differ, a side.
const scene = new THREE.Scene(), root = new THREE.Group(), moving = new THREE.Group();
scene.add(root);
root.add(moving);
let things = [], frame = null;
const layersShown = {}, hiddenParts = new Set();
let colouring = "part", truthAt = "beside";
function put(parent, object, layer, part, side = null) {
  parent.add(object);
  things.push({object, layer, part, side});
}
function isShown(thing, side) {
  const sideShown = side === "both" || !thing.side || thing.side === side;
  const name = thing.part < 0 ? null : (frame.parts[thing.part] || {}).name;
  return sideShown && layersShown[thing.layer] && !hiddenParts.has(name);
}
function boxLines(k, center, size, dashed = false) {
  const corner = i => [0, 1, 2].map(d => center[d] + ((i >> d & 1) - 0.5) * size[d]), pairs = [];
  for (let i = 0; i < 8; i++) for (const bit of [1, 2, 4]) if (!(i & bit)) pairs.push(corner(i), corner(i | bit));
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(pairs.flat()), 3));
  const dash = 0.03 * Math.hypot(...size), look = {color: colour(k), dashSize: dash, gapSize: dash};
  const material = dashed ? new THREE.LineDashedMaterial(look) : new THREE.LineBasicMaterial({color: colour(k)});
  const lines = new THREE.LineSegments(geometry, material);
  return dashed ? lines.computeLineDistances() : lines;
}
function arrow(start, end) {
  const a = vector(start), way = vector(end).sub(a), length = way.length();
  return new THREE.ArrowHelper(way.normalize(), a, length, AXIS, 0.16 * length, 0.06 * length);
}

// An object: surfaces that its joints move -------------------------------------------------------------------------
const parts = data.joints.map(() => ({group: new THREE.Group()}));
for (const part of parts) { part.group.matrixAutoUpdate = false; root.add(part.group); }
data.bodies.forEach((body, k) => {
  if (!body) return;
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.BufferAttribute(numbers(body.vertices, Float32Array), 3));
  geometry.setIndex(new THREE.BufferAttribute(numbers(body.faces, Uint32Array), 1));
  const material = new THREE.MeshPhongMaterial({
    color: colour(k), flatShading: true, side: THREE.DoubleSide, shininess: 8, polygonOffset: true,
    polygonOffsetFactor: 1, polygonOffsetUnits: 1,
  });
  put(parts[k].group, new THREE.Mesh(geometry, material), "surfaces", k);
});
// Joints of an object are drawn with the part that carries them, boxes with their own.
data.joints.forEach((joint, k) => {
  const box = data.boxes[k];
  if (box) put(parts[k].group, boxLines(k, box.center, box.size), "boxes", k);
  if (joint.arrow) put(parts[joint.parent].group, arrow(...joint.arrow), "axes", k);
});

// Kinematics: the same formulas as artsim.model.kinematics
const state = data.joints.map(joint => joint.rest);
function pose() {
  for (const k of data.order) {
    const follows = data.joints[k].mimic;
    state[k] = follows[1] * state[follows[0]] + follows[2];
  }
  data.joints.forEach((joint, k) => {
    const T = new THREE.Matrix4();
    if (joint.parent >= 0) {
      const step = state[k] - joint.rest, o = joint.origin;
      const turn = ["revolute", "continuous", "screw"].includes(joint.type) ? step : 0;
      const slide = joint.type === "prismatic" ? step : joint.type === "screw" ? joint.pitch * step : 0;
      T.makeTranslation(...o.map((v, d) => v + slide * joint.axis[d]))
       .multiply(new THREE.Matrix4().makeRotationAxis(vector(joint.axis), turn))
       .multiply(new THREE.Matrix4().makeTranslation(-o[0], -o[1], -o[2]))
       .premultiply(parts[joint.parent].group.matrix);
    }
    parts[k].group.matrix.copy(T);
    parts[k].group.matrixWorldNeedsUpdate = true;
  });
}

// A frame: what was seen, estimated and true ---------------------------------------------------------------------
function drawFrame() {
  things = things.filter(thing => thing.object.parent !== moving);
  for (const object of moving.children) { object.geometry && object.geometry.dispose(); }
  moving.clear();
  byId("colours").hidden = !frame.error;
  if (frame.points) {
    const points = numbers(frame.points, Float32Array), of = numbers(frame.part, Int16Array);
    const error = colouring === "error" && frame.error ? numbers(frame.error, Float32Array) : null;
    const top = error ? scaleTop(error) : 1, positions = new Map(), colours = new Map();
    of.forEach((k, i) => {
      if (!positions.has(k)) { positions.set(k, []); colours.set(k, []); }
      positions.get(k).push(...points.slice(3 * i, 3 * i + 3));
      const c = !error ? colour(k) : Number.isNaN(error[i]) ? colour(-1) : errorColour(error[i] / top);
      colours.get(k).push(c.r, c.g, c.b);
    });
    for (const [k, values] of positions) {
      const geometry = new THREE.BufferGeometry();
      geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(values), 3));
      geometry.setAttribute("color", new THREE.BufferAttribute(new Float32Array(colours.get(k)), 3));
      const material = new THREE.PointsMaterial({vertexColors: true, size: 2.5, sizeAttenuation: false});
      put(moving, new THREE.Points(geometry, material), "cloud", k);
    }
  }
  for (const side of ["shown", "truth"]) {
    if (!frame[side]) continue;
    frame[side].boxes.forEach((box, k) => {
      const lines = boxLines(k, box.center, box.size, side === "truth");
      lines.matrixAutoUpdate = false;
      lines.matrix.set(...box.T.flat());
      put(moving, lines, "boxes", k, side);
    });
    for (const [k, ends] of frame[side].arrows) put(moving, arrow(...ends), "axes", k, side);
  }
  render();
}
// The largest errors are few: they must not turn all others blue.
function scaleTop(error) {
  const known = error.filter(value => !Number.isNaN(value)).sort(), top = known[Math.floor(0.95 * (known.length - 1))] || 0;
  byId("scale-top").textContent = (1000 * top).toPrecision(2) + " mm";
  return Math.max(top, 1e-9);
}
function errorColour(share) {
  const at = Math.min(Math.max(share, 0), 1) * (ERROR_STOPS.length - 1), i = Math.min(Math.floor(at), ERROR_STOPS.length - 2);
  return new THREE.Color(ERROR_STOPS[i]).lerp(new THREE.Color(ERROR_STOPS[i + 1]), at - i);
}

let asked = 0;
async function showFrame(number) {
  const mine = ++asked;
  let next = data.frames[number];
  if (!next) {
    try {
      const answer = await fetch(`sample/${number}`);
      if (!answer.ok) throw new Error(await answer.text());
      next = await answer.json();
    } catch (error) {
      if (mine === asked) byId("problem").textContent = `Sample ${number} did not come. ${error.message}`;
      return;
    }
    if (mine !== asked) return;  // another one was chosen meanwhile
  }
  byId("problem").textContent = "";
  const fits = frame && JSON.stringify(frame.view) === JSON.stringify(next.view);
  frame = next;
  if (!fits) fitView();
  if (byId("frame-name")) byId("frame-name").textContent = frame.name;
  listParts();
  listTables();
  drawFrame();
}
function listParts() {
  byId("parts").replaceChildren();
  frame.parts.forEach((part, k) => {
    const label = add(byId("parts"), "label", {class: "part"});
    const box = add(label, "input", {type: "checkbox", "data-part": k});
    box.checked = !hiddenParts.has(part.name);
    add(label, "span", {class: "swatch", style: `background: ${swatch(k)}`});
    label.append(part.name + (["free", "fixed"].includes(part.type) ? "" : ` (${part.type})`));
    box.onchange = () => { hiddenParts[box.checked ? "delete" : "add"](part.name); render(); };
  });
  byId("truths").hidden = !frame.truth;
}
function listTables() {
  byId("table").replaceChildren();
  if (!frame.table.rows.length) return;
  add(byId("table"), "h2", {}, "In numbers");
  frame.table.rows.forEach((rows, k) => {
    const table = add(byId("table"), "table");
    add(table, "caption", {}, frame.parts[k].name);
    if (frame.table.head.some(Boolean)) {
      const line = add(add(table, "thead"), "tr");
      for (const word of frame.table.head) add(line, "th", {scope: "col"}, word);
    }
    const body = add(table, "tbody");
    for (const [what, ...values] of rows) {
      const line = add(body, "tr");
      add(line, "th", {scope: "row"}, what);
      for (const value of values) add(line, "td", {}, value);
    }
  });
}

// Controls -------------------------------------------------------------------------------------------------------
// Frames that fit the filters, and which of them is shown.
let chosen = [...(data.index ? data.index.category : data.frames).keys()], place = data.first_frame, step = () => {};
if (chosen.length > 1) {
  add(byId("frames"), "h2", {}, data.frame_word);
  const row = add(byId("frames"), "div", {class: "steps"});
  const before = add(row, "button", {"aria-label": "previous"}, "‹");
  const slider = add(row, "input", {type: "range", id: "frame", min: 0, step: 1, "aria-label": data.frame_word});
  const after = add(row, "button", {"aria-label": "next"}, "›");
  const line = add(byId("frames"), "p", {"aria-live": "polite"});
  add(line, "output", {id: "frame-name"});
  const count = add(line, "span", {class: "soft", id: "frame-count"});
  step = async to => {
    place = Math.min(Math.max(to, 0), chosen.length - 1);
    slider.max = Math.max(0, chosen.length - 1);
    slider.value = place;
    before.disabled = place <= 0;
    after.disabled = place >= chosen.length - 1;
    slider.disabled = !chosen.length;
    count.textContent = chosen.length ? `  (${place + 1} of ${chosen.length})` : "";
    if (chosen.length) await showFrame(chosen[place]);
  };
  slider.oninput = () => step(+slider.value);
  before.onclick = () => step(place - 1);
  after.onclick = () => step(place + 1);
}
if (data.index) {
  add(byId("filters"), "h2", {}, "Find");
  const category = add(add(byId("filters"), "p"), "select", {id: "category", "aria-label": "category"});
  for (const name of ["all categories", ...data.index.categories]) add(category, "option", {}, name);
  const ranges = [["visible", "least visible part"], ["open", "most open joint"]].map(([key, words]) => {
    const row = add(byId("filters"), "p", {}, `${words}: `);
    const ends = [[0, "from"], [100, "to"]].map(([value, end]) => {
      const box = add(row, "input", {type: "number", min: 0, max: 100, value, id: `${key}-${end}`, "aria-label": `${words}, ${end}`});
      row.append(end === "from" ? " to " : " %");
      return box;
    });
    return [data.index[key], ...ends];
  });
  const found = add(byId("filters"), "p", {class: "soft", id: "found", "aria-live": "polite"});
  const filter = () => {
    const now = chosen[place], wanted = category.selectedIndex - 1;
    chosen = [...data.index.category.keys()].filter(i =>
      (wanted < 0 || data.index.category[i] === wanted)
      && ranges.every(([values, low, high]) => values[i] >= +low.value && values[i] <= +(high.value || 100)));
    const total = data.index.category.length.toLocaleString("en");
    found.textContent = chosen.length ? `${chosen.length.toLocaleString("en")} of ${total} samples` : "No sample is like that: widen the ranges.";
    return step(Math.max(0, chosen.indexOf(now)));
  };
  for (const box of [category, ...ranges.flatMap(([, ...ends]) => ends)]) box.onchange = filter;
  found.textContent = `${chosen.length.toLocaleString("en")} samples`;
}
const sliders = [];
function moveJoints() {
  pose();
  for (const [k, slider, value] of sliders) {
    slider.value = state[k];
    const turns = data.joints[k].type !== "prismatic";
    value.textContent = turns ? (state[k] * 180 / Math.PI).toFixed(1) + "°" : (100 * state[k]).toFixed(1) + " cm";
  }
  render();
}
if (data.joints.some(joint => joint.slider)) {
  add(byId("joints"), "h2", {}, "Joints");
  data.joints.forEach((joint, k) => {
    if (!joint.slider) return;
    const row = add(byId("joints"), "div", {class: "row"}), name = data.frames[0].parts[k].name;
    add(row, "span", {}, name);
    const [min, max] = joint.slider;
    const slider = add(row, "input", {type: "range", min, max, step: "any", "data-joint": k, "aria-label": name});
    const value = add(row, "output");
    if (joint.mimic) slider.disabled = true;
    slider.oninput = () => { state[k] = +slider.value; moveJoints(); };
    sliders.push([k, slider, value]);
  });
  const row = add(byId("joints"), "p");
  const toShare = share => () => {
    for (const [k] of sliders) { const [low, high] = data.joints[k].slider; state[k] = low + share * (high - low); }
    moveJoints();
  };
  const toRest = () => { data.joints.forEach((joint, k) => state[k] = joint.rest); moveJoints(); };
  for (const [name, run] of [["at rest", toRest], ["lower ends", toShare(0)], ["upper ends", toShare(1)]]) {
    add(row, "button", {}, name).onclick = run;
  }
}
for (const name of data.layers) {
  const label = add(byId("layers"), "label");
  const box = add(label, "input", {type: "checkbox", id: "layer-" + name});
  box.checked = layersShown[name] = !data.hidden.includes(name);
  label.append(" " + name);
  box.onchange = () => { layersShown[name] = box.checked; render(); };
}
function choice(parent, name, title, options, first, run) {
  const row = add(parent, "p", {role: "radiogroup", "aria-label": title}, `${title}: `);
  const boxes = options.map(([value, text]) => {
    const label = add(row, "label");
    const box = add(label, "input", {type: "radio", name, value});
    box.checked = value === first;
    box.onchange = () => run(value);
    label.append(" " + text);
    return box;
  });
  return () => boxes[(boxes.findIndex(box => box.checked) + 1) % boxes.length].click();
}
const nextTruth = choice(byId("truths"), "truth", "Ground truth",
  [["beside", "beside"], ["over", "over it, dashed"], ["hidden", "hidden"]], truthAt,
  value => { truthAt = value; render(); });
const nextColour = choice(byId("colours"), "colour", "Colour points", [["part", "by part"], ["error", `by ${data.error_word}`]],
  colouring, value => { colouring = value; scale.hidden = value === "part"; drawFrame(); });
const scale = add(byId("colours"), "div", {class: "scale"});
add(scale, "span", {}, "0");
add(scale, "i", {style: `background: linear-gradient(to right, ${ERROR_STOPS})`});
add(scale, "span", {id: "scale-top"});
scale.hidden = true;

const light = matchMedia("(prefers-color-scheme: dark)");
function setTheme(dark) {
  document.documentElement.dataset.theme = dark ? "dark" : "light";
  scene.background = new THREE.Color(getComputedStyle(document.documentElement).getPropertyValue("--stage").trim());
  render();
}
const otherTheme = () => setTheme(document.documentElement.dataset.theme === "light");
light.onchange = () => setTheme(light.matches);
function savePicture() {
  render();
  renderer.domElement.toBlob(blob => {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(blob);
    link.download = `${data.title} ${frame.name}`.replace(/[^\w.-]+/g, "_").replace(/^[._]+|[._]+$/g, "").slice(0, 80) + ".png";
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10000);
  });
}
const reset = () => { fitView(true); render(); };
for (const [id, name, run] of [["home", "Fit into view", reset], ["picture", "Save a picture", savePicture], ["theme", "Dark or light", otherTheme]]) {
  add(byId("actions"), "button", {id}, name).onclick = run;
}

// Turntable ------------------------------------------------------------------------------------------------------
// The camera goes about the centre of the frame's view at an azimuth and an elevation over the plane across "up".
// A zoom of 1 fits the ball of the view into the picture; a shift, in radii, moves the picture, not the centre.
const FIELD = 40 * Math.PI / 180, STEEPEST = 89 * Math.PI / 180;
const eye = {azimuth: 0, elevation: 0, zoom: 1, shift: [0, 0]};
const camera = new THREE.PerspectiveCamera(FIELD * 180 / Math.PI, 1, 0.01, 100);
let renderer = null, lamp, turned = false;
function basis() {
  const up = vector(frame.view.up).normalize(), from = vector(frame.view.seen_from).normalize();
  const high = from.dot(up), ahead = from.clone().addScaledVector(up, -high);
  if (ahead.length() < 1e-3) ahead.set(...(Math.abs(up.x) < 0.9 ? [1, 0, 0] : [0, 1, 0])).addScaledVector(up, -ahead.dot(up));
  return {up, ahead: ahead.normalize(), aside: up.clone().cross(ahead), high};
}
// Who has turned the object keeps the turn from one sample to the next.
function fitView(anew = false) {
  if (anew || !turned) { eye.azimuth = 0; eye.elevation = clampSteep(Math.asin(Math.min(Math.max(basis().high, -1), 1))); turned = false; }
  eye.zoom = 1;
  eye.shift = [0, 0];
}
const clampSteep = angle => Math.min(Math.max(angle, -STEEPEST), STEEPEST);
function turnBy(azimuth, elevation) {
  eye.azimuth -= azimuth;
  eye.elevation = clampSteep(eye.elevation + elevation);
  turned = true;
  render();
}
function zoomBy(factor) { eye.zoom = Math.min(Math.max(eye.zoom * factor, 0.02), 20); render(); }
function shiftBy(across, down) { eye.shift = [eye.shift[0] + across * eye.zoom, eye.shift[1] - down * eye.zoom]; render(); }
const narrowest = aspect => Math.atan(Math.tan(FIELD / 2) * Math.min(1, aspect));  // half of the angle that is seen
function placeCamera(aspect) {
  const {up, ahead, aside} = basis(), {center, radius} = frame.view, size = Math.max(radius, 1e-6);
  const distance = eye.zoom * size / Math.sin(narrowest(aspect));
  const flat = Math.cos(eye.elevation);
  camera.position.copy(vector(center))
    .addScaledVector(ahead, distance * flat * Math.cos(eye.azimuth))
    .addScaledVector(aside, distance * flat * Math.sin(eye.azimuth))
    .addScaledVector(up, distance * Math.sin(eye.elevation));
  camera.up.copy(up);
  camera.lookAt(vector(center));
  camera.translateX(-eye.shift[0] * size);
  camera.translateY(-eye.shift[1] * size);
  Object.assign(camera, {aspect, near: 0.05 * Math.min(distance, size), far: distance + 200 * size});
  camera.updateProjectionMatrix();
}

// Estimate and truth stand side by side, or one above the other in a high window.
const views = () => frame.truth && truthAt === "beside" ? ["shown", "truth"] : [truthAt === "over" ? "both" : "shown"];
function panes() {
  const {clientWidth: width, clientHeight: height} = byId("view"), sides = views(), wide = width >= height;
  const w = wide ? width / sides.length : width, h = wide ? height : height / sides.length;
  return sides.map((side, i) => ({side, x: wide ? i * w : 0, y: wide ? 0 : i * h, w, h}));
}
let painted = false;
function render() {
  if (!renderer || !frame || painted) return;
  painted = true;
  requestAnimationFrame(paint);
}
function paint() {
  painted = false;
  const all = panes(), {clientHeight: height} = byId("view");
  for (const label of document.querySelectorAll(".pane")) label.remove();
  renderer.setScissorTest(true);
  for (const {side, x, y, w, h} of all) {
    for (const thing of things) thing.object.visible = isShown(thing, side);
    for (const what of ["setViewport", "setScissor"]) renderer[what](x, height - y - h, w, h);  // from the bottom
    placeCamera(w / Math.max(h, 1));
    lamp.position.copy(camera.position);
    renderer.render(scene, camera);
    if (all.length > 1) {
      add(byId("view"), "span", {class: "pane", style: `left: ${x}px; top: ${y}px`}, side === "shown" ? data.shown_word : "ground truth");
    }
  }
}
function resize() {
  const {clientWidth: width, clientHeight: height} = byId("view");
  renderer.setPixelRatio(devicePixelRatio);
  renderer.setSize(width, height);
  render();
}
function listen(canvas) {
  const pointers = new Map(), middle = () => {
    const [a, b] = [...pointers.values()];
    return {x: (a.x + b.x) / 2, y: (a.y + b.y) / 2, apart: Math.hypot(a.x - b.x, a.y - b.y)};
  };
  const pixels = () => panes()[0].h;
  const radii = () => {  // that a pixel is wide at zoom 1
    const {w, h} = panes()[0];
    return 2 * Math.tan(FIELD / 2) / Math.sin(narrowest(w / h)) / h;
  };
  canvas.addEventListener("pointerdown", event => {
    canvas.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, {x: event.clientX, y: event.clientY, turns: event.button === 0 && !event.shiftKey});
  });
  canvas.addEventListener("pointermove", event => {
    const last = pointers.get(event.pointerId);
    if (!last) return;
    const before = pointers.size === 2 ? middle() : last;
    const across = event.clientX - last.x, down = event.clientY - last.y;
    Object.assign(last, {x: event.clientX, y: event.clientY});
    if (pointers.size === 2) {
      const after = middle();
      zoomBy(before.apart / Math.max(after.apart, 1));
      shiftBy((after.x - before.x) * radii(), (after.y - before.y) * radii());
    } else if (last.turns) turnBy(across * Math.PI / pixels(), down * Math.PI / pixels());
    else shiftBy(across * radii(), down * radii());
  });
  for (const name of ["pointerup", "pointercancel"]) canvas.addEventListener(name, event => pointers.delete(event.pointerId));
  canvas.addEventListener("wheel", event => {
    event.preventDefault();
    zoomBy(Math.exp(event.deltaY * (event.deltaMode ? 0.04 : 0.0015)));  // lines, or pixels
  }, {passive: false});
  canvas.addEventListener("dblclick", reset);
  canvas.addEventListener("contextmenu", event => event.preventDefault());
  const turn = Math.PI / 24, keys = {
    ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1],
    "+": () => zoomBy(0.85), "=": () => zoomBy(0.85), "-": () => zoomBy(1 / 0.85), Home: reset,
    ",": () => step(place - 1), ".": () => step(place + 1), c: () => byId("colours").hidden || nextColour(),
    t: () => byId("truths").hidden || nextTruth(), d: otherTheme, p: savePicture,
  };
  addEventListener("keydown", event => {
    const run = keys[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    const typed = event.target.closest("select, input[type=number]");
    const slides = event.key.length > 1 && event.target.closest("input[type=range], input[type=radio]");
    if (!run || typed || slides || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    if (!Array.isArray(run)) run();
    else if (event.shiftKey) shiftBy(0.15 * run[0], 0.15 * run[1]);
    else turnBy(turn * run[0], turn * run[1]);
  });
}
async function start() {
  try {
    renderer = new THREE.WebGLRenderer({antialias: true, preserveDrawingBuffer: true});
    const canvas = renderer.domElement;
    canvas.tabIndex = 0;
    canvas.setAttribute("aria-label", "3D view; arrow keys turn it");
    byId("view").append(canvas);
    lamp = new THREE.DirectionalLight(0xffffff, 0.75);
    scene.add(lamp, new THREE.AmbientLight(0xffffff, 0.55));
    listen(canvas);
    new ResizeObserver(resize).observe(byId("view"));
  } catch (error) {
    renderer = null;
    add(byId("view"), "p", {id: "failure"}, "This browser draws no 3D (WebGL is off): " + error.message);
  }
  setTheme(light.matches);
  await (chosen.length > 1 ? step(data.first_frame) : showFrame(0));
  moveJoints();
  document.body.dataset.ready = renderer ? "yes" : "no";
}
start();
