/* A number to three digits with its unit, as in the tables. */
function formatNumber(value, unit) {
  if (value === null || value === undefined) return "–";
  if (value === 0) return `0 ${unit}`;
  const power = Math.floor(Math.log10(Math.abs(value)) + 1e-12);
  if (power >= -3 && power < 3) return `${Number(value.toPrecision(3))} ${unit}`;
  if (power >= 3 && power < 6) return `${Number(value.toPrecision(3)).toLocaleString("en")} ${unit}`;
  const raised = String(power).replace(/[-0-9]/g, (sign) => (sign === "-" ? "⁻" : "⁰¹²³⁴⁵⁶⁷⁸⁹"[Number(sign)]));
  return `${Number((value / 10 ** power).toPrecision(3))}×10${raised} ${unit}`;
}
