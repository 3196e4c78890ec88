// SPDX-License-Identifier: Apache-2.0
// Tables that sort by any column; the best value of a column is marked where the document says what is better.

const cell_value = (cell) => (cell !== null && typeof cell === "object" ? cell.value : cell) ?? null;

/** Rows in the order of a column; missing values last in both directions. */
function sorted_rows(rows, column, descending) {
  const sign = descending ? -1 : 1;
  return [...rows].sort((a, b) => {
    const x = cell_value(a[column.key]), y = cell_value(b[column.key]);
    if (x === null || y === null) return (x === null) - (y === null);
    return sign * (column.kind === "text" ? String(x).localeCompare(String(y), undefined, { numeric: true }) : x - y);
  });
}

/** The cells to mark in a column: the best value, or that of each group of rows with the same value of `within`. */
function best_cells(rows, column, within) {
  if (!column.better) return new Set();
  const groups = new Map();
  for (const row of rows) {
    const group = within ? cell_value(row[within]) : null, value = cell_value(row[column.key]);
    if (Number.isFinite(value)) groups.set(group, [...(groups.get(group) ?? []), { row, value }]);
  }
  const marked = new Set();
  for (const cells of groups.values()) {
    const values = cells.map((cell) => cell.value);
    const best = column.better === "low" ? Math.min(...values) : Math.max(...values);
    if (cells.length > 1) cells.filter((cell) => cell.value === best).forEach((cell) => marked.add(cell.row));
  }
  return marked;
}

function table_cell(cell, column, is_best) {
  const value = cell_value(cell), more = cell !== null && typeof cell === "object" ? cell : {};
  const is_text = column.kind === "text";
  const none = el("span", { class: "missing", title: "no value" }, "–");
  if (value === null) return el("td", { class: is_text ? null : "number" }, none, note_of(more));
  const text = is_text ? String(value) : number_text(value, column);
  const shown = more.link ? el("a", { href: more.link }, text) : text;
  const interval = Number.isFinite(more.low) && Number.isFinite(more.high)
    ? el("small", { class: "interval" }, `${number_text(more.low, column)} … ${number_text(more.high, column)}`) : null;
  return el(column.row_head ? "th" : "td", { class: is_text ? null : "number", scope: column.row_head ? "row" : null },
    is_best ? el("strong", { class: "best", title: "the best" }, shown) : shown, interval, note_of(more));
}

const note_of = (cell) => (cell.note ? el("small", { class: "note" }, cell.note) : null);

function draw_table(block) {
  const columns = block.columns.map((column, i) => ({ ...column, row_head: i === 0 }));
  const best = columns.map((column) => best_cells(block.rows, column, block.best_within));
  const body = el("tbody");
  let sorted_by = null, descending = false;
  const heads = columns.map((column) => {
    const head = el("th", { scope: "col", class: column.kind === "text" ? null : "number" },
      el("button", { type: "button", click: () => sort(column) }, column.title,
        column.unit ? el("span", { class: "unit" }, ` ${column.unit}`) : null));
    return head;
  });
  const fill = (rows) => body.replaceChildren(...rows.map((row) =>
    el("tr", {}, columns.map((column, i) => table_cell(row[column.key] ?? null, column, best[i].has(row))))));
  const sort = (column) => {
    descending = sorted_by === column ? !descending : column.better === "high";
    sorted_by = column;
    heads.forEach((head, i) => {
      if (columns[i] === column) head.setAttribute("aria-sort", descending ? "descending" : "ascending");
      else head.removeAttribute("aria-sort");
    });
    fill(sorted_rows(block.rows, column, descending));
  };
  fill(block.rows);
  return el("figure", { class: "table", tabindex: "0", role: "region", "aria-label": block.caption ?? "Table" },
    el("table", {}, block.caption ? el("caption", {}, block.caption) : null, el("thead", {}, el("tr", {}, heads)),
      body));
}
