"use strict";

/* A clock that a replay and the charts beside it share. */
class Clock {
  constructor(duration) {
    this.duration = duration;
    this.time = 0;
    this.followers = [];
  }

  follow(follower) {
    this.followers.push(follower);
    follower(this.time);
  }

  set(time) {
    this.time = Math.min(Math.max(time, 0), this.duration);
    for (const follower of this.followers) follower(this.time);
  }
}

/* Let a chart show a clock's time by its cursor, and set it where one points. */
function link(chart, clock, held) {
  const left = Number(chart.dataset.left);
  const right = Number(chart.dataset.right);
  const width = Number(chart.dataset.width);
  const duration = Number(chart.dataset.duration);
  const cursor = chart.querySelector(".cursor");
  clock.follow((time) => {
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
    held();
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

/* A number to three digits with its unit, as the tables write it. */
function worded(value, unit) {
  if (value === null || value === undefined) return "–";
  if (value === 0) return `0 ${unit}`;
  const power = Math.floor(Math.log10(Math.abs(value)) + 1e-12);
  if (power >= -3 && power < 3) return `${Number(value.toPrecision(3))} ${unit}`;
  if (power >= 3 && power < 6) return `${Number(value.toPrecision(3)).toLocaleString("en")} ${unit}`;
  const raised = String(power).replace(/[-0-9]/g, (sign) => (sign === "-" ? "⁻" : "⁰¹²³⁴⁵⁶⁷⁸⁹"[Number(sign)]));
  return `${Number((value / 10 ** power).toPrecision(3))}×10${raised} ${unit}`;
}
