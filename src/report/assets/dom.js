// SPDX-License-Identifier: Apache-2.0
// Small helpers for building elements.

/** An element; attributes that are functions become event listeners, null and false ones are left out. */
function el(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (typeof value === "function") element.addEventListener(name, value);
    else if (value !== null && value !== undefined && value !== false) element.setAttribute(name, value);
  }
  element.append(...children.flat().filter((child) => child !== null && child !== undefined));
  return element;
}

/** Text with `code` between backticks, as nodes. */
const rich = (text) => text.split(/`([^`]+)`/).map((part, i) => (i % 2 ? el("code", {}, part) : part));

/** A row of buttons of which one is pressed. `choices`: [value, text, hint]. */
function segmented(label, choices, choose) {
  const buttons = choices.map(([value, text, hint]) =>
    el("button", { type: "button", title: hint, "data-value": value, click: () => choose(value) }, text));
  const group = el("div", { class: "segmented", role: "group", "aria-label": label }, buttons);
  const show = (current) => buttons.forEach((b) => b.setAttribute("aria-pressed", String(b.dataset.value === current)));
  return { group, buttons, show };
}

/** Offers `blob` as a file to save. */
function download(blob, name) {
  const link = el("a", { href: URL.createObjectURL(blob), download: name });
  document.body.append(link);
  link.click();
  link.remove();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}

/** A name that is good for a file. */
const file_name = (text) => text.normalize("NFKD").replace(/[^\w.-]+/g, "-").replace(/^-+|-+$/g, "").toLowerCase()
  || "image";

const clamp = (value, low, high) => Math.min(high, Math.max(low, value));
