// SPDX-License-Identifier: Apache-2.0
// Links into the page: #view=COMPARER/SCENE/IMAGE A/IMAGE B&layout=…&mode=…&zoom=…&x=…&y=…; docs/report.md lists all.
// Each part may be left out.

const LINK_NUMBERS = ["exposure", "gain", "zoom", "x", "y", "split", "histogram"];
const LINK_WORDS = { layout: ["single", "split", "grid"], mode: Object.keys(VIEWS), tone: Object.keys(TONES) };
const LINK_TEXTS = ["layer", "insets"];

/** What a link says, {comparer, scene, a, b, …} with what it leaves out missing; null for other links. */
function parse_link(hash) {
  const parameters = new Map(hash.replace(/^#/, "").split("&").map((part) => part.split("=", 2)));
  const decode = (text) => { try { return decodeURIComponent(text); } catch { return text; } };
  const names = ["view", ...LINK_NUMBERS, ...Object.keys(LINK_WORDS), ...LINK_TEXTS];
  if (!names.some((name) => parameters.get(name))) return null;
  const [comparer, scene, a, b] = parameters.get("view")?.split("/").map(decode) ?? [];
  const link = { comparer, scene, a, b };
  for (const [name, words] of Object.entries(LINK_WORDS))
    if (words.includes(parameters.get(name))) link[name] = parameters.get(name);
  for (const name of LINK_NUMBERS) {
    const number = parameters.has(name) ? Number(parameters.get(name)) : NaN;
    if (Number.isFinite(number)) link[name] = number;
  }
  if (parameters.has("layer")) link.layer = decode(parameters.get("layer"));
  if (parameters.has("insets"))
    link.insets = decode(parameters.get("insets")).split(";").map((text) => text.split(",").map(Number))
      .filter((r) => r.length === 4 && r.every(Number.isInteger)).map(([x, y, w, h]) => ({ x, y, w, h }));
  return link;
}

/** The hash of a state, complete: the same view opens whatever the page shows by itself. */
function format_link(link) {
  const names = [link.comparer, link.scene, link.a, link.b].map((name) => encodeURIComponent(name ?? ""));
  const parts = [`view=${names.join("/")}`, `layout=${link.layout}`, `mode=${link.mode}`];
  if (link.layer) parts.push(`layer=${encodeURIComponent(link.layer)}`);
  if (link.tone) parts.push(`tone=${link.tone}`);
  for (const name of LINK_NUMBERS)
    if (link[name] !== undefined && link[name] !== null) parts.push(`${name}=${Number(link[name].toPrecision(6))}`);
  if (link.insets) parts.push(`insets=${link.insets.map(({ x, y, w, h }) => [x, y, w, h].join(",")).join(";")}`);
  return "#" + parts.join("&");
}
