// SPDX-License-Identifier: Apache-2.0
// The live page: asks its server what there is, shows it in the comparer, and sends what buttons are for. It takes the
// place of a report's page.js and uses the scripts before it.

const POLL = 400;        // milliseconds between questions
const SILENCE = 4;       // unanswered questions in a row after which the page says so
const LEAST_REGION = 8;  // pixels of a region's side

set_error_colours(JSON.parse(document.getElementById("document").textContent).error_colours);

/** The images that the server has sent, all enlarged to the size of the whole. */
class LiveStore extends ImageStore {
  constructor() {
    super({});
    this.versions = new Map();
  }

  async load(id) {
    const image = this.loaded.get(id);
    if (!image) throw new Error("not there yet");
    return image;
  }

  /** Takes halves of an image with pixels of `stride` x `stride` of the whole. */
  put(id, { version, width, height, channels, stride }, halves, size) {
    const whole = stride === 1 ? halves : enlarged(halves, width, height, channels, stride, size);
    this.loaded.set(id, { id, width: size[0], height: size[1], channels, halves: whole });
    this.sizes[id] = [size[0], size[1], channels];
    this.versions.set(id, version);
  }

  drop(id) {
    this.loaded.delete(id);
    this.versions.delete(id);
  }
}

function enlarged(halves, width, height, channels, stride, [whole_width, whole_height]) {
  const whole = new Uint16Array(whole_width * whole_height * channels);
  for (let c = 0, i = 0; c < channels; c++)
    for (let y = 0; y < whole_height; y++) {
      const row = (c * height + Math.min(Math.floor(y / stride), height - 1)) * width;
      for (let x = 0; x < whole_width; x++, i++) whole[i] = halves[row + Math.min(Math.floor(x / stride), width - 1)];
    }
  return whole;
}

const store = new LiveStore();
const reader = crypto.getRandomValues(new Uint32Array(2)).join("-");
const live = { has: -1, state: {}, comparer: null, names: null, plotted: -1, failures: 0, over: false };

// ---- what the page has ----------------------------------------------------------------------------------------------

const button = (text, hint, click) => el("button", { type: "button", title: hint, click }, text);
const buttons = {
  stop: button("Stop and write", "Ends the render and writes the image of the samples so far", () => act("stop")),
  pause: button("Pause", "Waits, without losing anything", () => act(live.state.paused ? "go" : "pause")),
  more: button("More samples", "Twice as many samples per pixel", () => act("more")),
  raise: button("Raise the goal", "Half of the relMSE", () => act("raise")),
  region: button("This region first", "The part of the image that is in view gets its samples first",
    () => act("region", { region: live.state.region ? null : region_in_view() })),
};
const phase = el("p", { class: "phase", role: "status" });
const numbers = el("dl", { class: "numbers" });
const bar = el("progress", { max: 1, "aria-label": "Progress" });
const place = { comparer: el("div", { class: "part" }), plot: el("div", { class: "plots" }) };

function build() {
  for (const element of [bar, ...Object.values(buttons)]) element.hidden = true;  // until it is known what there is
  document.body.classList.add("plain", "live");
  document.getElementById("head").append(el("h1", {}, document.title), phase, bar, numbers,
    el("div", { class: "bar buttons", role: "group", "aria-label": "Render" }, Object.values(buttons)));
  document.getElementById("content").replaceChildren(place.comparer, place.plot);
}

/** The part of the image that is in view, in pixels of the frame. */
function region_in_view() {
  const { comparer, state } = live, { width, height } = comparer.size;
  const whole = { x: 0, y: 0, w: comparer.stage.clientWidth, h: comparer.stage.clientHeight };
  const low = comparer.viewport.to_image(whole, comparer.size, 0, 0);
  const high = comparer.viewport.to_image(whole, comparer.size, whole.w, whole.h);
  const x = clamp(Math.floor(low.x), 0, width - LEAST_REGION), y = clamp(Math.floor(low.y), 0, height - LEAST_REGION);
  const [left, top] = state.origin ?? [0, 0];
  return [left + x, top + y, clamp(Math.ceil(high.x) - x, LEAST_REGION, width - x),
    clamp(Math.ceil(high.y) - y, LEAST_REGION, height - y)];
}

