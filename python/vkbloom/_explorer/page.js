// The explorer's page: a picture, and the controls that change it. `mount` puts it into an element.
// It is used by a notebook's widget (the default export), by the stand-alone page (start.js) and by a
// page of stored pictures (stored.js). They differ in how messages are sent, and pages store their
// state in their address. vkbloom/_explorer/viewer.py documents the messages.

const TURNS_PER_SECOND = 0.25; // of the forward system's animation
const MAX_HEIGHT = 0.72; // the largest part of the window's height for the picture
const MAX_HEIGHT_NARROW = 0.45; // the same if the controls are below the picture
const NARROW = 720; // CSS pixels, as in page.css
const WATCH = 200; // milliseconds between two looks at the files of custom methods
const MAX_ZOOM = 64; // device pixels of a framebuffer's pixel
const SIDES = ["a", "b"];
const KEYS = "picture: plus and minus zoom, arrows move, 0 fits";
const KEYS_OF_CLIP = `${KEYS}, space plays, comma and full stop step`;
const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4];
const CURVE_HEIGHT = 92; // of the exposure of a clip, in CSS pixels
const CURVE_LABEL = 18; // above and below it
const CURVE_MARGIN = 8; // on the left and the right: half of a slider's thumb
// The key of stored settings that says what the highlights of their picture were expanded up to.
const EXPANDED = "vkbloom:expand";
// What a side is expanded up to if that follows from its settings: the server answers a number.
const AUTOMATIC = "auto";

const clamp = (value, low, high) => Math.min(Math.max(value, low), high);

function make(tag, properties = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(properties)) {
    if (name === "on") {
      for (const [event, listener] of Object.entries(value)) {
        element.addEventListener(event, listener);
      }
    } else if (name in element) element[name] = value;
    else element.setAttribute(name, value);
  }
  element.append(...children);
  return element;
}

