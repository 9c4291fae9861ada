// The explorer's page: a picture, and the controls that change it. `mount` puts it into an element;
// a notebook's widget (the default export) and the page on its own (start.js) differ only in what
// carries the messages. vkbloom/explorer/viewer.py says what those are.

const TURNS_PER_SECOND = 0.25; // of the forward system's animation
const HIGHEST = 0.72; // of the window, that a picture takes
const SIDES = ["a", "b"];
// What stays when the method changes: how the picture is developed, not how it blooms.
const CARRIED = ["bloom", "tonemap", "exposure", "encoding", "dither", "dither_seed"];

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

function choose(names, listener, properties = {}) {
  const options = names.map(([value, text]) => make("option", { value, textContent: text }));
  return make("select", { ...properties, on: { change: listener } }, ...options);
}

const plainly = (names) => names.map((name) => [name, name]);

// A control of one field: an element to show, and a function that shows a value.
function control(field, changed) {
  if (field.kind === "bool") {
    const box = make("input", { type: "checkbox" });
    box.addEventListener("input", () => changed(box.checked));
    return [[box], (value) => (box.checked = value), box];
  }
  if (field.kind === "choice") {
    const names = plainly(field.choices);
    if (field.optional) names.unshift(["", "automatic"]);
    const select = choose(names, () => changed(select.value || null));
    return [[select], (value) => (select.value = value ?? ""), select];
  }
  const slider = make("input", { type: "range", min: field.from, max: field.to, step: field.step });
  const number = make("input", {
    type: "number",
    min: field.low,
    max: field.high,
    step: field.whole ? 1 : "any",
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
    // Pages that are neither local nor encrypted have no clipboard but this.
    const area = make("textarea", { value: text });
    document.body.append(area);
    area.select();
    document.execCommand("copy");
    area.remove();
  }
}

export function mount(parent, send) {
  const view = Math.random().toString(36).slice(2);
  const root = make("div", { className: "vkbloom" });
  root.dataset.lmSuppressShortcuts = "true"; // JupyterLab's: letters are for the inputs here
  parent.append(root);

  let setup; // the answer to "setup": controls, presets, source
  const settings = {}; // by side
  const shown = {}; // by side: picture, and what the answer says of it
  const errors = {};
  let editing = "a";
  let comparing = false;
  let wipe = 0.5;
  let framebuffer = "final";
  let time = 0;
  let playing = 0; // the request of the next animation frame, 0: paused
  let stops = 0;
  let ownSize = false;
  let pointer = null; // its place, 0..1 across and down

  let drawn = 0;
  let asked = 0;
  let waiting = 0; // the id of the frame that is under way, 0: none
  const sent = new Map(); // id to when, and where the pointer was
  const outdated = new Set();
  let probing = false;
  let probeAgain = false;
  let box = [0, 0]; // what the picture may take, in CSS pixels

  // The parts that stay; what depends on the setup is filled in by `build`.
  const canvas = make("canvas", { width: 1, height: 1, ariaLabel: "picture" });
  const divider = make("div", {
    className: "vkb-divider",
    tabIndex: 0,
    role: "slider",
    ariaLabel: "wipe between A, on the left, and B",
    ariaValueMin: "0",
    ariaValueMax: "100",
    hidden: true,
  });
  const stage = make("div", { className: "vkb-stage" }, canvas, divider);
  const readout = make("output", { className: "vkb-readout" });
  const bar = make("div", { className: "vkb-bar" });
  const status = make("div", { className: "vkb-status" });
  const look = make("div", { className: "vkb-look" }, stage, readout, bar, status);
  const head = make("div", { className: "vkb-head" });
  const fields = make("div", { className: "vkb-fields" });
  const complaint = make("div", { className: "vkb-error", role: "alert" });
  const code = make("code");
  const copying = make("button", { type: "button", textContent: "Copy as code" });
  const foot = make("div", { className: "vkb-foot" }, complaint, make("pre", {}, code), copying);
  const panel = make("div", { className: "vkb-panel" }, head, fields, foot);
  root.append(look, panel);

  const visible = () => (comparing ? SIDES : ["a"]);

  // --- asking ---------------------------------------------------------------------------------

  function request(...sides) {
    for (const side of sides) outdated.add(side);
    flush();
  }

  // One frame is under way at a time. What changes meanwhile is asked for when it has come, in the
  // state that it then has: the newest wins, and nothing queues.
  function flush() {
    const sides = visible().filter((side) => outdated.has(side));
    if (waiting || !sides.length || !setup || !box[0]) return;
    for (const side of sides) outdated.delete(side);
    waiting = ++asked;
    sent.set(waiting, { when: performance.now(), pointer });
    const ratio = window.devicePixelRatio || 1;
    send({
      kind: "frame",
      view,
      id: waiting,
      sides: Object.fromEntries(sides.map((side) => [side, settings[side]])),
      framebuffer,
      size: ownSize ? null : box.map((length) => Math.max(1, Math.round(length * ratio))),
      time,
      stops,
      at: pointer,
    });
  }

  function probe() {
    if (!pointer || !shown.a) return;
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
      flush();
      await showFrame(message, buffers);
    } else {
      waiting = 0;
      probing = false;
      fail(message.error);
    }
  }

  async function showFrame(message, buffers) {
    const sides = Object.entries(message.sides);
    const pictures = await Promise.all(
      sides.map(([, side]) =>
        "error" in side
          ? null
          : createImageBitmap(new Blob([buffers[side.picture]], { type: "image/png" }), {
              colorSpaceConversion: "none",
            }),
      ),
    );
    const began = sent.get(message.id);
    sent.delete(message.id);
    // Pictures may be decoded in another order than they came.
    if (message.id < drawn) return;
    drawn = message.id;
    sides.forEach(([side, facts], index) => {
      errors[side] = facts.error;
      if (!pictures[index]) return;
      shown[side]?.picture.close();
      shown[side] = { ...facts, picture: pictures[index] };
    });
    draw();
    showFacts(performance.now() - began.when);
    // The values that came with it are of where the pointer was.
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

  // Framebuffers keep their own aspect within the box, enlarged ones show their pixels.
  function place() {
    const scale = Math.min(box[0] / canvas.width, box[1] / canvas.height);
    const [width, height] = [canvas.width * scale, canvas.height * scale];
    stage.style.width = `${box[0]}px`;
    stage.style.height = `${box[1]}px`;
    canvas.style.width = `${width}px`;
    canvas.style.height = `${height}px`;
    canvas.style.left = `${(box[0] - width) / 2}px`;
    canvas.style.top = `${(box[1] - height) / 2}px`;
    canvas.style.imageRendering = scale * (window.devicePixelRatio || 1) > 1.5 ? "pixelated" : "auto";
    divider.hidden = !comparing;
    divider.style.left = `${(box[0] - width) / 2 + wipe * width}px`;
    divider.ariaValueNow = String(Math.round(100 * wipe));
  }

  function showFacts(roundTrip) {
    const { a } = shown;
    if (a) {
      const names = [...frameSelect.options].map((option) => option.value);
      if (names.join() !== a.names.join()) {
        frameSelect.replaceChildren(
          ...a.names.map((name) => make("option", { value: name, textContent: name })),
        );
      }
      // The settings may not have the framebuffer that was looked at.
      framebuffer = frameSelect.value = a.framebuffer;
      const passes = Object.entries(a.passes);
      const device = passes.reduce((sum, [, seconds]) => sum + 1e3 * seconds, 0);
      const ran = passes.length
        ? `${passes.map(([name]) => name).join(", ")}: ${device.toFixed(1)} ms`
        : "nothing had to run";
      status.textContent =
        `${setup.adapter} · ${a.size[0]} × ${a.size[1]} ${a.dtype} · ${ran} · ` +
        `${roundTrip.toFixed(0)} ms until shown`;
    }
    complaint.textContent = errors[editing] ?? "";
    code.textContent = shown[editing]?.code ?? "";
    showReadout();
  }

  function showReadout() {
    const lines = visible()
      .filter((side) => pointer && shown[side]?.probe)
      .map((side) => {
        const { x, y, values } = shown[side].probe;
        const name = comparing ? `${side.toUpperCase()} ` : "";
        return `${name}${shown[side].framebuffer}[${y}, ${x}] = ${values.join("  ")}`;
      });
    readout.textContent = lines.join("\n") || "Point at the picture to read its values.";
  }

  function fail(text) {
    pause();
    complaint.textContent = text;
    root.classList.add("vkb-failed");
  }

  // --- the pointer and the wipe ---------------------------------------------------------------

  canvas.addEventListener("pointermove", (event) => {
    const area = canvas.getBoundingClientRect();
    pointer = [
      clamp((event.clientX - area.left) / area.width, 0, 1),
      clamp((event.clientY - area.top) / area.height, 0, 1),
    ];
    probe();
  });
  canvas.addEventListener("pointerleave", () => {
    pointer = null;
    showReadout();
  });

  function wipeTo(share) {
    wipe = clamp(share, 0, 1);
    draw();
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

  copying.addEventListener("click", async () => {
    await copy(code.textContent);
    copying.textContent = "Copied";
    setTimeout(() => (copying.textContent = "Copy as code"), 1500);
  });

  // --- time -----------------------------------------------------------------------------------

  const timeSlider = make("input", { type: "range", min: 0, max: 1, step: 0.001, value: 0 });
  timeSlider.ariaLabel = "time, in turns";
  const playButton = make("button", { type: "button", textContent: "Play" });

  function goTo(moment) {
    time = moment;
    timeSlider.value = moment;
    request(...visible());
  }
  function play() {
    let before = performance.now();
    const step = (now) => {
      goTo((time + (Math.max(0, now - before) / 1e3) * TURNS_PER_SECOND) % 1);
      before = now;
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
  playButton.addEventListener("click", () => (playing ? pause() : play()));

  // --- controls -------------------------------------------------------------------------------

  const frameSelect = choose([["final", "final"]], () => {
    framebuffer = frameSelect.value;
    request(...visible());
  });
  let presetSelect, methodSelect, sideSelect;

  function build(message) {
    setup = message;
    for (const side of SIDES) settings[side] ??= setup.sides[side];
    const size = setup.own_size.join(" × ");
    const sizeSelect = choose(
      [
        ["shown", "as shown"],
        ["own", size],
      ],
      () => {
        ownSize = sizeSelect.value === "own";
        request(...visible());
      },
    );
    const exposure = make("input", { type: "number", min: -16, max: 16, step: 0.5, value: 0 });
    exposure.addEventListener("input", () => {
      if (Number.isNaN(exposure.valueAsNumber)) return;
      stops = clamp(exposure.valueAsNumber, -16, 16);
      request(...visible());
    });
    exposure.title = "Stops that floats are shown with; the framebuffer stays as it is";
    bar.replaceChildren(
      make("label", {}, "framebuffer ", frameSelect),
      make("label", {}, "size ", sizeSelect),
      make("label", {}, "view exposure ", exposure),
    );
    if (setup.animated) bar.append(make("span", { className: "vkb-time" }, playButton, timeSlider));

    presetSelect = choose([["", "preset …"], ...plainly(Object.keys(setup.presets))], () => {
      if (presetSelect.value) use(setup.presets[presetSelect.value]);
    });
    presetSelect.ariaLabel = "preset";
    methodSelect = choose(plainly(Object.keys(setup.methods)), () => {
      const carried = CARRIED.map((name) => [name, settings[editing][name]]);
      presetSelect.value = "";
      use({ ...setup.methods[methodSelect.value].defaults, ...Object.fromEntries(carried) });
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
      showReadout();
    });
    sideSelect.disabled = swap.disabled = true;
    head.replaceChildren(
      make("label", {}, "method ", methodSelect),
      presetSelect,
      make("label", {}, compareBox, " wipe A | B"),
      sideSelect,
      swap,
    );
    buildFields();
    measure();
  }

  function use(fields) {
    settings[editing] = { ...fields };
    buildFields({ keepPreset: true });
    request(editing);
  }

  function edit(side) {
    editing = sideSelect.value = side;
    buildFields();
    complaint.textContent = errors[side] ?? "";
    code.textContent = shown[side]?.code ?? "";
  }

  function buildFields({ keepPreset = false } = {}) {
    const wasOpen = fields.querySelector("details")?.open ?? false;
    if (!keepPreset) presetSelect.value = "";
    const current = settings[editing];
    methodSelect.value = current.method;
    const rows = { true: [], false: [] };
    for (const field of setup.methods[current.method].fields) {
      const [parts, show, first] = control(field, (value) => {
        settings[editing][field.name] = value;
        presetSelect.value = "";
        request(editing);
      });
      show(current[field.name]);
      first.dataset.field = field.name;
      const text = make("span", { textContent: field.name.replaceAll("_", " ") });
      const row = make("label", { className: `vkb-field vkb-${field.kind}`, title: field.help });
      row.append(text, make("span", { className: "vkb-parts" }, ...parts));
      rows[field.first].push(row);
    }
    fields.replaceChildren(
      ...rows.true,
      make("details", { open: wasOpen }, make("summary", { textContent: "More" }), ...rows.false),
    );
  }

  // --- size -----------------------------------------------------------------------------------

  function measure() {
    if (!setup) return;
    const [width, height] = setup.own_size;
    const room = [look.clientWidth, Math.max(160, HIGHEST * window.innerHeight)];
    const scale = Math.min(room[0] / width, room[1] / height);
    const next = [Math.floor(width * scale), Math.floor(height * scale)].map((side) =>
      Math.max(1, side),
    );
    if (room[0] < 1 || (next[0] === box[0] && next[1] === box[1])) return;
    box = next;
    place();
    if (!ownSize || !shown.a) {
      request(...visible());
    }
  }
  const observer = new ResizeObserver(measure);
  observer.observe(look);

  send({ kind: "setup", view });
  showReadout();

  return {
    receive,
    fail,
    unmount() {
      pause();
      observer.disconnect();
      root.remove();
    },
  };
}

export default {
  render({ model, el }) {
    const page = mount(el, (message) => model.send(message));
    model.on("msg:custom", page.receive);
    return () => {
      model.off("msg:custom", page.receive);
      page.unmount();
    };
  },
};
