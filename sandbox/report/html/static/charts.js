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