function draw2d(tag, attributes = {}, ...children) {
  // (An address in this file would look like something that it loads.)
  const { namespaceURI } = make("template", { innerHTML: "<svg></svg>" }).content.firstChild;
  const element = document.createElementNS(namespaceURI, tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  element.append(...children);
  return element;
}

function choose(names, listener, properties = {}) {
  const options = names.map(([value, text]) => make("option", { value, textContent: text }));
  return make("select", { ...properties, on: { change: listener } }, ...options);
}

const plainly = (names) => names.map((name) => [name, name]);

// The index of a stored value: the nearest number, or an equal value, else the first.
export function nearestIndex(values, value) {
  const away = (one) =>
    typeof one === "number" && typeof value === "number" ? Math.abs(one - value) : one === value ? 0 : Infinity;
  return values.reduce((best, one, index) => (away(one) < away(values[best]) ? index : best), 0);
}

// A slider that has only stored values.
function storedControl({ values }, changed) {
  const slider = make("input", { type: "range", min: 0, max: values.length - 1, step: 1 });
  const text = make("output", { className: "vkb-value" });
  const show = (value) => {
    slider.value = nearestIndex(values, value);
    slider.ariaValueText = text.value = String(values[slider.value] ?? "automatic");
  };
  slider.addEventListener("input", () => {
    const value = values[slider.value];
    show(value);
    changed(value);
  });
  return [[slider, text], show, slider];
}

// A control of one field: an element to show, and a function that shows a value.
function control(field, changed) {
  if (field.values) return storedControl(field, changed);
  if (field.kind === "bool") {
    const box = make("input", { type: "checkbox" });
    box.addEventListener("input", () => changed(box.checked));
    return [[box], (value) => (box.checked = value), box];
  }
  if (field.kind === "choice") {
    const names = plainly(field.choices);
    if (field.optional) names.unshift(["", field.none ?? "automatic"]);
    const select = choose(names, () => changed(select.value || null));
    return [[select], (value) => (select.value = value ?? ""), select];
  }
  const slider = make("input", { type: "range", min: field.from, max: field.to, step: field.step });
  const number = make("input", {
    type: "number",
    min: field.low,
    max: field.high,
    step: field.integer ? 1 : "any",
    ariaLabel: `${field.name}, as a number`,
  });
  slider.addEventListener("input", () => {
    number.value = slider.value;
    changed(Number(slider.value));
  });
  number.addEventListener("input", () => {
    if (number.value === "" || Number.isNaN(number.valueAsNumber)) return;
    slider.value = number.value;
    changed(number.valueAsNumber);
  });
  const parts = [slider, number];
  if (!field.optional) {
    return [parts, (value) => (slider.value = number.value = value), slider];
  }
  const on = make("input", { type: "checkbox", ariaLabel: `${field.name}, on` });
  const enable = () => (slider.disabled = number.disabled = !on.checked);
  on.addEventListener("input", () => {
    enable();
    changed(on.checked ? Number(number.value) : null);
  });
  const show = (value) => {
    on.checked = value !== null;
    enable();
    if (value !== null) slider.value = number.value = value;
    else if (number.value === "") slider.value = number.value = clamp(1, field.from, field.to);
  };
  return [[on, ...parts], show, slider];
}

async function copy(text) {
  try {
    await navigator.clipboard.writeText(text);
  } catch {
    // Pages that are neither local nor encrypted have no other clipboard function.
    const area = make("textarea", { value: text });
    document.body.append(area);
    area.select();
    document.execCommand("copy");
    area.remove();
  }
}

function download(blob, name) {
  const link = make("a", { href: URL.createObjectURL(blob), download: name });
  link.click();
  // The browser needs the address until the download starts.
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}

const decodePng = (content) =>
  createImageBitmap(new Blob([content], { type: "image/png" }), { colorSpaceConversion: "none" });

// The page's state in the fragment of its address, which is not sent to a server.
export const addressStore = {
  read() {
    try {
      return JSON.parse(decodeURIComponent(location.hash.slice(1)));
    } catch {
      return null;
    }
  },
  write(state) {
    const text = JSON.stringify(state);
    const fragment = text === "{}" ? "" : `#${encodeURIComponent(text)}`;
    history.replaceState(null, "", location.pathname + fragment);
  },
  watch(listener) {
    window.addEventListener("hashchange", () => listener(addressStore.read()));
  },
};

// `send(message, files)` sends a message with the contents of files. `store` keeps the page's
// state: `read()` returns an object or null, `write(object)` stores one, and `watch(listener)`
// reports changes by the user. `heading` is the tag of the title. `decode` makes a picture of a
// buffer of an answer.
export function mount(parent, send, { store = null, heading = "h2", decode = decodePng } = {}) {
  const view = Math.random().toString(36).slice(2);
  const root = make("div", { className: "vkbloom" });
  const layout = make("div", { className: "vkb-layout" });
  root.append(layout);
  root.dataset.lmSuppressShortcuts = "true"; // no JupyterLab shortcuts for letters in these inputs
  // Otherwise the element of a notebook may shrink with its content, which adapts to its width.
  parent.style.width = "100%";
  parent.append(root);

  let setup; // the answer to "setup": controls, presets, source
  const settings = {}; // by side
  const shown = {}; // by side: the picture, and the data in its answer
  const errors = {};
  let editing = "a";
  let comparing = false;
  let wipe = 0.5;
  let framebuffer = "final";
  let time = 0;
  let playing = 0; // the request of the next animation frame, 0: paused
  let number = 0; // the frame of a clip
  let moment = 0; // while it plays, in seconds
  let speed = 1;
  let stages = { exposure: null, taa: null }; // of a clip: the names of those in time
  const curves = {}; // by side: the exposures of a clip's frames, as far as they are known
  const reached = new Map(); // by side: the frame up to which those before are computed
  let filling = false; // a longer curve is asked for
  let curveFailed = false;
  let stops = 0;
  let isSourceSize = false;
  let shading = null; // of a scene
  let glow = null;
  let expand = { a: null, b: null }; // of a photograph, by side; null: not expanded
  let touched = null; // the control that was changed last
  let zoom = 1; // 1: the picture fits
  let centre = [0.5, 0.5]; // of the visible part of the picture, 0..1 from left and top
  let pointer = null; // its position, 0..1 from left and top

  let drawn = 0;
  let asked = 0;
  let waiting = 0; // the id of the requested frame, 0: none
  const sent = new Map(); // by id: the time, and the position of the pointer
  const outdated = new Set();
  let probing = false;
  let probeAgain = false;
  let box = [0, 0]; // the space for the picture, in CSS pixels
  let nextZoom = null; // called when the picture with another size has arrived

  // The constant parts. `build` adds those that depend on the setup.
  const canvas = make("canvas", { width: 1, height: 1, role: "img", ariaLabel: "picture" });
  const divider = make("div", {
    className: "vkb-divider",
    tabIndex: 0,
    role: "slider",
    ariaLabel: "wipe between A, on the left, and B",
    ariaValueMin: "0",
    ariaValueMax: "100",
    hidden: true,
  });
  const stage = make(
    "div",
    {
      className: "vkb-stage",
      tabIndex: 0,
      role: "group",
      ariaLabel: KEYS,
    },
    canvas,
    divider,
  );
  const seen = make("div", { className: "vkb-view" }, stage);
  const readout = make("output", { className: "vkb-readout" });
  const caption = make("p", { className: "vkb-caption" });
  const bar = make("div", { className: "vkb-bar" });
  const status = make("div", { className: "vkb-status" });
  const passes = make("table");
  const plan = make(
    "details",
    { className: "vkb-plan", on: { toggle: () => showPlan() } },
    make("summary", { textContent: "Plan" }),
    make("div", { tabIndex: 0, role: "region", ariaLabel: "plan" }, passes),
  );
  const timeline = make("div", { className: "vkb-timeline", hidden: true });
  const below = make("div", { className: "vkb-below" }, timeline, readout, caption, bar, status, plan);
  const head = make("div", { className: "vkb-head" });
  const fields = make("div", { className: "vkb-fields" });
  const complaint = make("div", { className: "vkb-error", role: "alert" });
  // The errors of custom methods' files stay until the files are mended.
  const fileError = make("pre", { className: "vkb-error vkb-file-error", role: "status" });
  const code = make("code");
  const button = (text, listener, properties = {}) =>
    make("button", { type: "button", textContent: text, ...properties, on: { click: listener } });
  const copying = button("Copy as code", async () => {
    await copy(code.textContent);
    copying.textContent = "Copied";
    setTimeout(() => (copying.textContent = "Copy as code"), 1500);
  });
  const picker = make("input", { type: "file", hidden: true, ariaLabel: "image or settings" });
  picker.addEventListener("change", () => {
    if (picker.files.length) openFile(picker.files[0]);
    picker.value = "";
  });
  const opening = button("Open …", () => picker.click(), {
    title: "An image, or settings that were saved here; files can be dropped on the page, too",
  });
  const saving = button("Save picture", savePicture, {
    title: "As PNG, in the source's own size",
  });
  const files = make(
    "div",
    { className: "vkb-bar vkb-files" },
    opening,
    saving,
    button("Save settings", () => {
      const kept = { ...settings[editing] };
      if (setup.expand) kept[EXPANDED] = shown[editing]?.expand ?? 1;
      const text = JSON.stringify(kept, null, 2) + "\n";
      download(new Blob([text], { type: "application/json" }), "settings.json");
    }),
    button("Reset", reset, { title: "Settings and view as they were at first" }),
    picker,
  );
  const foot = make(
    "div",
    { className: "vkb-foot" },
    complaint,
    make("pre", {}, code),
    make("div", { className: "vkb-bar" }, copying),
  );
  const title = make(heading, { className: "vkb-title", textContent: "vkbloom explorer" });
  const storedNote = make("p", { className: "vkb-stored", hidden: true });
  const panel = make("div", { className: "vkb-panel" }, storedNote, head, fileError, files, fields, foot);
  layout.append(title, seen, below, panel);

  const visible = () => (comparing ? SIDES : ["a"]);

  // Disable the inputs of a control for which there are no stored pictures, and say why.
  function lock(element) {
    if (!setup.stored) return;
    const inputs = "input, select, button";
    const all = element.matches(inputs) ? [element] : element.querySelectorAll(inputs);
    for (const input of all) input.disabled = true;
    element.title = [element.title, setup.stored.reason].filter(Boolean).join(". ");
  }

  // --- asking ---------------------------------------------------------------------------------

  function request(...sides) {
    curveFailed = false;
    for (const side of sides) outdated.add(side);
    flush();
  }

  // One frame is requested at a time. Changes in between are requested together when it has
  // arrived, so that there is no queue.
  function flush() {
    const sides = visible().filter((side) => outdated.has(side));
    if (waiting || !sides.length || !setup || !box[0]) return;
    for (const side of sides) outdated.delete(side);
    waiting = ++asked;
    sent.set(waiting, { when: performance.now(), pointer, framebuffer });
    send({ kind: "frame", id: waiting, framebuffer, at: pointer, ...askedFor(sides) });
    keep();
  }

  // What the pictures and the curves of sides depend on.
  function askedFor(sides) {
    const bySide = (values) => Object.fromEntries(sides.map((side) => [side, values(side)]));
    const ratio = window.devicePixelRatio || 1;
    return {
      view,
      sides: bySide((side) => settings[side]),
      size: isSourceSize ? null : box.map((length) => Math.max(1, Math.round(length * ratio))),
      ...lookedAt(),
      ...(setup.expand ? { expand: bySide((side) => expand[side]) } : {}),
      ...(setup.clip ? { curve: bySide((side) => [curves[side]?.chain ?? 0, curves[side]?.stops.length ?? 0]) } : {}),
    };
  }

  function lookedAt() {
    return {
      time,
      stops,
      ...(setup.shadings.length ? { shading, glow } : {}),
      ...(setup.clip ? { number, ...stages } : {}),
    };
  }

  // The rest of a clip's curve is computed while nothing else is asked for, which also makes every
  // frame quick to reach.
  function fillCurve() {
    if (!setup?.clip) return;
    const sides = visible().filter((side) => curves[side] && !curves[side].isDone);
    if (!sides.length || filling || waiting || playing || curveFailed || document.hidden) return;
    filling = true;
    send({ kind: "curve", ...askedFor(sides) });
  }

  function probe() {
    if (!pointer || !shown.a || setup.stored) return;
    probeAgain = probing;
    if (probing) return;
    probing = true;
    send({ kind: "probe", view, at: pointer });
  }

  // --- answers --------------------------------------------------------------------------------

  async function receive(message, buffers) {
    if (message.view && message.view !== view) return;
    if (message.kind === "setup") {
      if (!setup) build(message);
    } else if (message.kind === "open") {
      opened(message);
    } else if (message.kind === "methods") {
      methodsChanged(message);
    } else if (message.kind === "curve") {
      filling = false;
      for (const [side, { curve }] of Object.entries(message.sides)) mergeCurve(side, curve);
      drawCurve();
      fillCurve();
    } else if (message.kind === "save" && message.reached !== undefined) {
      showReached(message.reached);
      savePicture();
    } else if (message.kind === "save") {
      download(new Blob([buffers[0]], { type: "image/png" }), `${message.framebuffer}.png`);
    } else if (message.kind === "settings") {
      for (const side of Object.keys(message.sides)) settings[side] = message.sides[side];
      if (!setup) return;
      buildFields();
      request(...Object.keys(message.sides));
    } else if (message.kind === "probe") {
      probing = false;
      for (const side of Object.keys(message.sides)) {
        if (shown[side]) shown[side].probe = message.sides[side].probe;
      }
      showReadout();
      if (probeAgain) probe();
    } else if (message.kind === "frame") {
      // The next one may be rendered while this one is decoded.
      waiting = 0;
      for (const [side, facts] of Object.entries(message.sides)) {
        if (setup.clip) mergeCurve(side, facts.curve);
        if (facts.reached === undefined) reached.delete(side);
        else reached.set(side, facts.reached);
        // It is asked for again, until the frames before it are computed.
        if (facts.reached !== undefined) outdated.add(side);
      }
      flush();
      await showFrame(message, buffers);
      fillCurve();
    } else {
      // The error of a requested frame, or of a file.
      if (message.id) waiting = 0;
      probing = filling = false;
      curveFailed = true;
      pause();
      complaint.textContent = message.error;
    }
  }

  async function showFrame(message, buffers) {
    const sides = Object.entries(message.sides);
    const pictures = await Promise.all(
      sides.map(([, side]) =>
        "error" in side || "reached" in side
          ? null
          : decode(buffers[side.picture]),
      ),
    );
    const began = sent.get(message.id);
    sent.delete(message.id);
    // Pictures may be decoded in another order than they arrived.
    if (message.id < drawn) return;
    drawn = message.id;
    sides.forEach(([side, facts], index) => {
      errors[side] = facts.error;
      if (!pictures[index]) return;
      if (expand[side] === AUTOMATIC) {
        expand[side] = facts.expand;
        if (side === editing) showExpansion();
      }
      shown[side]?.picture.close();
      shown[side] = { ...facts, picture: pictures[index] };
    });
    showMoment();
    if (reached.size) showReached(Math.min(...reached.values()));
    // Nothing is new while all of them are waited for.
    if (sides.every(([, facts]) => "reached" in facts)) return;
    draw();
    nextZoom?.();
    nextZoom = null;
    showFacts(performance.now() - began.when, began.framebuffer);
    // Its values are those at the position of the pointer at the time of the request.
    if (pointer !== began.pointer) probe();
    root.dispatchEvent(new CustomEvent("vkbloom:drawn", { detail: { id: message.id } }));
  }

  // --- showing --------------------------------------------------------------------------------

  function draw() {
    const { a, b } = shown;
    if (!a) return;
    [canvas.width, canvas.height] = a.size;
    const context = canvas.getContext("2d");
    context.imageSmoothingEnabled = false;
    context.drawImage(a.picture, 0, 0, canvas.width, canvas.height);
    if (comparing && b) {
      const left = Math.round(wipe * canvas.width);
      context.save();
      context.beginPath();
      context.rect(left, 0, canvas.width - left, canvas.height);
      context.clip();
      context.clearRect(0, 0, canvas.width, canvas.height);
      context.drawImage(b.picture, 0, 0, canvas.width, canvas.height);
      context.restore();
    }
    place();
  }

  const ratioOf = () => window.devicePixelRatio || 1;
  const fitting = () => Math.min(box[0] / canvas.width, box[1] / canvas.height);

  // Framebuffers keep their aspect ratio in the box. Enlarged ones show their pixels.
  function place() {
    stage.style.width = `${box[0]}px`;
    stage.style.height = `${box[1]}px`;
    if (!shown.a) return;
    const scale = fitting() * zoom;
    const sides = [canvas.width * scale, canvas.height * scale];
    // A picture that is larger than the box covers it completely. A smaller one is centred.
    const corner = sides.map((side, axis) => {
      if (side <= box[axis]) {
        centre[axis] = 0.5;
        return (box[axis] - side) / 2;
      }
      const half = box[axis] / side / 2;
      centre[axis] = clamp(centre[axis], half, 1 - half);
      return box[axis] / 2 - centre[axis] * side;
    });
    canvas.style.width = `${sides[0]}px`;
    canvas.style.height = `${sides[1]}px`;
    canvas.style.left = `${corner[0]}px`;
    canvas.style.top = `${corner[1]}px`;
    canvas.style.imageRendering = scale * ratioOf() > 1.5 ? "pixelated" : "auto";
    stage.classList.toggle("vkb-zoomed", zoom > 1);
    divider.hidden = !comparing;
    divider.style.left = `${corner[0] + wipe * sides[0]}px`;
    divider.ariaValueNow = String(Math.round(100 * wipe));
    const percent = 100 * scale * ratioOf();
    zoomed.textContent = `${percent >= 10 ? percent.toFixed(0) : percent.toPrecision(2)} %`;
  }

  // Show a part of the picture, such that a position in it (0..1) keeps its position on the screen.
  function zoomTo(next, at = centre) {
    const whole = 1 / ratioOf() / fitting(); // the zoom of 100 %
    const before = zoom;
    zoom = clamp(next, Math.min(1, whole), Math.max(1, MAX_ZOOM * whole));
    centre = centre.map((middle, axis) => at[axis] + ((middle - at[axis]) * before) / zoom);
    place();
    keep();
  }
  const showWhole = () => ((centre = [0.5, 0.5]), zoomTo(1));
  const showPixels = () => zoomTo(1 / ratioOf() / fitting());

  function showFacts(roundTrip, wanted) {
    const { a } = shown;
    if (a) {
      const names = [...frameSelect.options].map((option) => option.value);
      if (names.join() !== a.names.join()) {
        frameSelect.replaceChildren(
          ...a.names.map((name) => make("option", { value: name, textContent: name })),
        );
      }
      // The settings may not have the selected framebuffer. Another one may have been selected
      // since the request.
      if (wanted === framebuffer) framebuffer = a.framebuffer;
      frameSelect.value = framebuffer;
      canvas.ariaLabel = `picture: ${a.framebuffer}, ${a.size[0]} × ${a.size[1]}`;
      const { sentence } = a.plan.find(({ writes }) => writes.includes(a.framebuffer)) ?? {};
      caption.textContent = sentence ? `${a.framebuffer}: ${sentence}` : "";
      const passes = Object.entries(a.passes);
      const device = passes.reduce((sum, [, seconds]) => sum + 1e3 * seconds, 0);
      const ran = setup.stored
        ? "stored picture"
        : passes.length
          ? `${passes.map(([name]) => name).join(", ")}: ${device.toFixed(1)} ms`
          : "nothing had to run";
      const expanded = a.expand > 1 ? `highlights expanded up to ${a.expand}` : "";
      status.textContent =
        `${[a.note, a.faint, expanded, setup.adapter].filter(Boolean).join(" · ")} · ${a.size[0]} × ${a.size[1]} ${a.dtype} · ${ran} · ` +
        `${roundTrip.toFixed(0)} ms until shown`;
    }
    showError();
    code.textContent = shown[editing]?.code ?? "";
    showReadout();
    showPlan();
  }

  // An error that begins with a field's name is shown below that field, any other one below all.
  function showError() {
    const text = errors[editing] ?? "";
    fields.querySelector(".vkb-error")?.remove();
    for (const input of fields.querySelectorAll("[aria-invalid]")) {
      input.removeAttribute("aria-invalid");
      input.removeAttribute("aria-describedby");
    }
    const name = /^(\w+):/.exec(text)?.[1];
    const named = [...fields.querySelectorAll("[data-field]")].filter(
      ({ dataset }) => dataset.field.split(".").at(-1) === name,
    );
    const first = named.includes(touched) ? touched : named[0];
    complaint.textContent = first ? "" : text;
    if (!first) return;
    const row = first.closest(".vkb-field");
    const id = `vkb-${view}-error`;
    row.after(make("div", { className: "vkb-error", role: "alert", id, textContent: text }));
    for (const input of row.querySelectorAll("input, select")) {
      input.setAttribute("aria-invalid", "true");
      input.setAttribute("aria-describedby", id);
    }
    const hidden = first.closest("details");
    if (hidden) hidden.open = true;
  }

  // The passes of the settings that are edited, each with its time. Passes with the same name have
  // one time together.
  function showPlan() {
    if (!plan.open || !shown[editing]) return;
    const rows = shown[editing].plan;
    const whole = Object.values(shown[editing].passes).reduce((sum, one) => sum + one, 0) || 1;
    const timed = setup.stored ? [] : ["time"];
    const head = ["pass", ...timed, "what it does", "shader", "variant", "reads", "writes"];
    const cell = (tag, textContent, more = {}) => make(tag, { textContent, ...more });
    passes.replaceChildren(
      make("thead", {}, make("tr", {}, ...head.map((text) => cell("th", text, { scope: "col" })))),
      make("tbody", {}, ...rows.map((row, place) => {
        const texts = [row.shader, row.variant, row.reads.join(", "), row.writes.join(", ")];
        const cells = texts.map((text) => cell("td", text));
        if (rows[place - 1]?.name !== row.name) {
          const others = rows.slice(place).findIndex(({ name }) => name !== row.name);
          const rowSpan = others < 0 ? rows.length - place : others;
          const seconds = shown[editing].passes[row.name];
          const percent = (100 * (seconds ?? 0)) / whole;
          const time =
            seconds === undefined
              ? "up to date"
              : `${(1e3 * seconds).toFixed(2)} ms, ${percent.toFixed(0)} %`;
          const bar = make("div", { className: "vkb-pass-time", "aria-hidden": "true" });
          bar.style.width = `${percent}%`;
          cells.unshift(cell("td", row.sentence, { className: "vkb-sentence", rowSpan }));
          if (timed.length) {
            cells.unshift(cell("td", time, { rowSpan }));
            cells[0].append(bar);
          }
          cells.unshift(cell("th", row.name, { scope: "rowgroup", rowSpan }));
        }
        return make("tr", {}, ...cells);
      })),
    );
  }

  function showReadout() {
    const lines = visible()
      .filter((side) => pointer && shown[side]?.probe)
      .map((side) => {
        const { x, y, values } = shown[side].probe;
        const name = comparing ? `${side.toUpperCase()} ` : "";
        return `${name}${shown[side].framebuffer}[${y}, ${x}] = ${values.join("  ")}`;
      });
    const hint = setup?.stored
      ? "Values under the pointer are not stored; vkbloom explore shows them."
      : "Point at the picture to read its values.";
    readout.textContent = lines.join("\n") || hint;
  }

  function showReached(frame) {
    status.textContent = `computing the frames before: ${frame} of ${number}`;
  }

  function fail(text) {
    pause();
    complaint.textContent = text;
    root.classList.add("vkb-failed");
  }

  // --- the pointer and the wipe ---------------------------------------------------------------

  function placeOf(event) {
    const area = canvas.getBoundingClientRect();
    return [
      clamp((event.clientX - area.left) / area.width, 0, 1),
      clamp((event.clientY - area.top) / area.height, 0, 1),
    ];
  }
  const held = new Map(); // by id of a pointer that is pressed on the picture: its latest event
  const distance = () => {
    const [one, other] = [...held.values()];
    return Math.hypot(one.clientX - other.clientX, one.clientY - other.clientY);
  };
  canvas.addEventListener("pointerdown", (event) => {
    held.set(event.pointerId, event);
    canvas.setPointerCapture(event.pointerId);
  });
  canvas.addEventListener("pointermove", (event) => {
    const before = held.get(event.pointerId);
    if (before && held.size === 2) {
      const apart = distance();
      held.set(event.pointerId, event);
      zoomTo((zoom * distance()) / Math.max(apart, 1), placeOf(event));
    } else if (before) {
      const area = canvas.getBoundingClientRect();
      centre[0] -= (event.clientX - before.clientX) / area.width;
      centre[1] -= (event.clientY - before.clientY) / area.height;
      held.set(event.pointerId, event);
      place();
      keep();
    }
    pointer = placeOf(event);
    probe();
  });
  for (const name of ["pointerup", "pointercancel"]) {
    canvas.addEventListener(name, (event) => held.delete(event.pointerId));
  }
  canvas.addEventListener("pointerleave", () => {
    pointer = null;
    showReadout();
  });
  stage.addEventListener(
    "wheel",
    (event) => {
      // In a notebook, the wheel without a key scrolls the notebook.
      if (!store && !event.ctrlKey) return;
      event.preventDefault();
      zoomTo(zoom * 2 ** (-clamp(event.deltaY, -120, 120) / 240), placeOf(event));
    },
    { passive: false },
  );
  canvas.addEventListener("dblclick", (event) => (zoom === 1 ? zoomTo(4, placeOf(event)) : showWhole()));
  stage.addEventListener("keydown", (event) => {
    if (event.target !== stage || event.ctrlKey || event.metaKey || event.altKey) return;
    const moves = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
    if (event.key === "+" || event.key === "=") zoomTo(zoom * 1.5);
    else if (event.key === "-") zoomTo(zoom / 1.5);
    else if (event.key === "0") showWhole();
    else if (event.key === " " && (setup.clip || setup.animated)) playButton.click();
    else if (event.key === "," && setup.clip) goToFrame(number - 1);
    else if (event.key === "." && setup.clip) goToFrame(number + 1);
    else if (event.key in moves && zoom > 1) {
      centre = centre.map((middle, axis) => middle + (0.1 * moves[event.key][axis]) / zoom);
      place();
      keep();
    } else return;
    event.preventDefault();
    event.stopPropagation();
  });

  function wipeTo(share) {
    wipe = clamp(share, 0, 1);
    draw();
    keep();
  }
  divider.addEventListener("pointerdown", (event) => {
    divider.setPointerCapture(event.pointerId);
    event.preventDefault();
    divider.focus();
  });
  divider.addEventListener("pointermove", (event) => {
    if (!divider.hasPointerCapture(event.pointerId)) return;
    const area = canvas.getBoundingClientRect();
    wipeTo((event.clientX - area.left) / area.width);
  });
  divider.addEventListener("keydown", (event) => {
    const step = { ArrowLeft: -0.02, ArrowDown: -0.02, ArrowRight: 0.02, ArrowUp: 0.02 }[event.key];
    if (step === undefined) return;
    event.preventDefault();
    event.stopPropagation();
    wipeTo(wipe + step);
  });

  // --- files ----------------------------------------------------------------------------------

  async function openFile(file) {
    complaint.textContent = "";
    try {
      if (/\.json$/i.test(file.name)) return use(...(await readSettings(file)));
      const content = new Uint8Array(await file.arrayBuffer());
      send({ kind: "open", view, name: file.name }, [content]);
    } catch (error) {
      complaint.textContent = `${file.name}: ${error.message}`;
    }
  }

  // The server checks the values. Only the method must be known here.
  async function readSettings(file) {
    const { [EXPANDED]: expanded, ...read } = JSON.parse(await file.text());
    const method = setup.methods[read?.method];
    if (!method) throw new Error("no settings of a known method");
    return [{ ...method.defaults, ...read }, expanded];
  }

  // The source is another one. A scene's settings are not kept for an image.
  function opened(source) {
    Object.assign(setup, source);
    for (const side of SIDES) settings[side] = setup.sides[side];
    expand = { a: null, b: null, ...setup.expand };
    pause();
    pointer = null;
    zoom = 1;
    centre = [0.5, 0.5];
    buildBar();
    buildTimeline();
    buildFields();
    for (const side of SIDES) outdated.add(side);
    measure();
    flush();
  }

  // Custom methods are files, which are edited elsewhere: the page asks whether they changed.
  let watching = 0;
  const watchFiles = () => {
    watching = setTimeout(() => send({ kind: "methods", view }), WATCH);
  };

  // The values of fields that the new method has are kept, as far as it accepts them.
  function carried(own, { defaults, fields }) {
    const kept = Object.entries(defaults).map(([name, value]) => [name, own[name] ?? value]);
    const next = { ...Object.fromEntries(kept), method: defaults.method };
    for (const { name, kind, low, high, choices } of fields) {
      if (kind === "number" && next[name] !== null) next[name] = clamp(next[name], low, high);
      if (kind === "choice" && typeof next[name] === "string" && !choices.includes(next[name])) {
        next[name] = defaults[name];
      }
    }
    return next;
  }

  function methodsChanged(message) {
    fileError.textContent = Object.values(message.errors).join("\n");
    for (const [name, method] of Object.entries(message.methods)) {
      setup.methods[name] = method;
      for (const own of [settings, setup.sides]) {
        for (const side of SIDES) {
          if (own[side].method === name) own[side] = carried(own[side], method);
        }
      }
      if (settings[editing].method === name) buildFields({ keepPreset: true });
      request(...SIDES.filter((side) => settings[side].method === name));
    }
    watchFiles();
  }

  function savePicture() {
    const expanded = setup.expand ? { expand: shown[editing]?.expand ?? null } : {};
    send({ kind: "save", view, settings: settings[editing], framebuffer, ...expanded, ...lookedAt() });
  }

  for (const name of ["dragover", "drop"]) {
    root.addEventListener(name, (event) => {
      if (![...event.dataTransfer.types].includes("Files")) return;
      event.preventDefault();
      if (setup?.stored) return;
      root.classList.toggle("vkb-over", name === "dragover");
      if (name === "drop" && event.dataTransfer.files.length) openFile(event.dataTransfer.files[0]);
    });
  }
  root.addEventListener("dragleave", () => root.classList.remove("vkb-over"));

  // --- state ----------------------------------------------------------------------------------

  // The differences from the initial state, so that the address is short.
  function state() {
    const kept = {};
    for (const side of SIDES) {
      const { method } = settings[side];
      const begun = setup.sides[side].method === method ? setup.sides[side] : setup.methods[method].defaults;
      const changed = Object.entries(settings[side]).filter(
        ([name, value]) => JSON.stringify(value) !== JSON.stringify(begun[name]),
      );
      if (changed.length || setup.sides[side].method !== method) {
        kept[side] = { method, ...Object.fromEntries(changed) };
      }
    }
    if (comparing) kept.wipe = Number(wipe.toFixed(3));
    if (editing !== "a") kept.editing = editing;
    if (framebuffer !== "final") kept.framebuffer = framebuffer;
    if (isSourceSize) kept.size = "own";
    if (stops) kept.stops = stops;
    if (time && !playing) kept.time = Number(time.toFixed(3));
    if (setup.clip) {
      if (number && !playing) kept.number = number;
      if (speed !== 1) kept.speed = speed;
      const begun = Object.entries(setup.clip.stages);
      const changed = begun.filter(([name, stage]) => stages[name] !== stage.begun);
      if (changed.length) kept.stages = Object.fromEntries(changed.map(([name]) => [name, stages[name]]));
    }
    if (shading !== setup.shading) kept.shading = shading;
    if (glow !== setup.glow) kept.glow = glow;
    if (setup.expand && SIDES.some((side) => expand[side] !== setup.expand[side])) kept.expand = expand;
    if (zoom !== 1) kept.zoom = [zoom, ...centre].map((number) => Number(number.toPrecision(5)));
    return kept;
  }

  let keeping = 0;
  function keep() {
    if (!store || !setup || keeping || playing) return;
    keeping = setTimeout(() => {
      keeping = 0;
      store.write(state());
    }, 200);
  }

  const numberOf = (value, otherwise) => (Number.isFinite(value) ? value : otherwise);

  // An address may contain anything. Invalid parts are ignored.
  function restore(kept) {
    kept ??= {};
    for (const side of SIDES) {
      const method = setup.methods[kept[side]?.method];
      const begun =
        setup.sides[side].method === kept[side]?.method ? setup.sides[side] : method?.defaults;
      // A file of an custom method may have lost fields since.
      const known = Object.entries(kept[side] ?? {}).filter(([name]) => method && name in begun);
      settings[side] = method ? { ...begun, ...Object.fromEntries(known) } : { ...setup.sides[side] };
    }
    comparing = Number.isFinite(kept.wipe);
    wipe = clamp(numberOf(kept.wipe, 0.5), 0, 1);
    editing = comparing && kept.editing === "b" ? "b" : "a";
    framebuffer = typeof kept.framebuffer === "string" ? kept.framebuffer : "final";
    isSourceSize = kept.size === "own";
    stops = clamp(numberOf(kept.stops, 0), -16, 16);
    time = clamp(numberOf(kept.time, 0), 0, 1);
    number = clamp(Math.round(numberOf(kept.number, 0)), 0, (setup.clip?.times.length ?? 1) - 1);
    speed = SPEEDS.includes(kept.speed) ? kept.speed : 1;
    for (const [name, stage] of Object.entries(setup.clip?.stages ?? {})) {
      const value = kept.stages?.[name];
      stages[name] = value === null || stage.choices.includes(value) ? value : stage.begun;
    }
    shading = setup.shadings.includes(kept.shading) ? kept.shading : setup.shading;
    glow = setup.glow === null ? null : Math.max(0, numberOf(kept.glow, setup.glow));
    expand = { a: null, b: null, ...setup.expand };
    for (const side of SIDES) {
      const value = kept.expand?.[side];
      if (setup.expand && (value === null || value >= 1)) expand[side] = value;
    }
    const [factor, x, y] = Array.isArray(kept.zoom) ? kept.zoom : [];
    zoom = Math.max(1e-3, numberOf(factor, 1));
    centre = [numberOf(x, 0.5), numberOf(y, 0.5)];
    pause();
    timeSlider.value = time;
    buildBar();
    buildTimeline();
    buildHead();
    buildFields();
    if (shown.a) draw();
    request(...SIDES);
    keep();
  }

  function reset() {
    complaint.textContent = "";
    restore(null);
    place();
  }

  // --- time -----------------------------------------------------------------------------------

  const timeSlider = make("input", { type: "range", min: 0, max: 1, step: 0.001, value: 0 });
  timeSlider.ariaLabel = "time, in turns";
  const playButton = make("button", { type: "button", className: "vkb-play", textContent: "Play" });

  function goTo(turns) {
    time = turns;
    timeSlider.value = turns;
    request(...visible());
  }
  function play() {
    let before = performance.now();
    moment = setup.clip?.times[number] ?? 0;
    const step = (now) => {
      const seconds = Math.max(0, now - before) / 1e3;
      before = now;
      if (setup.clip) playOn(seconds * speed);
      else goTo((time + seconds * TURNS_PER_SECOND) % 1);
      playing = requestAnimationFrame(step);
    };
    playing = requestAnimationFrame(step);
    playButton.textContent = "Pause";
  }
  function pause() {
    cancelAnimationFrame(playing);
    playing = 0;
    playButton.textContent = "Play";
  }
  timeSlider.addEventListener("input", () => goTo(Number(timeSlider.value)));
  playButton.addEventListener("click", () => {
    if (playing) pause();
    else play();
    keep();
    fillCurve();
  });

  // --- clips ----------------------------------------------------------------------------------

  const frameSlider = make("input", { type: "range", min: 0, step: 1, ariaLabel: "frame" });
  const momentText = make("span", { className: "vkb-moment" });
  const curve = draw2d("svg", { class: "vkb-curve", role: "img" });
  frameSlider.addEventListener("input", () => goToFrame(Number(frameSlider.value)));

  // Time waits for frames that take longer to compute than to show.
  function playOn(seconds) {
    const { times } = setup.clip;
    if (reached.size) return;
    moment += seconds;
    const last = times.at(-1);
    if (moment >= last + (last - (times.at(-2) ?? last - 1))) moment = times[0];
    let next = times.findLastIndex((one) => one <= moment);
    if (next < 0) next = 0;
    if (next !== number) showFrameOf(next);
  }

  function goToFrame(next) {
    next = clamp(next, 0, setup.clip.times.length - 1);
    moment = setup.clip.times[next];
    if (next !== number) showFrameOf(next);
  }

  function showFrameOf(next) {
    number = next;
    showMoment();
    request(...visible());
  }

  function buildTimeline() {
    timeline.hidden = !setup.clip;
    stage.ariaLabel = setup.clip ? KEYS_OF_CLIP : KEYS;
    if (!setup.clip) return;
    const { times, stages: known } = setup.clip;
    frameSlider.max = times.length - 1;
    const speeds = choose(SPEEDS.map((one) => [String(one), `× ${one}`]), () => {
      speed = Number(speeds.value);
      keep();
    });
    speeds.value = String(speed);
    const pick = (name, text) => {
      const names = [["", "none"], ...plainly(known[name].choices)];
      const select = choose(names, () => {
        stages[name] = select.value || null;
        request(...SIDES);
      });
      select.value = stages[name] ?? "";
      return make("label", {}, text, select);
    };
    timeline.replaceChildren(
      frameSlider,
      make(
        "div",
        { className: "vkb-bar" },
        playButton,
        make("label", {}, "speed ", speeds),
        momentText,
        pick("exposure", "exposure of "),
        pick("taa", "TAA of "),
      ),
      curve,
    );
    showMoment();
  }

  // The sides whose curves differ. Those of most exposures do not depend on the bloom.
  function drawnCurves() {
    const sides = visible().filter((side) => curves[side]);
    return sides.filter((side) => side === sides[0] || curves[side].chain !== curves[sides[0]].chain);
  }

  const signed = (value) => `${value < 0 ? "−" : "+"}${Math.abs(value).toFixed(2)}`;

  // The exposure of a frame in words; "": it is not known.
  function exposureText(side) {
    const value = curves[side]?.stops[number];
    if (value === undefined) return "";
    return value === null ? "infinite" : `${signed(value)} stops, × ${(2 ** value).toPrecision(3)}`;
  }

  function showMoment() {
    if (!setup.clip) return;
    const { times } = setup.clip;
    frameSlider.value = number;
    const place = `${times[number].toFixed(2)} s, frame ${number + 1} of ${times.length}`;
    const sides = drawnCurves();
    const exposures = sides
      .filter((side) => exposureText(side))
      .map((side) => `${sides.length > 1 ? `${side.toUpperCase()} ` : ""}${exposureText(side)}`);
    frameSlider.ariaValueText = place;
    momentText.textContent = [place, ...exposures].join(" · ");
    drawCurve();
  }

  function mergeCurve(side, part) {
    if (!part) {
      curves[side] = null;
      return;
    }
    const known = curves[side]?.chain === part.chain ? curves[side].stops.slice(0, part.from) : [];
    curves[side] = { chain: part.chain, stops: known.concat(part.stops), isDone: part.is_done };
  }

  // The exposure by time, of B dashed; the present frame is marked.
  function drawCurve() {
    if (!setup.clip) return;
    const { times } = setup.clip;
    const sides = drawnCurves();
    curve.toggleAttribute("hidden", !sides.length);
    if (!sides.length || !box[0]) return;
    const finite = sides.flatMap((side) => curves[side].stops.filter((one) => one !== null));
    const lowest = finite.reduce((least, one) => Math.min(least, one), Infinity);
    const highest = finite.reduce((most, one) => Math.max(most, one), -Infinity);
    const [middle, half] = finite.length
      ? [(lowest + highest) / 2, Math.max(0.5, (highest - lowest) / 2)]
      : [0, 0.5];
    const [width, height] = [seen.clientWidth, CURVE_HEIGHT];
    const seconds = Math.max(times.at(-1) - times[0], 1e-9);
    const x = (frame) => CURVE_MARGIN + ((times[frame] - times[0]) / seconds) * (width - 2 * CURVE_MARGIN);
    const y = (value) => height / 2 - ((value - middle) / half) * (height / 2 - CURVE_LABEL);
    const line = (values) =>
      values
        .map((value, frame) => {
          if (value === null) return "";
          const isFirst = (values[frame - 1] ?? null) === null;
          return `${isFirst ? "M" : "L"}${x(frame).toFixed(1)} ${y(value).toFixed(1)}`;
        })
        .join("");
    const parts = [];
    if (Math.abs(middle) <= half) {
      parts.push(draw2d("line", { class: "vkb-zero", x1: 0, x2: width, y1: y(0), y2: y(0) }));
    }
    for (const side of sides) {
      const { stops: values } = curves[side];
      parts.push(draw2d("path", { class: `vkb-line vkb-line-${side}`, d: line(values) }));
      const value = values[number];
      if (value !== undefined && value !== null) {
        parts.push(draw2d("circle", { cx: x(number), cy: y(value), r: 4 }));
      }
    }
    const now = { class: "vkb-now", x1: x(number), x2: x(number), y1: 0, y2: height };
    const label = (text, place, anchor) => {
      parts.push(draw2d("text", { x: anchor === "end" ? width - 2 : 2, y: place, "text-anchor": anchor }, text));
    };
    parts.push(draw2d("line", now));
    if (finite.length) {
      label(`${signed(highest)} stops`, 12, "start");
      label(`${signed(lowest)} stops`, height - 4, "start");
    }
    label(`${times.at(-1).toFixed(2)} s`, height - 4, "end");
    curve.setAttribute("viewBox", `0 0 ${width} ${height}`);
    curve.replaceChildren(...parts);
    const count = Math.max(...sides.map((side) => curves[side].stops.length));
    const range = finite.length ? `, from ${signed(lowest)} to ${signed(highest)} stops` : "";
    const here = sides.map((side) => exposureText(side)).filter(Boolean);
    curve.ariaLabel =
      `exposure of ${count} of ${times.length} frames${range}` + (here.length ? `; here ${here.join(" and ")}` : "");
  }

  // The curve is a place to point at, beside the slider, which keys move.
  for (const name of ["pointerdown", "pointermove"]) {
    curve.addEventListener(name, (event) => {
      if (name === "pointerdown") curve.setPointerCapture(event.pointerId);
      else if (!curve.hasPointerCapture(event.pointerId)) return;
      const { times } = setup.clip;
      const area = curve.getBoundingClientRect();
      const share = (event.clientX - area.left - CURVE_MARGIN) / (area.width - 2 * CURVE_MARGIN);
      const at = times[0] + clamp(share, 0, 1) * (times.at(-1) - times[0]);
      pause();
      goToFrame(times.findLastIndex((one) => one <= at + 1e-9));
    });
  }

  // --- controls -------------------------------------------------------------------------------

  const frameSelect = choose([["final", "final"]], () => {
    framebuffer = frameSelect.value;
    request(...visible());
  });
  let presetSelect, methodSelect, sideSelect;

  const zoomed = make("output", { className: "vkb-zoom", ariaLabel: "zoom level" });

  function build(message) {
    setup = message;
    restore(store?.read());
    store?.watch(restore);
    if (setup.stored) {
      storedNote.textContent = setup.stored.note;
      storedNote.hidden = false;
      for (const one of [opening, saving]) lock(one);
      showReadout();
    }
    measure();
    if (setup.has_files) watchFiles();
  }

  // The controls of the picture, which depend on the source.
  function buildBar() {
    const sizeSelect = choose(
      [
        ["shown", "as it fits"],
        ["own", setup.source_size.join(" × ")],
      ],
      () => {
        isSourceSize = sizeSelect.value === "own";
        // The source's own size: one screen pixel for each pixel of the picture.
        nextZoom = isSourceSize ? showPixels : showWhole;
        request(...visible());
      },
    );
    sizeSelect.value = isSourceSize ? "own" : "shown";
    const exposure = make("input", { type: "number", min: -16, max: 16, step: 0.5, value: stops });
    exposure.addEventListener("input", () => {
      if (Number.isNaN(exposure.valueAsNumber)) return;
      stops = clamp(exposure.valueAsNumber, -16, 16);
      request(...visible());
    });
    exposure.title = "Stops that floats are shown with; the framebuffer stays as it is";
    const locked = [
      make("label", {}, "size ", sizeSelect),
      make("label", {}, "view exposure ", exposure),
    ];
    bar.replaceChildren(
      make("label", {}, "framebuffer ", frameSelect),
      ...locked,
      make(
        "span",
        { className: "vkb-time", role: "group", ariaLabel: "zoom" },
        button("−", () => zoomTo(zoom / 1.5), { ariaLabel: "zoom out" }),
        zoomed,
        button("+", () => zoomTo(zoom * 1.5), { ariaLabel: "zoom in" }),
        button("Fit", showWhole, { ariaLabel: "fit the picture" }),
        button("1:1", showPixels, { ariaLabel: "100 %" }),
      ),
    );
    if (setup.animated) locked.push(make("span", { className: "vkb-time" }, playButton, timeSlider));
    if (setup.glow !== null) locked.push(...sceneControls());
    bar.append(...locked.slice(2));
    locked.forEach(lock);
  }

  // The controls of a scene. The glow mesh's brightness has an effect only in deferred shading.
  function sceneControls() {
    const field = { name: "glow", kind: "number", from: 0, to: 24, step: 0.5, low: 0, high: 1e4 };
    const [parts, show, slider] = control(field, (value) => {
      glow = value;
      request(...visible());
    });
    const enable = () => parts.forEach((part) => (part.disabled = shading !== "deferred"));
    const select = choose(plainly(setup.shadings), () => {
      shading = select.value;
      enable();
      request(...visible());
    });
    select.value = shading;
    show(glow);
    slider.dataset.field = "glow";
    enable();
    const parted = make("span", { className: "vkb-parts" }, ...parts);
    return [
      make("label", {}, "shading ", select),
      make("label", { className: "vkb-glow", title: "Brightness of the lights; white is 1" }, "glow ", parted),
    ];
  }

  function buildHead() {
    presetSelect = choose([["", "preset …"], ...plainly(Object.keys(setup.presets))], () => {
      const preset = setup.presets[presetSelect.value];
      if (!preset) return;
      // Keeps the fields that change only the look, but enables the bloom.
      const { defaults } = setup.methods[preset.method];
      const look = setup.look.filter((name) => name !== "bloom" && preset[name] === defaults[name]);
      const kept = Object.fromEntries(look.map((name) => [name, settings[editing][name]]));
      use({ ...preset, ...kept }, AUTOMATIC);
      showPreset(presetSelect.value);
    });
    for (const option of presetSelect.options) option.title = setup.descriptions[option.value] ?? "";
    presetSelect.ariaLabel = "preset";
    methodSelect = choose(plainly(Object.keys(setup.methods)), () => {
      const carried = setup.look.map((name) => [name, settings[editing][name]]);
      showPreset("");
      const { defaults } = setup.methods[methodSelect.value];
      use({ ...defaults, ...Object.fromEntries(carried) }, AUTOMATIC);
    });
    sideSelect = choose(
      [
        ["a", "A, left"],
        ["b", "B, right"],
      ],
      () => edit(sideSelect.value),
    );
    sideSelect.ariaLabel = "side that is set";
    const swap = make("button", { type: "button", textContent: "Swap" });
    swap.addEventListener("click", () => {
      [settings.a, settings.b] = [settings.b, settings.a];
      [expand.a, expand.b] = [expand.b, expand.a];
      buildFields();
      request(...SIDES);
    });
    const compareBox = make("input", { type: "checkbox" });
    compareBox.addEventListener("input", () => {
      comparing = compareBox.checked;
      sideSelect.disabled = swap.disabled = !comparing;
      if (comparing) outdated.add("b");
      else if (editing === "b") edit("a");
      draw();
      request();
      keep();
      showReadout();
      showMoment();
    });
    compareBox.checked = comparing;
    sideSelect.value = editing;
    sideSelect.disabled = swap.disabled = !comparing;
    const pictures = setup.stored?.sources ?? [];
    const sourceSelect = choose(plainly(pictures), () =>
      send({ kind: "open", view, name: sourceSelect.value }),
    );
    sourceSelect.value = setup.name;
    head.replaceChildren(
      ...(pictures.length > 1 ? [make("label", {}, "picture ", sourceSelect)] : []),
      make("label", {}, "method ", methodSelect),
      presetSelect,
      make("label", {}, compareBox, " wipe A | B"),
      sideSelect,
      swap,
    );
  }

  // Settings of a preset, a method or a file, and what they expand a photograph to, if they say it.
  function use(fields, expanded) {
    settings[editing] = { ...fields };
    if (setup.expand && expanded !== undefined) expand[editing] = expanded;
    buildFields({ keepPreset: true });
    request(editing);
  }

  // The preset whose values settings have, but for those that only change the look; "": none.
  function presetOf(shown) {
    const has = (preset) =>
      preset.method === shown.method &&
      Object.entries(preset).every(
        ([name, value]) => setup.look.includes(name) || JSON.stringify(value) === JSON.stringify(shown[name]),
      );
    return Object.keys(setup.presets).find((name) => has(setup.presets[name])) ?? "";
  }

  function showPreset(name) {
    presetSelect.value = name;
    presetSelect.title = setup.descriptions[name] ?? "";
  }

  function edit(side) {
    editing = sideSelect.value = side;
    buildFields();
    showError();
    code.textContent = shown[side]?.code ?? "";
    showPlan();
  }

  // A labelled control. `change` puts a value into the settings.
  function fieldRow(field, value, change) {
    const [parts, show, first] = control(field, (next) => {
      change(next);
      touched = first;
      showPreset(presetOf(settings[editing]));
      request(editing);
    });
    show(value);
    first.dataset.field = field.name;
    const words = field.label ?? field.name.split(".").at(-1).replaceAll("_", " ");
    const text = make("span", { textContent: words });
    const row = make("label", { className: `vkb-field vkb-${field.kind}`, title: field.help });
    row.append(text, make("span", { className: "vkb-parts" }, ...parts));
    return row;
  }

  // The choice of a convolution's function, and its parameters. Functions without controls, which
  // hold arrays, are shown by name. Objects of presets are copied, not changed.
  function functionRows(own) {
    const known = setup.functions;
    const choices = Object.keys(known);
    if (!(own.psf in known)) choices.unshift(own.psf);
    const kind = { name: "psf", kind: "choice", choices, help: "the point-spread function" };
    const choice = fieldRow(kind, own.psf, (name) => {
      settings[editing].psf = known[name]?.defaults ?? own;
      buildFields();
      fields.querySelector('[data-field="psf"]').focus();
    });
    const parameters = (known[own.psf]?.fields ?? []).map((field) => {
      const path = field.name.split(".");
      const value = path.reduce((object, key) => object?.[key], own);
      // A mask of numbers has no blades.
      if (value === undefined) return null;
      return fieldRow(field, value, (next) => {
        const now = settings[editing].psf;
        const [key, inner] = path;
        const changed = inner ? { ...now[key], [inner]: next } : next;
        settings[editing].psf = { ...now, [key]: changed };
      });
    });
    return [choice, ...parameters.filter((row) => row !== null)];
  }

  // The choice of stages of glare, also of one more, and the numbers of each. Objects of presets are
  // copied, not changed.
  function glareRows(field, own) {
    const { stages, presets } = setup.glare;
    const take = (next) => {
      settings[editing].glare = next;
      buildFields();
      fields.querySelector(`[data-field="${field.name}"]`).focus();
    };
    const same = (name) => JSON.stringify(presets[name]) === JSON.stringify(own);
    const name = own.length ? (field.choices.find(same) ?? "own") : null;
    const choices = name === "own" ? ["own", ...field.choices] : field.choices;
    const choice = fieldRow({ ...field, choices }, name, (next) => {
      if (next !== "own") take(next ? presets[next] : []);
    });
    const more = { name: "glare.more", label: "more glare", kind: "choice", optional: true };
    const adding = fieldRow(
      { ...more, none: "none", choices: Object.keys(stages), help: "Adds a stage" },
      null,
      (next) => next && take([...own, stages[next].defaults]),
    );
    const numbers = own.flatMap((stage, place) =>
      stages[stage.stage].fields.map((one) => {
        const label = `${stage.stage}: ${one.name.replaceAll("_", " ")}`;
        const row = { ...one, label, name: `glare.${place}.${one.name}` };
        return fieldRow(row, stage[one.name], (value) => {
          const now = [...settings[editing].glare];
          now[place] = { ...now[place], [one.name]: value };
          settings[editing].glare = now;
        });
      }),
    );
    return [choice, ...numbers, adding];
  }

  // What the highlights of a photograph are expanded up to.
  let showExpansion = () => {};
  function expansionRow() {
    const field = { name: "expand", kind: "number", optional: true, from: 1, to: 16, step: 0.5 };
    const help = "What the highlights of the photograph are expanded up to, so that they can glow";
    const row = fieldRow({ ...field, low: 1, high: 1024, help }, null, (value) => {
      expand[editing] = value;
    });
    const [on, ...numbers] = row.querySelectorAll("input");
    showExpansion = () => {
      const value = expand[editing];
      on.checked = value > 1;
      for (const input of numbers) {
        input.disabled = !on.checked || Boolean(setup.stored);
        input.value = on.checked ? value : 4;
      }
    };
    showExpansion();
    return row;
  }

  function buildFields({ keepPreset = false } = {}) {
    const wasOpen = fields.querySelector("details")?.open ?? false;
    if (!keepPreset) showPreset(presetOf(settings[editing]));
    const current = settings[editing];
    methodSelect.value = current.method;
    const rows = { true: [], false: [] };
    for (const field of setup.methods[current.method].fields) {
      if (field.name === "glare") {
        rows[field.first].push(...glareRows(field, current.glare));
        continue;
      }
      const row = fieldRow(field, current[field.name], (value) => {
        settings[editing][field.name] = value;
      });
      rows[field.first].push(row);
    }
    if (setup.expand) rows.true.push(expansionRow());
    // After the switch of the bloom.
    if (current.psf) rows.true.splice(1, 0, ...functionRows(current.psf));
    fields.replaceChildren(
      ...rows.true,
      make("details", { open: wasOpen }, make("summary", { textContent: "More" }), ...rows.false),
    );
    const known = setup.methods[current.method].fields;
    const stored = new Set(known.filter((field) => field.stored).map((field) => field.name));
    for (const row of fields.querySelectorAll(".vkb-field")) {
      if (!stored.has(row.querySelector("[data-field]").dataset.field)) lock(row);
    }
  }

  // --- size -----------------------------------------------------------------------------------

  function measure() {
    if (!setup) return;
    const [width, height] = setup.source_size;
    const highest = layout.clientWidth < NARROW ? MAX_HEIGHT_NARROW : MAX_HEIGHT;
    const room = [seen.clientWidth, Math.max(160, highest * window.innerHeight)];
    const scale = Math.min(room[0] / width, room[1] / height);
    const next = [Math.floor(width * scale), Math.floor(height * scale)].map((side) =>
      Math.max(1, side),
    );
    if (room[0] < 1 || (next[0] === box[0] && next[1] === box[1])) return;
    // A zoomed picture keeps its size on the screen.
    const kept = zoom === 1 || !shown.a ? 0 : zoom * fitting();
    box = next;
    if (kept) zoom = kept / fitting();
    place();
    drawCurve();
    if (!isSourceSize || !shown.a) {
      request(...visible());
    }
  }
  document.addEventListener("visibilitychange", fillCurve);
  const observer = new ResizeObserver(measure);
  observer.observe(seen);

  send({ kind: "setup", view });
  showReadout();

  return {
    receive,
    fail,
    unmount() {
      pause();
      clearTimeout(watching);
      observer.disconnect();
      document.removeEventListener("visibilitychange", fillCurve);
      root.remove();
    },
  };
}

// Some hosts do not transport binary buffers: there, files and pictures are text.
const encoded = (bytes) => {
  let text = "";
  for (let i = 0; i < bytes.length; i += 0x8000) {
    text += String.fromCharCode(...bytes.subarray(i, i + 0x8000));
  }
  return btoa(text);
};
const decoded = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));

export default {
  render({ model, el }) {
    let text = false;
    let last = null;
    const send = (message, files = []) => {
      if (["frame", "save"].includes(message.kind)) last = [message, files];
      if (text) model.send({ ...message, text, files: files.map(encoded) });
      else model.send(message, undefined, files);
      if (message.kind !== "frame") return;
      // Cells of a notebook react to the settings as traits.
      const traits = { a: "settings", b: "against" };
      for (const side of Object.keys(message.sides)) model.set(traits[side], message.sides[side]);
      model.save_changes();
    };
    const receive = (message, buffers) => {
      const pictures = message.pictures ? message.pictures.map(decoded) : (buffers ?? []);
      if ((message.count ?? 0) > pictures.length) {
        text = true;
        send(...last);
      } else page.receive(message, pictures);
    };
    const page = mount(el, send);
    model.on("msg:custom", receive);
    // marimo's theme, which the style sheet does not reach.
    const follow = () => (el.style.colorScheme = document.body.dataset.theme ?? "");
    const themes = new MutationObserver(follow);
    themes.observe(document.body, { attributeFilter: ["data-theme"] });
    follow();
    return () => {
      themes.disconnect();
      model.off("msg:custom", receive);
      page.unmount();
    };
  },
};
