// SPDX-License-Identifier: Apache-2.0
// Builds the page from its document (docs/report.md) and follows links.

const report = JSON.parse(document.getElementById("document").textContent);
const store = new ImageStore(report.image_sizes);
const comparers = [];
set_error_colours(report.error_colours);

const NOTES_SHOWN = 5;

/** Errors are shown in full; of warnings and other notes the first ones, the others unfold. */
function draw_notes(block) {
  const names = { error: "Errors", warning: "Warnings", info: "Notes", result: "Result" };
  const shown = block.kind === "error" || block.items.length <= NOTES_SHOWN + 1 ? block.items.length : NOTES_SHOWN;
  const list = (items) => el("ul", {}, items.map((item) => el("li", {}, item)));
  const rest = block.items.slice(shown);
  return el("aside", { class: `notes ${block.kind}`, "aria-label": names[block.kind] },
    el("strong", {}, names[block.kind]), list(block.items.slice(0, shown)),
    rest.length ? el("details", {}, el("summary", {}, `${rest.length} more`), list(rest)) : null);
}

function draw_comparer(block) {
  const comparer = new Comparer(block, store, keep_link);
  comparers.push(comparer);
  return comparer.element;
}

const DRAW = { table: draw_table, plot: draw_plot, comparer: draw_comparer, notes: draw_notes };

const SIDE_BY_SIDE = { plot: "plots", table: "tables" };

/** Consecutive plots, and tables, stand side by side where there is room. */
function draw_blocks(blocks) {
  const elements = [];
  for (const block of blocks) {
    const element = DRAW[block.type](block), group = SIDE_BY_SIDE[block.type];
    if (!group) elements.push(element);
    else if (elements.at(-1)?.className === group) elements.at(-1).append(element);
    else elements.push(el("div", { class: group }, element));
  }
  return elements;
}

function draw_section(section) {
  return el("section", { class: "part", id: section.id }, section.heading ? el("h2", {}, section.heading) : null,
    (section.text ?? []).map((paragraph) => el("p", { class: "prose" }, rich(paragraph))),
    draw_blocks(section.blocks ?? []));
}

function draw_head() {
  const meta = Array.isArray(report.meta) ? report.meta : Object.entries(report.meta ?? {});
  const sections = (report.sections ?? []).filter((section) => section.heading);
  return [
    el("h1", {}, report.title), report.subtitle ? el("p", { class: "subtitle" }, rich(report.subtitle)) : "",
    meta.length ? el("dl", {}, meta.map(([key, value]) =>
      el("div", {}, el("dt", {}, key), el("dd", {}, String(value))))) : "",
    sections.length > 1 ? el("nav", { "aria-label": "Sections" },
      sections.map((s) => el("a", { href: `#${s.id}` }, s.heading))) : "",
  ].filter(Boolean);
}

/** Puts a link into the address bar, without an entry in the history. */
function keep_link(hash) {
  if (hash !== location.hash) history.replaceState(null, "", hash);
}

function follow_link() {
  const link = parse_link(location.hash);
  const comparer = link && (link.comparer === undefined ? comparers[0]
    : comparers.find((c) => c.block.id === link.comparer));
  if (!comparer) return;
  comparer.open(link);
  const { top } = comparer.element.getBoundingClientRect();
  if (top > MOST_LEAD * window.innerHeight) comparer.element.scrollIntoView({ block: "start" });
}

document.getElementById("head").append(...draw_head());
// A small title leaves the room to the images.
document.body.classList.toggle("plain", !report.subtitle && !report.meta);
document.getElementById("content").replaceChildren(...(report.sections ?? []).map(draw_section));
follow_link();
window.addEventListener("hashchange", follow_link);
comparers.forEach((comparer) => { comparer.started = true; });
