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

function best_value(rows, column) {
  const values = rows.map((row) => cell_value(row[column.key])).filter((v) => Number.isFinite(v));
  if (!column.better || values.length < 2) return null;
  return column.better === "low" ? Math.min(...values) : Math.max(...values);
}

function table_cell(cell, column, best) {
  const value = cell_value(cell), more = cell !== null && typeof cell === "object" ? cell : {};
  const is_text = column.kind === "text";
  if (value === null) return el("td", { class: is_text ? null : "number" }, el("span", { class: "missing", title: "no value" }, "–"), note_of(more));
  const text = is_text ? String(value) : number_text(value, column);
  const shown = more.link ? el("a", { href: more.link }, text) : text;
  const interval = Number.isFinite(more.low) && Number.isFinite(more.high)
    ? el("small", { class: "interval" }, `${number_text(more.low, column)} … ${number_text(more.high, column)}`) : null;
  const is_best = best !== null && value === best;
  return el(column.row_head ? "th" : "td", { class: is_text ? null : "number", scope: column.row_head ? "row" : null },
    is_best ? el("strong", { class: "best", title: "best of its column" }, shown) : shown, interval, note_of(more));
}

const note_of = (cell) => (cell.note ? el("small", { class: "note" }, cell.note) : null);

function draw_table(block) {
  const columns = block.columns.map((column, i) => ({ ...column, row_head: i === 0 }));
  const best = columns.map((column) => best_value(block.rows, column));
  const body = el("tbody");
  let sorted_by = null, descending = false;
  const heads = columns.map((column) => {
    const head = el("th", { scope: "col", class: column.kind === "text" ? null : "number" },
      el("button", { type: "button", click: () => sort(column) }, column.title,
        column.unit ? el("span", { class: "unit" }, ` ${column.unit}`) : null));
    return head;
  });
  const fill = (rows) => body.replaceChildren(...rows.map((row) =>
    el("tr", {}, columns.map((column, i) => table_cell(row[column.key] ?? null, column, best[i])))));
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
    el("table", {}, block.caption ? el("caption", {}, block.caption) : null, el("thead", {}, el("tr", {}, heads)), body));
}