// ---- the server -----------------------------------------------------------------------------------------------------

async function post(path, body) {
  const answer = await fetch(path, { method: "POST", body: JSON.stringify(body) });
  if (!answer.ok) throw new Error(await answer.text());
  return answer.json();
}

async function act(what, more = {}) {
  try { await post("act", { do: what, ...more }); } catch (error) { live.comparer?.readout.say(error.message); }
}

/** Fetches the images of a state that are newer than those here; true if there were any. */
async function fetch_images(state) {
  let changed = false;
  for (const id of [...store.versions.keys()]) if (!state.images[id]) store.drop(id), changed = true;
  for (const [id, info] of Object.entries(state.images)) {
    if (store.versions.get(id) === info.version) continue;
    const answer = await fetch(`image/${id}`);
    if (!answer.ok) continue;
    const halves = new Uint16Array(await answer.arrayBuffer());
    if (halves.length !== info.width * info.height * info.channels) continue;  // replaced meanwhile: asked again
    store.put(id, info, halves, info.size ?? state.size);
    changed = true;
  }
  return changed;
}

async function ask() {
  try {
    const state = await post("state", { reader, has: live.has });
    live.failures = 0;
    const changed = await fetch_images(state);
    live.has = Object.entries(state.images).every(([id, { version }]) => store.versions.get(id) === version)
      ? state.version : live.has;
    show(state, changed);
    live.over = Boolean(state.ended);
    if (live.over) await post("state", { reader, has: live.has }).catch(() => {});
    else setTimeout(ask, changed ? 0 : POLL);
  } catch {
    live.failures++;
    if (live.failures >= SILENCE) show_silence();
    setTimeout(ask, POLL);
  }
}

// ---- showing it -----------------------------------------------------------------------------------------------------

const rate_text = (value) => {
  const unit = value >= 1e6 ? [1e6, " M"] : value >= 1e3 ? [1e3, " k"] : [1, ""];
  return `${significant(value / unit[0], 3)}${unit[1]}`;
};

function time_text(seconds) {
  const s = Math.ceil(seconds), pad = (n) => String(n).padStart(2, "0");
  return s < 3600 ? `${Math.floor(s / 60)}:${pad(s % 60)}`
    : `${Math.floor(s / 3600)}:${pad(Math.floor(s / 60) % 60)}:${pad(s % 60)}`;
}

/** What to show of the numbers: [name, text]. */
function facts_of_state(state) {
  const facts = [], errors = state.errors ?? [];
  const last = errors.findLast((error) => error.of === "picture") ?? errors.at(-1);
  if (state.samples_per_pixel !== undefined)
    facts.push(["samples per pixel", significant(state.samples_per_pixel, 4) + (state.spp ? ` of ${state.spp}` : "")]);
  if (last)
    facts.push(["predicted relMSE", significant(last.relmse, 2) +
      (last.low !== undefined ? ` (${significant(last.low, 2)} to ${significant(last.high, 2)})` : "")]);
  if (state.until > 0) facts.push(["goal", `relMSE ${significant(state.until, 2)}`]);
  if (state.left >= 0 && !state.ended) facts.push(["time left", time_text(state.left)]);
  if (state.seconds !== undefined) facts.push(["time", time_text(state.seconds)]);
  if (state.samples_per_second > 0)
    facts.push(["samples per second", rate_text(state.samples_per_second)],
      ["rays per second", rate_text(state.rays_per_second)]);
  if (state.region) facts.push(["region", state.region.join(", ")]);
  return [...facts, ...(state.facts ?? [])];
}

