// SPDX-License-Identifier: Apache-2.0
// Numbers as text.

/** "7.3 × 10⁻⁵" for "7.3e-5". */
function power_of_ten(text) {
  const [mantissa, exponent] = text.split("e");
  const raised = (c) => "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"["-0123456789".indexOf(c)];
  return `${mantissa} × 10${exponent.replace("+", "").replace(/[-\d]/g, raised)}`;
}

/** `value` with `digits` significant digits; powers of ten only where plain digits would be long. */
function significant(value, digits = 3) {
  if (!Number.isFinite(value)) return Number.isNaN(value) ? "nan" : value > 0 ? "inf" : "−inf";
  if (value === 0) return "0";
  const size = Math.abs(value);
  const text = size < 1e-4 || size >= 1e7 ? power_of_ten(value.toExponential(digits - 1))
    : size >= 10 ** digits ? String(Math.round(value)) : value.toPrecision(digits);
  return text.replace(/-/g, "−");
}

/** The same without zeros at the end of the fraction. */
const short_text = (value, digits) =>
  significant(value, digits).replace(/(\.\d*?)0+(?= |$)/, "$1").replace(/\.(?= |$)/, "");

function seconds_text(value, digits) {
  if (value >= 3600) return `${significant(value / 3600, digits)} h`;
  if (value >= 120) return `${significant(value / 60, digits)} min`;
  return `${significant(value, digits)} s`;
}

function bytes_text(value, digits) {
  const units = ["B", "kB", "MB", "GB", "TB"];
  let unit = 0;
  while (value >= 1000 && unit + 1 < units.length) value /= 1000, unit++;
  return `${significant(value, digits)} ${units[unit]}`;
}

/** A number of a table's column; a percent is given as a fraction. */
function number_text(value, column) {
  const digits = column.digits ?? 3;
  switch (column.kind) {
    case "ratio": return `${significant(value, digits)}×`;
    case "percent": return `${significant(value * 100, digits)} %`;
    case "seconds": return seconds_text(value, digits);
    case "bytes": return bytes_text(value, digits);
    default: return column.digits === undefined && Number.isInteger(value) && Math.abs(value) < 1e7
      ? String(value).replace("-", "−") : significant(value, digits);
  }
}

/** "+2.5 %": a fraction with its sign. */
const percent_text = (value, digits = 3) => `${value > 0 ? "+" : ""}${significant(value * 100, digits)} %`;

/** "+1.5", "0", "−2": stops of exposure. */
const stops_text = (stops) => (stops > 0 ? "+" : stops < 0 ? "−" : "") + String(Math.abs(stops));
