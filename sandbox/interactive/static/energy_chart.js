const ENERGY_SECONDS = 10; // of real time, shown in the chart
const MAX_SAMPLES = 1500;

/* Kinetic, potential and total energy over the last seconds. */
class EnergyChart {
  constructor(canvas) {
    this.canvas = canvas;
    this.samples = [];
    this.seconds = ENERGY_SECONDS; // simulated
  }

  add(time, energy) {
    const last = this.samples.at(-1);
    if (last && time < last[0]) this.samples = [];
    if (energy === null || (last && time === last[0] && this.samples.length)) return;
    this.samples.push([time, energy[0], energy[1], energy[0] + energy[1]]);
    while (this.samples.length > MAX_SAMPLES || time - this.samples[0][0] > this.seconds) this.samples.shift();
  }

  paint(colours, ratio) {
    const { canvas, samples } = this;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    if (!width) return;
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
    const context = canvas.getContext("2d");
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, width, height);
    const values = samples.flatMap((sample) => sample.slice(1));
    let [low, high] = [Math.min(0, ...values), Math.max(0, ...values)];
    if (high - low < 1e-12) high = low + 1;
    const [top, bottom, right] = [8, height - 8, width - 4];
    const toY = (value) => bottom - ((value - low) / (high - low)) * (bottom - top);
    context.font = `11px ${colours.font}`;
    const rough = (high - low) / 3;
    const power = 10 ** Math.floor(Math.log10(rough));
    const step = [1, 2, 5, 10].find((each) => each * power >= rough) * power;
    const ticks = [];
    for (let k = Math.ceil(low / step); k * step <= high + 1e-9 * step; k += 1) ticks.push(k * step);
    const left = 6 + Math.max(...ticks.map((tick) => context.measureText(formatNumber(tick, "J")).width));
    context.textAlign = "right";
    context.textBaseline = "middle";
    context.lineWidth = 1;
    for (const tick of ticks) {
      const y = Math.round(toY(tick)) + 0.5;
      context.strokeStyle = tick === 0 ? colours.soft : colours.rule;
      context.beginPath();
      context.moveTo(left, y);
      context.lineTo(right, y);
      context.stroke();
      context.fillStyle = colours.soft;
      context.fillText(formatNumber(tick, "J"), left - 6, y);
    }
    if (!samples.length) return;
    const begin = Math.max(samples[0][0], samples.at(-1)[0] - this.seconds);
    const toX = (time) => left + ((time - begin) / this.seconds) * (right - left);
    for (const [k, colour] of [[1, colours.e3], [2, colours.e4], [3, colours.ink]]) {
      context.strokeStyle = colour;
      context.lineWidth = k === 3 ? 1.2 : 1.8;
      context.beginPath();
      for (const sample of samples) context.lineTo(toX(sample[0]), toY(sample[k]));
      context.stroke();
    }
  }
}
