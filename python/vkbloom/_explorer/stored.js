// A page of stored pictures: its messages are answered from a table in the page, without a server.
// stored.py writes the table, and the scripts of page.js and this file in one element, since a page
// that is opened as a file cannot import another file.

const table = JSON.parse(document.getElementById("stored").textContent);
const sourceNamed = (name) => table.sources.find((one) => one.source.name === name);

// The address names the picture, too, unless it is the first.
const kept = addressStore.read();
let current = sourceNamed(kept?.picture) ?? table.sources[0];
const store = {
  read: addressStore.read,
  write(state) {
    const picture = current === table.sources[0] ? {} : { picture: current.source.name };
    addressStore.write({ ...state, ...picture });
  },
  watch(listener) {
    addressStore.watch((state) => {
      const named = sourceNamed(state?.picture) ?? table.sources[0];
      if (named !== current) location.reload();
      else listener(state);
    });
  },
};

// The stored settings that are nearest to others of the same method.
function snap(fields) {
  const { defaults, axes } = current.grids[fields.method];
  const values = axes.map(([name, stored]) => [name, stored[nearestIndex(stored, fields[name])]]);
  return { ...defaults, ...Object.fromEntries(values), bloom: fields.bloom };
}

function sideOf(fields, framebuffer) {
  const { axes, on, off } = current.grids[fields.method];
  const { names: every, answers } = fields.bloom ? on : off;
  const steps = fields.bloom ? axes : [];
  const point = steps.reduce(
    (index, [name, stored]) => index * stored.length + nearestIndex(stored, fields[name]),
    0,
  );
  // Facts, code and picture of each framebuffer; -1 of one that this point lacks.
  const row = (name) => {
    const first = 3 * (point * every.length + every.indexOf(name));
    return answers.slice(first, first + 3);
  };
  const names = every.filter((name) => row(name)[0] >= 0);
  const [facts, code, picture] = row(names.includes(framebuffer) ? framebuffer : "final");
  const { plan, ...others } = table.facts[facts];
  return [{ ...others, names, plan: table.plans[plan], code: table.codes[code], passes: {} }, picture];
}

function answerFrame({ view, id, sides, framebuffer }) {
  const answered = Object.entries(sides).map(([side, fields]) => [side, ...sideOf(fields, framebuffer)]);
  const facts = answered.map(([side, shown], index) => [side, { ...shown, picture: index }]);
  const pictures = answered.map(([, , picture]) => table.pictures[picture]);
  return [{ kind: "frame", view, id, sides: Object.fromEntries(facts) }, pictures];
}

// The settings of both sides stay when another picture is selected.
function openSource({ view, name }, last) {
  current = sourceNamed(name);
  page.receive({ kind: "open", view, ...current.source }, []);
  const sides = Object.entries(last).filter(([, fields]) => fields.method in current.grids);
  const snapped = sides.map(([side, fields]) => [side, snap(fields)]);
  page.receive({ kind: "settings", view, sides: Object.fromEntries(snapped) }, []);
}

async function decode(address) {
  const image = new Image();
  image.src = address;
  await image.decode();
  return createImageBitmap(image, { colorSpaceConversion: "none" });
}

// The last settings of each side.
let last = {};
function send(message) {
  // As from a server, an answer comes after the caller has returned.
  queueMicrotask(() => {
    if (message.kind === "setup") {
      page.receive({ ...table.setup, ...current.source, kind: "setup", view: message.view }, []);
    } else if (message.kind === "open") openSource(message, last);
    else if (message.kind === "frame") {
      last = { ...last, ...structuredClone(message.sides) };
      page.receive(...answerFrame(message));
    }
  });
}

const page = mount(document.getElementById("explorer"), send, { store, heading: "h1", decode });
