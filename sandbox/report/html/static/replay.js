/* The replay of one scene: engines on top of each other on a canvas, or on one canvas each, with the time cursor of the
   charts beside it. */
const MAX_PATHS = 8; // up to this number of bodies, the path of each is drawn
const REDUCED_MOTION = window.matchMedia("(prefers-reduced-motion: reduce)");
const DARK = window.matchMedia("(prefers-color-scheme: dark)");

/* Codes as `replay_data.py` compresses them: deflated bytes, low ones first, of second differences along frames. */
async function decompress(text, frames, width) {
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  const planes = new Uint8Array(await new Response(stream).arrayBuffer());
  const count = frames * width;
  const words = new Uint16Array(count);
  for (let k = 0; k < count; k += 1) words[k] = planes[k] | (planes[count + k] << 8);
  for (let k = 2 * width; k < count; k += 1) words[k] += words[k - width];
  for (let k = width; k < count; k += 1) words[k] += words[k - width];
  return words;
}

class Replay {
  constructor(figure, clock) {
    this.figure = figure;
    this.clock = clock;
    this.canvases = [...figure.querySelectorAll("canvas")];
    this.scene = JSON.parse(figure.querySelector("script.data").textContent);
    this.camera = new Camera(this.scene.view);
    this.hidden = new Set();
    this.speed = this.scene.speed;
    this.playing = false;
    this.ready = false;
    this.pose = new Float64Array(3 * this.scene.bodies);
    this.find = (action) => figure.querySelector(`[data-action="${action}"]`);
    this.scrub = figure.querySelector(".scrub");
    this.scrub.max = String(this.scene.duration);
    this.listen();
    clock.listen((time) => this.show(time));
    new ResizeObserver(() => this.resize()).observe(this.canvases[0]);
    // A replay far down a long page is decompressed once it is near.
    const near = new IntersectionObserver(
      (entries) => {
        if (!entries.some((entry) => entry.isIntersecting)) return;
        near.disconnect();
        this.load();
      },
      { rootMargin: "600px" },
    );
    near.observe(figure);
  }

  async load() {
    if (this.loading) return;
    this.loading = true;
    const width = this.scene.bodies * (this.scene.has_angles ? 3 : 2);
    try {
      for (const track of this.scene.tracks) {
        track.positions = await decompress(track.codes, this.scene.time.length, width);
        track.codes = null;
        track.hasAngles = this.scene.has_angles;
      }
    } catch (error) {
      if (!(error instanceof ReferenceError)) throw error;
      this.figure.querySelector(".status").textContent = "This browser is too old for the replay.";
      return;
    }
    this.ready = true;
    this.figure.dataset.ready = "true";
    this.draw();
  }

  listen() {
    const { figure } = this;
    const actions = {
      play: () => this.play(!this.playing),
      back: () => this.step(-1),
      on: () => this.step(1),
      nearer: () => this.zoom(1.25),
      farther: () => this.zoom(0.8),
      fit: () => this.fit(),
    };
    for (const [action, act] of Object.entries(actions)) this.find(action).addEventListener("click", act);
    this.scrub.addEventListener("input", () => {
      this.play(false);
      this.clock.set(Number(this.scrub.value));
    });
    figure.querySelector(".speed").addEventListener("change", (event) => {
      this.speed = Number(event.target.value);
    });
    this.boxes = [...figure.querySelectorAll("[data-track]")];
    for (const box of this.boxes) box.addEventListener("change", () => this.toggle(box.dataset.track, box.checked));
    const slider = figure.querySelector(".swept input");
    if (slider) {
      slider.addEventListener("input", () => this.select(this.scene.values[Number(slider.value)]));
      this.find("all").addEventListener("click", () => this.select(null));
      this.select(this.scene.values[Number(slider.value)]);
    }
    figure.addEventListener("keydown", (event) => this.press(event, actions));
    for (const canvas of this.canvases) this.listenTo(canvas);
    DARK.addEventListener("change", () => this.draw());
    window.addEventListener("beforeprint", () => this.drawFor("light"));
    window.addEventListener("afterprint", () => this.drawFor(null));
  }