function show(state, changed) {
  live.state = state;
  const text = state.ended ?? (state.paused ? "paused" : state.phase) ?? "";
  show_text(phase, [text, state.message].filter(Boolean).join("; "));
  const fraction = state.total > 0 ? state.done / state.total : null;
  bar.hidden = fraction === null || Boolean(state.ended);
  if (fraction !== null) bar.value = Math.min(fraction, 1);
  numbers.replaceChildren(...facts_of_state(state).map(([name, value]) =>
    el("div", {}, el("dt", {}, name), el("dd", {}, String(value)))));
  const can = state.ended ? {} : state.can ?? {};
  for (const [name, element] of Object.entries(buttons)) {
    element.hidden = !(name in (state.can ?? {})) && !state.ended || state.kind !== "render";
    element.disabled = !can[name] || (name === "region" && !live.comparer);
  }
  buttons.raise.disabled ||= !(state.until > 0 || (state.errors ?? []).length);
  show_text(buttons.pause, state.paused ? "Go on" : "Pause");
  buttons.region.setAttribute("aria-pressed", String(Boolean(state.region)));
  show_pictures(state, changed);
  show_errors(state);
}

/** Only changes that are changes: screen readers say them. */
function show_text(element, text) { if (element.textContent !== text) element.textContent = text; }

function show_silence() {
  const { resume } = live.state;
  phase.classList.add("lost");
  phase.replaceChildren("Nothing answers here any more: it has ended, or was killed. This is the last picture.",
    ...(resume ? [" This continues from what was saved: ", el("code", {}, resume)] : []));
  for (const element of Object.values(buttons)) element.disabled = true;
}

const record_of = ({ id, name, label }) => ({ name, image: id, label });

function show_pictures(state, changed) {
  const pictures = (state.pictures ?? []).filter(({ id }) => store.ready(id));
  if (!pictures.length) return;
  const names = JSON.stringify(pictures.map(({ id, name }) => [id, name, store.sizes[id]]));
  if (names !== live.names) {
    live.names = names;
    const link = live.comparer?.link();
    const scene = { name: document.title, images: pictures.map(record_of), insets: live.comparer?.insets ?? [] };
    if (live.comparer) Gestures.all.splice(Gestures.all.indexOf(live.comparer.gestures), 1);
    live.comparer = new Comparer({ id: "live", scenes: [scene] }, store, keep_link);
    place.comparer.replaceChildren(live.comparer.element);
    const opened = parse_link(link ?? location.hash);
    if (opened) live.comparer.open(opened);
    live.comparer.started = true;
  }
  const { comparer } = live, { painter, controls } = comparer;
  let differs = changed;
  for (const { id, name, label } of pictures) {
    const record = comparer.images.find((image) => image.image === id);
    differs ||= record.label !== label;
    record.label = label;
    const errors = `${id}:error`;
    record.layers = store.ready(errors) ? [{ name: "StdError", image: errors, display: "picture" }] : [];
  }
  if (!differs) return;
  painter.clear();
  painter.failures.clear();
  comparer.histograms.key = null;
  controls.shown_scene = null;
  comparer.update();
}

function keep_link(hash) {
  if (hash !== location.hash) history.replaceState(null, "", hash);
}

function show_errors({ errors = [], until = 0, pictures = [] }) {
  const drawn = errors.length + until;
  if (!errors.length || drawn === live.plotted) return;
  live.plotted = drawn;
  const series = [];
  for (const { id, name } of pictures) {
    const own = errors.filter((error) => error.of === id);
    if (own.length)
      series.push({ name, x: own.map((e) => e.seconds), y: own.map((e) => e.relmse), low: own.map((e) => e.low),
        high: own.map((e) => e.high) });
  }
  const times = errors.map((error) => error.seconds);
  if (until > 0)
    series.push({ name: "goal", x: [0, Math.max(...times)], y: [until, until], style: "dashed" });
  const open = place.plot.querySelector("details")?.open;
  place.plot.replaceChildren(draw_plot({
    title: "Predicted relMSE over time, with bounds that hold in 80 of 100 renders",
    x: { label: "seconds" }, y: { label: "relMSE", scale: "log" }, series }));
  if (open) place.plot.querySelector("details").open = true;
}

build();
ask();
