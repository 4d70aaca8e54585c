/* An element with attributes and children. */
function element(tag, attributes = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  made.append(...children);
  return made;
}

function button(action, sign, about) {
  return element("button", { type: "button", "data-action": action, title: about, "aria-label": about }, sign);
}

/* One slider: its scale is linear or logarithmic, its values have three digits. */
class Slider {
  constructor({ key, low, high, is_log: isLog, is_whole: isWhole, unit }, onChange) {
    Object.assign(this, { key, low, high, isLog, isWhole, unit });
    this.output = element("output");
    const range = isWhole ? { min: low, max: high, step: 1 } : { min: 0, max: 200, step: 1 };
    this.input = element("input", { type: "range", ...range, "aria-label": key });
    this.root = element("label", { class: "slider" }, element("span", { class: "key" }, key), this.output, this.input);
    this.input.addEventListener("input", () => {
      const value = this.value();
      this.write(value);
      onChange(key, value);
    });
  }

  value() {
    if (this.isWhole) return Number(this.input.value);
    const fraction = this.input.value / 200;
    const exact = this.isLog ? this.low * (this.high / this.low) ** fraction : this.low + fraction * (this.high - this.low);
    return Math.min(Math.max(Number(exact.toPrecision(3)), this.low), this.high);
  }

  write(value) {
    const text = this.isWhole ? String(value) : formatNumber(value, this.unit).trim().replace("-", "−");
    this.output.textContent = text;
    this.input.setAttribute("aria-valuetext", text);
  }

  show(value) {
    if (this.input.matches(":active")) return;
    const fraction = this.isLog ? Math.log(value / this.low) / Math.log(this.high / this.low) : (value - this.low) / (this.high - this.low);
    this.input.value = this.isWhole ? value : 200 * fraction;
    this.write(value);
  }
}