  /* Zooming and panning on a canvas; all canvases share the camera. */
  listenTo(canvas) {
    const { figure, camera } = this;
    canvas.addEventListener(
      "wheel",
      (event) => {
        // The wheel scrolls the page unless the replay has the focus.
        if (!event.ctrlKey && !figure.contains(document.activeElement)) return;
        event.preventDefault();
        const box = canvas.getBoundingClientRect();
        this.zoom(Math.exp(-0.0015 * event.deltaY), event.clientX - box.left, event.clientY - box.top);
      },
      { passive: false },
    );
    canvas.addEventListener("pointerdown", (event) => {
      if (event.button !== 0) return;
      canvas.setPointerCapture(event.pointerId);
      this.dragged = [event.clientX, event.clientY];
    });
    canvas.addEventListener("pointermove", (event) => {
      if (!this.dragged) return;
      camera.pan(event.clientX - this.dragged[0], event.clientY - this.dragged[1]);
      this.dragged = [event.clientX, event.clientY];
      this.draw();
    });
    for (const end of ["pointerup", "pointercancel"]) {
      canvas.addEventListener(end, () => {
        this.dragged = null;
      });
    }
    canvas.addEventListener("dblclick", () => this.fit());
  }

  press(event, actions) {
    if (event.altKey || event.ctrlKey || event.metaKey) return;
    const on = event.target.matches.bind(event.target);
    const keys = {
      " ": actions.play,
      k: actions.play,
      ArrowLeft: actions.back,
      ArrowRight: actions.on,
      ",": actions.back,
      ".": actions.on,
      Home: () => this.seek(0),
      End: () => this.seek(this.scene.duration),
      "+": actions.nearer,
      "=": actions.nearer,
      "-": actions.farther,
      0: actions.fit,
    };
    if (!(event.key in keys) || on("select")) return;
    // These keys move the slider of the swept value if it has the focus.
    if (/^(Arrow|Home|End)/.test(event.key) && on(".swept input")) return;
    // Space activates a button or checkbox that has the focus.
    if (event.key === " " && on("button, input[type=checkbox]")) return;
    event.preventDefault();
    keys[event.key]();
  }

  play(on) {
    if (on === this.playing) return;
    this.playing = on;
    if (on) this.load();
    if (on && this.clock.time >= this.scene.duration) this.clock.set(0);
    const button = this.find("play");
    button.textContent = on ? "❚❚" : "▶";
    button.setAttribute("aria-pressed", String(on));
    this.figure.dataset.playing = String(on);
    this.last = null;
    if (on) requestAnimationFrame((now) => this.advance(now));
  }

  /* One cycle of the playing loop: the replay advances by the real time passed, times the speed. */
  advance(now) {
    if (!this.playing) return;
    const passed = this.last === null ? 0 : Math.min((now - this.last) / 1000, 0.1);
    this.last = now;
    let time = this.clock.time + passed * this.speed;
    if (time >= this.scene.duration) {
      if (REDUCED_MOTION.matches) {
        this.clock.set(this.scene.duration);
        this.play(false);
        return;
      }
      time = 0;
    }
    this.clock.set(time);
    requestAnimationFrame((next) => this.advance(next));
  }

  seek(time) {
    this.play(false);
    this.load();
    this.clock.set(time);
  }

  step(direction) {
    const { time } = this.scene;
    const [before, fraction] = this.between(this.clock.time);
    const here = before + fraction;
    const next = direction > 0 ? Math.floor(here + 1e-9) + 1 : Math.ceil(here - 1e-9) - 1;
    this.seek(time[Math.min(Math.max(next, 0), time.length - 1)]);
  }

  zoom(factor, x, y) {
    this.camera.zoom(factor, x, y);
    this.draw();
  }

  fit() {
    this.camera.fit();
    this.draw();
  }

  toggle(name, on) {
    if (on) this.hidden.delete(name);
    else this.hidden.add(name);
    const k = this.scene.tracks.findIndex((track) => track.name === name);
    const own = this.scene.tracks[k].css_class === "truth" ? "truth" : `run${k}`;
    for (const line of this.figure.parentElement.querySelectorAll(`svg.time .line.${own}`)) {
      line.toggleAttribute("data-off", !on);
    }
    this.draw();
  }

  /* Show the runs with this value of the swept key; null: all runs. */
  select(value) {
    if (value !== null) this.figure.querySelector("output.value").textContent = String(Number(value.toPrecision(6)));
    for (const [k, track] of this.scene.tracks.entries()) {
      const on = value === null || track.value === null || track.value === value;
      this.boxes[k].checked = on;
      this.toggle(track.name, on);
    }
  }

