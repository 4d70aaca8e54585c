"use strict";

/* The time that a replay and the charts beside it share. */
class TimeCursor {
  constructor(duration) {
    this.duration = duration;
    this.time = 0;
    this.listeners = [];
  }

  listen(listener) {
    this.listeners.push(listener);
    listener(this.time);
  }

  set(time) {
    this.time = Math.min(Math.max(time, 0), this.duration);
    for (const listener of this.listeners) listener(this.time);
  }
}

/* Show the shared time as the cursor of a chart, and set it where the chart is clicked or dragged. */
function linkChart(chart, clock, onGrab) {
  const left = Number(chart.dataset.left);
  const right = Number(chart.dataset.right);
  const width = Number(chart.dataset.width);
  const duration = Number(chart.dataset.duration);
  const cursor = chart.querySelector(".cursor");
  clock.listen((time) => {
    const x = (left + (time / duration) * (right - left)).toFixed(2);
    cursor.setAttribute("x1", x);
    cursor.setAttribute("x2", x);
    chart.dataset.time = String(time);
  });
  const scrub = (event) => {
    const box = chart.getBoundingClientRect();
    const x = ((event.clientX - box.left) / box.width) * width;
    clock.set(((x - left) / (right - left)) * duration);
  };
  let dragged = false;
  chart.addEventListener("pointerdown", (event) => {
    if (event.button !== 0) return;
    dragged = true;
    chart.setPointerCapture(event.pointerId);
    onGrab();
    scrub(event);
    event.preventDefault();
  });
  chart.addEventListener("pointermove", (event) => {
    if (dragged) scrub(event);
  });
  for (const end of ["pointerup", "pointercancel"]) {
    chart.addEventListener(end, () => {
      dragged = false;
    });
  }
}

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

/* Points of a trade-off: the settings of the selected one are shown and can be copied. */
class Points {
  constructor(place) {
    this.place = place;
    this.facts = JSON.parse(place.querySelector("script.facts").textContent);
    this.marks = [...place.querySelectorAll("[data-point]")];
    for (const mark of this.marks) {
      mark.addEventListener("click", () => this.choose(mark));
      mark.addEventListener("keydown", (event) => this.press(event, mark));
    }
    this.copy = place.querySelector(".copy");
    this.copy.addEventListener("click", () => this.copySettings());
    const first = this.marks.find((mark) => mark.querySelector(".best")) || this.front()[0];
    if (first) this.choose(first);
  }

  /* The points of the front by increasing cost. */
  front() {
    const cost = (mark) => Number(mark.querySelector(".hit-area").getAttribute("cx"));
    return this.marks.filter((mark) => "front" in mark.dataset).sort((a, b) => cost(a) - cost(b));
  }

  press(event, mark) {
    if (event.key === "Enter" || event.key === " ") this.choose(mark);
    else if (event.key === "ArrowRight" || event.key === "ArrowLeft") {
      const front = this.front();
      const next = front[front.indexOf(mark) + (event.key === "ArrowRight" ? 1 : -1)];
      if (next) {
        next.focus();
        this.choose(next);
      }
    } else return;
    event.preventDefault();
  }

  choose(mark) {
    for (const other of this.marks) other.toggleAttribute("data-chosen", other === mark);
    const { title, figures, text } = this.facts[Number(mark.dataset.point)];
    const aside = this.place.querySelector(".chosen");
    aside.querySelector(".what").textContent = title;
    aside.querySelector(".figures").replaceChildren(
      ...figures.flatMap(([name, value]) => {
        const [term, description] = [document.createElement("dt"), document.createElement("dd")];
        term.textContent = name;
        description.textContent = value;
        return [term, description];
      }),
    );
    aside.querySelector("code").textContent = text;
    aside.querySelector("pre").hidden = this.copy.hidden = false;
    this.copy.textContent = "Copy";
    this.place.dataset.chosen = mark.dataset.point;
  }

  /* Copy the settings; where that is not permitted, select them. */
  async copySettings() {
    const code = this.place.querySelector(".chosen code");
    try {
      await navigator.clipboard.writeText(`${code.textContent}\n`);
      this.copy.textContent = "Copied";
    } catch {
      const range = document.createRange();
      range.selectNodeContents(code);
      getSelection().removeAllRanges();
      getSelection().addRange(range);
      this.copy.textContent = "Selected: press Ctrl+C";
    }
  }
}

for (const place of document.querySelectorAll(".tradeoff")) new Points(place);