  /* The frame before a time, and the fraction of the interval to the next one. */
  between(at) {
    const { time } = this.scene;
    let [low, high] = [0, time.length - 1];
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (time[middle] <= at) low = middle;
      else high = middle;
    }
    if (high <= low) return [0, 0];
    return [low, Math.min(Math.max((at - time[low]) / (time[high] - time[low]), 0), 1)];
  }

  /* Write the poses of a track's bodies into `pose`, interpolated between two frames. */
  place(track, before, fraction) {
    const { bodies, has_angles: hasAngles, step, half, time } = this.scene;
    const each = hasAngles ? 3 : 2;
    const width = bodies * each;
    const after = Math.min(before + 1, time.length - 1);
    const { positions: words } = track;
    for (let n = 0; n < bodies; n += 1) {
      const [a, b] = [before * width + n * each, after * width + n * each];
      const late = fraction > 0 && words[b] !== 65535;
      if (words[a] === 65535) {
        this.pose[3 * n] = fraction === 1 && late ? words[b] * step - half : NaN;
        this.pose[3 * n + 1] = words[b + 1] * step - half;
        this.pose[3 * n + 2] = hasAngles ? (words[b + 2] * TURN) / 65536 : 0;
        continue;
      }
      const weight = late ? fraction : 0;
      this.pose[3 * n] = (words[a] + weight * (words[b] - words[a])) * step - half;
      this.pose[3 * n + 1] = (words[a + 1] + weight * (words[b + 1] - words[a + 1])) * step - half;
      if (!hasAngles) continue;
      const turn = ((words[b + 2] - words[a + 2] + 98304) % 65536) - 32768; // the smaller rotation
      this.pose[3 * n + 2] = ((words[a + 2] + weight * turn) * TURN) / 65536;
    }
  }

  show(time) {
    const { scene, figure } = this;
    const [before, fraction] = this.between(time);
    figure.dataset.time = String(time);
    figure.dataset.frame = String(Math.round(before + fraction));
    if (document.activeElement !== this.scrub || this.playing || Number(this.scrub.value) !== time) {
      this.scrub.value = String(time);
    }
    const digits = Math.max(0, Math.min(6, 3 - Math.floor(Math.log10(scene.duration))));
    figure.querySelector("output.time").textContent = `${time.toFixed(digits)} s`;
    for (const [k, track] of scene.tracks.entries()) {
      const output = this.boxes[k].closest("li").querySelector("output");
      if (output === null || track.errors === null) continue;
      output.textContent = formatNumber(track.errors[Math.round(before + fraction)], output.dataset.unit);
    }
    this.draw();
  }

  resize() {
    const ratio = window.devicePixelRatio || 1;
    const { clientWidth: width, clientHeight: height } = this.canvases[0];
    if (!width || !height) return;
    for (const canvas of this.canvases) {
      canvas.width = Math.round(width * ratio);
      canvas.height = Math.round(height * ratio);
    }
    this.ratio = ratio;
    this.camera.resize(width, height);
    this.paint();
  }

  drawFor(theme) {
    if (theme === null) delete document.documentElement.dataset.theme;
    else document.documentElement.dataset.theme = theme;
    this.paint();
  }

  /* Draw once before the next frame of the browser, however often it is requested. */
  draw() {
    if (this.isRequested) return;
    this.isRequested = true;
    requestAnimationFrame(() => this.paint());
  }

  paint() {
    this.isRequested = false;
    if (!this.ready || !this.ratio) return;
    const { scene, clock, figure } = this;
    const style = getComputedStyle(figure);
    const colours = { font: style.fontFamily };
    const names = ["sheet", "soft", "rule", "solid", "pocket", "e0", "e1", "e2", "e3", "e4", "e5", "truth", "bad"];
    for (const name of names) colours[name] = style.getPropertyValue(`--${name}`).trim();
    colours.edge = style.getPropertyValue("--solid-edge").trim();
    const shown = scene.tracks.filter((track) => !this.hidden.has(track.name));
    for (const [k, canvas] of this.canvases.entries()) {
      const names = scene.panes === null ? scene.tracks.map((track) => track.name) : scene.panes[k];
      const own = scene.tracks.find((track) => track.name === names[0]);
      const visible = shown.filter((track) => names.includes(track.name));
      this.paintPane(canvas, { ...colours }, visible, own ? own.absent : {});
    }
    const late = scene.trusted_until !== null && clock.time > scene.trusted_until;
    figure.querySelector(".status").textContent = late ? "the truth is not trusted at this time" : "";
    figure.dataset.shown = shown.map((track) => track.name).join(",");
    figure.dataset.painted = String(Number(figure.dataset.painted || 0) + 1);
  }

  /* Draw tracks on a canvas. The truth is dashed above other tracks, and solid where it is the only one. */
  paintPane(canvas, colours, shown, absent) {
    const { scene, camera, clock } = this;
    const context = canvas.getContext("2d");
    context.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
    const renderer = new Renderer(context, camera, colours, scene.unit);
    renderer.drawGeometry(scene.geometry, absent, clock.time);
    const [before, fraction] = this.between(clock.time);
    const isAlone = scene.panes !== null && shown.length === 1;
    const first = Math.max(0, WIDTHS.length - scene.tracks.filter((track) => track.css_class !== "truth").length);
    if (scene.bodies <= MAX_PATHS) for (const track of shown) this.drawPath(renderer, track, before, fraction);
    for (const track of shown) {
      this.place(track, before, fraction);
      const late = track.css_class === "truth" && scene.trusted_until !== null && clock.time > scene.trusted_until;
      context.globalAlpha = 1;
      if (late) colours.truth = colours.soft;
      const isDashed = track.css_class === "truth" && !isAlone;
      const place = first + scene.tracks.indexOf(track);
      renderer.drawTrack(scene.geometry, track, this.pose, scene.bodies, clock.time, place, isDashed);
    }
    this.drawNames(renderer, shown);
    for (const track of shown) renderer.drawMarks(track.marks, clock.time, scene.mark_time);
  }

  /* The paths of the bodies up to now. */
  drawPath(renderer, track, before, fraction) {
    const { camera, scene } = this;
    const { context } = renderer;
    const each = scene.has_angles ? 3 : 2;
    this.place(track, before, fraction);
    context.save();
    context.strokeStyle = renderer.colours[track.css_class];
    context.globalAlpha = track.css_class === "truth" ? 0.4 : 0.55;
    context.lineWidth = track.css_class === "truth" ? 1 : 1.4;
    context.setLineDash(track.css_class === "truth" ? [3, 4] : []);
    context.beginPath();
    for (let n = 0; n < scene.bodies; n += 1) {
      let drawing = false;
      for (let frame = 0; frame <= before; frame += 1) {
        const k = (frame * scene.bodies + n) * each;
        const seen = track.positions[k] !== 65535;
        if (seen) {
          const x = camera.toX(track.positions[k] * scene.step - scene.half);
          const y = camera.toY(track.positions[k + 1] * scene.step - scene.half);
          if (drawing) context.lineTo(x, y);
          else context.moveTo(x, y);
        }
        drawing = seen;
      }
      if (drawing && !Number.isNaN(this.pose[3 * n])) {
        context.lineTo(camera.toX(this.pose[3 * n]), camera.toY(this.pose[3 * n + 1]));
      }
    }
    context.stroke();
    context.restore();
  }

  /* Names beside the bodies of the last visible track. */
  drawNames(renderer, shown) {
    const { scene, camera } = this;
    const { context } = renderer;
    if (!shown.length) return;
    for (const [n, name] of scene.geometry.names.entries()) {
      const x = this.pose[3 * n];
      if (Number.isNaN(x) || !name) continue;
      const reach = Math.max(...scene.geometry.shapes[scene.geometry.shape[n]].map((piece) => piece[0])) * camera.scale;
      const aside = Math.max(reach, 3) * 0.75 + 6;
      const text = name.length > 24 ? `${name.slice(0, 23)}…` : name;
      context.font = `12px ${renderer.colours.font}`;
      const isAtEdge = camera.toX(x) + aside + context.measureText(text).width > camera.width;
      context.textAlign = isAtEdge ? "right" : "left";
      renderer.write(text, camera.toX(x) + (isAtEdge ? -aside : aside), camera.toY(this.pose[3 * n + 1]) - aside);
    }
  }
}

for (const figure of document.querySelectorAll(".replay")) {
  const place = figure.closest(".linked");
  const clock = new TimeCursor(JSON.parse(figure.querySelector("script.data").textContent).duration);
  const replay = new Replay(figure, clock);
  clock.set(replay.scene.start);
  for (const chart of place ? place.querySelectorAll("svg.time") : []) {
    linkChart(chart, clock, () => {
      replay.play(false);
      replay.load();
    });
  }
}
