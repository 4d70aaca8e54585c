/* The front end of a live scene: it draws the frames that it requests, and sends what the user does.

   A transport has `send(inputs)`, which sends an array of inputs, and calls `onmessage(reply)` once for each, or
   `onclose(reason)`. At most one request is under way: a slow scene gets fewer requests, not a queue of them. */
const POLL = 400; // ms between requests of a transport with `polls` while a shared scene is paused: others may play it
const MESSAGE_SECONDS = 8;
const LATE = 1500; // ms after which a missing answer is reported, as of a kernel that runs another cell
const DARK_THEME = window.matchMedia("(prefers-color-scheme: dark)");
const COLOURS = ["paper", "sheet", "ink", "soft", "rule", "solid", "pocket", "accent", "e0", "e1", "e2", "e3", "e4", "e5"];

/* Distance of a point in the frame of a body from one of its pieces, m; negative or 0 inside. */
function pieceDistance(piece, x, y) {
  const corners = [];
  for (let k = 1; k < piece.length; k += 2) corners.push([piece[k], piece[k + 1]]);
  let [nearest, inside] = [Infinity, corners.length > 2];
  const area = corners.reduce((sum, [ax, ay], k) => {
    const [bx, by] = corners[(k + 1) % corners.length];
    return sum + ax * by - ay * bx;
  }, 0);
  for (const [k, [ax, ay]] of corners.entries()) {
    const [bx, by] = corners[(k + 1) % corners.length];
    const [dx, dy] = [bx - ax, by - ay];
    const along = Math.min(Math.max(((x - ax) * dx + (y - ay) * dy) / (dx * dx + dy * dy || 1), 0), 1);
    nearest = Math.min(nearest, Math.hypot(x - ax - along * dx, y - ay - along * dy));
    if ((dx * (y - ay) - dy * (x - ax)) * area < 0) inside = false;
  }
  return (inside ? 0 : nearest) - piece[0];
}

class Live {
  constructor(place, transport) {
    this.transport = transport;
    this.queue = [];
    this.changes = new Map(); // latest values of sliders that are not sent yet
    this.waiting = this.closed = false;
    this.state = this.picture = this.held = this.target = this.chosen = null;
    this.moves = this.sentMoves = this.shownMoves = 0; // of the pointer while it drags
    this.sentAt = null;
    this.build(place);
    this.listen();
    transport.onmessage = (reply) => this.receive(reply);
    transport.onclose = (reason) => this.end(reason);
  }

  build(place) {
    this.canvas = element("canvas", { class: "world", role: "img", "aria-label": "Live scene" });
    this.status = element("p", { class: "status", "aria-live": "off" });
    this.message = element("p", { class: "message", role: "status" });
    this.time = element("output", { class: "time" }, "0 s");
    this.speed = element("select", { "aria-label": "Speed" });
    this.engine = element("select", { class: "engine" });
    this.ghost = element("select", { class: "ghost" });
    this.legend = element("ul", { class: "legend" });
    this.sliders = element("div", { class: "sliders" });
    const energy = element("canvas", { class: "energy", role: "img", "aria-label": "Kinetic, potential and total energy over time" });
    this.chart = new EnergyChart(energy);
    const key = (name, colour) => element("li", {}, element("span", { class: `line ${colour}`, "aria-hidden": "true" }), name);
    const controls = element(
      "div",
      { class: "controls" },
      button("play", "▶", "Play or pause (Space)"),
      button("step", "▸❘", "One step (.)"),
      button("reset", "↺", "Start again (R)"),
      this.time,
      element("span", { class: "view" }, this.speed, element("span", { class: "zoom" }, button("nearer", "+", "Zoom in (+)"), button("farther", "−", "Zoom out (−)"), button("fit", "⤢", "Fit all (0)"))),
    );
    const panel = element(
      "div",
      { class: "panel" },
      element("div", { class: "choices" }, element("label", {}, "Engine", this.engine), element("label", {}, "Ghost", this.ghost)),
      this.sliders,
      element("ul", { class: "keys" }, key("kinetic", "kinetic"), key("potential", "potential"), key("total", "total")),
      energy,
    );
    this.figure = element(
      "figure",
      { class: "layout", tabindex: "0", role: "group", "data-lm-suppress-shortcuts": "true" },
      element("div", { class: "main" }, element("div", { class: "stage" }, this.canvas, this.status, this.message), controls, this.legend),
      panel,
    );
    this.figure.setAttribute("aria-label", "Live scene. Space plays and pauses, period steps, R starts again, plus and minus zoom, brackets choose a body, arrows push it.");
    this.root = element("div", { class: "sandbox-live" }, this.figure);
    place.replaceChildren(this.root);
    this.context = this.canvas.getContext("2d");
    this.find = (action) => this.figure.querySelector(`[data-action="${action}"]`);
    this.observer = new ResizeObserver(() => this.resize());
    this.observer.observe(this.canvas);
  }

  /* --- Requests and replies --- */

  open() {
    this.send({ type: "open" });
    this.tick = (now) => this.cycle(now);
    this.request = requestAnimationFrame(this.tick);
  }

  close() {
    this.closed = true;
    this.observer.disconnect();
    DARK_THEME.removeEventListener("change", this.onTheme);
    cancelAnimationFrame(this.request);
  }

  end(reason) {
    this.close();
    this.say(reason, true);
    this.figure.dataset.ended = "true";
    for (const control of this.figure.querySelectorAll("button, select, input")) control.disabled = true;
  }

  send(input) {
    this.queue.push(input);
  }

  /* Once for each frame of the browser: draw what has come, and ask for the next frame. */
  cycle(now) {
    if (this.closed) return;
    if (this.isChanged) this.paint();
    if (!this.waiting) this.sendInputs(now);
    else if (now - this.sentAt > LATE) this.status.textContent = "waiting for an answer …";
    this.request = requestAnimationFrame(this.tick);
  }

  sendInputs(now) {
    if (this.target !== null) this.send({ type: "drag", target: this.target });
    this.target = null;
    for (const [key, value] of this.changes) this.send({ type: "set", key, value });
    this.changes.clear();
    const polls = this.transport.polls && this.state && this.state.is_shared && now - this.sentAt > POLL;
    if ((this.state && this.state.playing) || polls) {
      this.send({ type: "advance", elapsed: this.sentAt === null ? 0 : (now - this.sentAt) / 1000 });
    }
    if (!this.queue.length) return;
    this.waiting = true;
    this.sentAt = now;
    this.sentMoves = this.moves;
    this.transport.send(this.queue.splice(0, 30));
  }

  receive(reply) {
    this.waiting = false;
    this.shownMoves = this.sentMoves;
    if (reply.messages) this.say(reply.messages.join(" · "));
    if (reply.picture) this.takePicture(reply.picture);
    if (reply.state) this.takeState(reply.state);
    this.frame = reply;
    for (const [name, pose] of [["pose", reply.pose], ["ghostPose", reply.ghost && reply.ghost.pose]]) {
      this[name] = pose ? Float64Array.from(pose, (value) => (value === null ? NaN : value)) : null;
    }
    this.chart.add(reply.time, reply.energy);
    this.isChanged = true;
  }

  takePicture(picture) {
    const isFirst = this.picture === null;
    this.picture = picture;
    this.canvas.setAttribute("aria-label", picture.title);
    if (!isFirst) return;
    this.camera = new Camera(picture.view);
    this.resize();
  }

  takeState(state) {
    this.state = state;
    const play = this.find("play");
    play.textContent = state.playing ? "❚❚" : "▶";
    play.setAttribute("aria-pressed", String(state.playing));
    this.figure.dataset.playing = String(state.playing);
    const nearest = state.speeds.reduce((a, b) => (Math.abs(b - state.speed) < Math.abs(a - state.speed) ? b : a));
    this.fill(this.speed, state.speeds.map((each) => [String(each), `${each}×`, true]), String(nearest));
    this.chart.seconds = ENERGY_SECONDS * nearest;
    this.digits = Math.min(Math.max(2, Math.ceil(-Math.log10(state.dt))), 6);
    this.fill(this.engine, state.engines.map(({ name, is_able: isAble }) => [name, isAble ? name : `${name} (cannot run it)`, isAble]), state.engine);
    const others = state.engines.filter((each) => each.is_able && each.name !== state.engine).map(({ name }) => [name, 1]);
    const ghosts = state.has_steps ? [...others, [state.engine, 0.1]] : others; // event-driven engines need no small dt
    const chosen = state.ghost ? [state.ghost.engine, state.ghost.dt_fraction] : null;
    if (chosen && !ghosts.some((each) => String(each) === String(chosen))) ghosts.push(chosen);
    const names = ghosts.map(([name, fraction]) => [JSON.stringify([name, fraction]), fraction === 1 ? name : `${name === state.engine ? "" : `${name}, `}dt ÷ ${Math.round(1 / fraction)}`, true]);
    this.fill(this.ghost, [["null", "none", true], ...names], JSON.stringify(chosen));
    if (this.sliders.childElementCount !== state.sliders.length) {
      this.controls = state.sliders.map((each) => new Slider(each, (key, value) => this.changes.set(key, value)));
      this.sliders.replaceChildren(...this.controls.map((each) => each.root));
    }
    for (const [k, each] of state.sliders.entries()) if (!this.changes.has(each.key)) this.controls[k].show(each.value);
    const classOf = (name) => state.engines.find((each) => each.name === name).css_class;
    this.track = { css_class: classOf(state.engine), breaks: {}, hasAngles: true };
    this.ghostTrack = state.ghost && { css_class: "ghost", source: classOf(state.ghost.engine), breaks: {}, hasAngles: true };
    this.writeLegend();
    if (state.ended) this.say(`${state.ended} · press ↺ to start again`, true);
    else if (this.isLasting) this.say("");
    if (state.ghost && state.ghost.ended) this.say(`The ghost has ended: ${state.ghost.ended}`);
  }

  /* Set the options of a choice: value, text, whether it can be chosen. */
  fill(select, options, value) {
    const text = JSON.stringify(options);
    if (select.dataset.options !== text) {
      select.replaceChildren(...options.map(([each, name]) => element("option", { value: each }, name)));
      for (const [k, option] of options.entries()) select.options[k].disabled = !option[2];
      select.dataset.options = text;
    }
    select.value = value;
  }

  writeLegend() {
    const { state } = this;
    const rows = [[this.track.css_class, `${state.engine}, dt ${formatNumber(state.dt, "s")}`, ""]];
    if (state.ghost) rows.push([this.ghostTrack.source, `ghost: ${state.ghost.engine}, dt ${formatNumber(state.ghost.dt, "s")}`, "pale"]);
    this.legend.replaceChildren(
      ...rows.map(([cssClass, name, kind]) => {
        const swatch = element("span", { class: `swatch ${kind}`, "aria-hidden": "true" });
        swatch.style.setProperty("--own", `var(--${cssClass})`);
        return element("li", {}, swatch, name);
      }),
    );
    this.distance = null;
    if (!state.ghost) return;
    this.distance = element("output", { class: "distance" });
    this.legend.lastChild.append(this.distance);
  }

  say(text, isLasting = false) {
    this.message.textContent = text;
    this.isLasting = isLasting;
    clearTimeout(this.silence);
    if (text && !isLasting) this.silence = setTimeout(() => this.say(""), 1000 * MESSAGE_SECONDS);
  }

  /* --- Input --- */

  listen() {
    const { figure, canvas } = this;
    this.actions = {
      play: () => this.send({ type: "play", on: !(this.state && this.state.playing) }),
      step: () => this.send({ type: "step" }),
      reset: () => this.send({ type: "reset" }),
      nearer: () => this.zoom(1.25),
      farther: () => this.zoom(0.8),
      fit: () => this.fit(),
    };
    for (const [action, act] of Object.entries(this.actions)) this.find(action).addEventListener("click", act);
    this.speed.addEventListener("change", () => this.send({ type: "speed", speed: Number(this.speed.value) }));
    this.engine.addEventListener("change", () => {
      this.send({ type: "engine", name: this.engine.value });
      if (this.state) this.engine.value = this.state.engine; // until the engine has accepted the state
    });
    this.ghost.addEventListener("change", () => {
      const chosen = JSON.parse(this.ghost.value);
      this.send(chosen ? { type: "ghost", engine: chosen[0], dt_fraction: chosen[1] } : { type: "ghost", engine: null });
    });
    figure.addEventListener("keydown", (event) => this.press(event));
    canvas.addEventListener("wheel", (event) => this.turnWheel(event), { passive: false });
    canvas.addEventListener("pointerdown", (event) => this.grab(event));
    canvas.addEventListener("pointermove", (event) => this.move(event));
    for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, () => this.release());
    // A finger on a body drags it; anywhere else it scrolls the page.
    canvas.addEventListener("touchstart", (event) => this.held && event.preventDefault(), { passive: false });
    canvas.addEventListener("dblclick", () => this.fit());
    this.onTheme = () => {
      this.colours = null;
      this.isChanged = true;
    };
    DARK_THEME.addEventListener("change", this.onTheme);
  }

  press(event) {
    if (event.altKey || event.ctrlKey || event.metaKey || !this.picture) return;
    const on = event.target.matches.bind(event.target);
    const push = (x, y) => this.chosen !== null && this.send({ type: "push", body: this.chosen, direction: [x, y] });
    const keys = {
      " ": this.actions.play, k: this.actions.play, ".": this.actions.step, r: this.actions.reset, R: this.actions.reset,
      "+": this.actions.nearer, "=": this.actions.nearer, "-": this.actions.farther, 0: this.actions.fit,
      "]": () => this.choose(1), "[": () => this.choose(-1), Escape: () => this.choose(0),
      ArrowLeft: () => push(-1, 0), ArrowRight: () => push(1, 0), ArrowUp: () => push(0, 1), ArrowDown: () => push(0, -1),
    };
    if (!(event.key in keys) || on("select")) return;
    if (event.key === " " && on("button")) return; // it activates the button
    if (event.key.startsWith("Arrow") && (on("input") || this.chosen === null)) return;
    event.preventDefault();
    event.stopPropagation();
    keys[event.key]();
  }

  /* Choose the next or previous visible body for the arrow keys; 0: none. */
  choose(direction) {
    const { bodies, body_names: names } = this.picture;
    let next = this.chosen === null ? (direction > 0 ? -1 : bodies) : this.chosen;
    for (let k = 0; k < bodies && direction; k += 1) {
      next = (next + direction + bodies) % bodies;
      if (!Number.isNaN(this.pose[3 * next])) break;
    }
    this.chosen = direction && bodies ? next : null;
    this.say(this.chosen === null ? "" : `${names[next]}: arrow keys push it`);
    this.isChanged = true;
  }

  turnWheel(event) {
    // The wheel scrolls the page unless the scene has the focus.
    if (!this.camera || (!event.ctrlKey && !this.figure.contains(document.activeElement))) return;
    event.preventDefault();
    this.zoom(Math.exp(-0.0015 * event.deltaY), ...this.pixel(event));
  }

  pixel(event) {
    const box = this.canvas.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  }

  toWorld([px, py]) {
    const { camera } = this;
    return [camera.x + (px - camera.width / 2) / camera.scale, camera.y - (py - camera.height / 2) / camera.scale];
  }

  /* The body at a point, or the nearest one within reach, m: its index and the point in its own frame. */
  pick([x, y], reach) {
    const { picture, pose } = this;
    const { geometry } = picture;
    let [best, found] = [Infinity, null];
    for (let n = 0; n < picture.bodies; n += 1) {
      if (Number.isNaN(pose[3 * n])) continue;
      const [dx, dy] = [x - pose[3 * n], y - pose[3 * n + 1]];
      const [cos, sin] = [Math.cos(pose[3 * n + 2]), Math.sin(pose[3 * n + 2])];
      const [gx, gy] = [cos * dx + sin * dy, cos * dy - sin * dx];
      const distance = Math.min(...geometry.shapes[geometry.shape[n]].map((piece) => pieceDistance(piece, gx, gy)));
      if (distance > reach || distance >= best) continue;
      [best, found] = [distance, { body: n, grip: distance > 0 ? [0, 0] : [gx, gy] }];
    }
    return found;
  }

  grab(event) {
    if (event.button !== 0 || !this.camera || !this.pose || this.closed || this.held) return;
    const point = this.toWorld(this.pixel(event));
    this.held = this.pick(point, (event.pointerType === "mouse" ? 6 : 22) / this.camera.scale);
    this.panned = this.held || event.pointerType === "touch" ? null : [event.clientX, event.clientY];
    if (!this.held) return;
    this.canvas.setPointerCapture(event.pointerId);
    this.held.point = point;
    this.chosen = this.held.body;
    this.send({ type: "grab", ...this.held, point: undefined, target: point });
    this.isChanged = true;
  }

  move(event) {
    if (this.held) {
      this.held.point = this.target = this.toWorld(this.pixel(event));
      this.moves += 1;
    } else if (this.panned && event.buttons & 1) {
      this.camera.pan(event.clientX - this.panned[0], event.clientY - this.panned[1]);
      this.panned = [event.clientX, event.clientY];
      this.isChanged = true;
    } else if (this.camera && this.pose && event.pointerType === "mouse") {
      this.canvas.style.cursor = this.pick(this.toWorld(this.pixel(event)), 6 / this.camera.scale) ? "grab" : "default";
    }
  }

  release() {
    if (this.held) {
      if (this.target !== null) this.send({ type: "drag", target: this.target });
      this.send({ type: "release" });
    }
    this.held = this.target = this.panned = null;
    this.isChanged = true;
  }

  zoom(factor, x, y) {
    if (!this.camera) return;
    this.camera.zoom(factor, x, y);
    this.isChanged = true;
  }

  fit() {
    if (!this.camera) return;
    this.camera.fit();
    this.isChanged = true;
  }

  /* --- Drawing --- */

  resize() {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (!width || !height || !this.camera) return;
    this.ratio = window.devicePixelRatio || 1;
    this.canvas.width = Math.round(width * this.ratio);
    this.canvas.height = Math.round(height * this.ratio);
    this.camera.resize(width, height);
    if (this.pose) this.paint();
  }

  readColours() {
    const style = getComputedStyle(this.root);
    const colours = { font: style.fontFamily };
    for (const name of COLOURS) colours[name] = style.getPropertyValue(`--${name}`).trim();
    colours.edge = style.getPropertyValue("--solid-edge").trim();
    return colours;
  }

  paint() {
    this.isChanged = false;
    if (!this.pose || !this.ratio) return;
    this.colours = this.colours || this.readColours();
    const { context, picture, camera, colours, frame } = this;
    const { geometry } = picture;
    context.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
    const renderer = new Renderer(context, camera, colours);
    renderer.drawGeometry(geometry);
    if (this.ghostPose && this.ghostTrack) {
      colours.ghost = `${colours[this.ghostTrack.source]}70`; // pale
      renderer.drawTrack(geometry, this.ghostTrack, this.ghostPose, picture.bodies, frame.time, 1);
    }
    this.track.breaks = frame.breaks || {};
    renderer.drawTrack(geometry, this.track, this.pose, picture.bodies, frame.time, 2);
    this.drawChosen();
    this.drawPull();
    this.chart.paint(colours, this.ratio);
    this.time.textContent = `${frame.time.toFixed(this.digits)} s`;
    const notes = [];
    if (frame.real_speed !== undefined) notes.push(`at ${Math.round(100 * frame.real_speed)} % of real time`);
    if (!picture.is_complete) notes.push(`${picture.bodies.toLocaleString("en")} bodies are drawn`);
    this.status.textContent = notes.join(" · ");
    if (this.distance) this.distance.textContent = frame.ghost ? `${formatNumber(frame.ghost.distance, "m")} apart` : "";
    Object.assign(this.figure.dataset, { time: frame.time, painted: Number(this.figure.dataset.painted || 0) + 1, moves: this.shownMoves });
  }

  /* A ring around the chosen body. */
  drawChosen() {
    const { context, camera, pose, chosen, picture, colours } = this;
    if (chosen === null || chosen >= picture.bodies || Number.isNaN(pose[3 * chosen])) return;
    const shape = picture.geometry.shapes[picture.geometry.shape[chosen]];
    const reach = Math.max(...shape.map((piece) => piece[0] + Math.max(...piece.slice(1).map(Math.abs)) * (piece.length > 3 ? 1.42 : 1)));
    context.strokeStyle = colours.accent;
    context.lineWidth = 1.5;
    context.setLineDash([4, 4]);
    context.beginPath();
    context.arc(camera.toX(pose[3 * chosen]), camera.toY(pose[3 * chosen + 1]), reach * camera.scale + 6, 0, TURN);
    context.stroke();
    context.setLineDash([]);
  }

  /* The spring between the grip and the pointer. */
  drawPull() {
    const { context, camera, pose, held, colours } = this;
    if (!held || Number.isNaN(pose[3 * held.body])) return;
    const [x, y, angle] = pose.slice(3 * held.body, 3 * held.body + 3);
    const [cos, sin] = [Math.cos(angle), Math.sin(angle)];
    const [gx, gy] = held.grip;
    context.strokeStyle = context.fillStyle = colours.ink;
    context.lineWidth = 1.5;
    context.beginPath();
    context.moveTo(camera.toX(x + cos * gx - sin * gy), camera.toY(y + sin * gx + cos * gy));
    context.lineTo(camera.toX(held.point[0]), camera.toY(held.point[1]));
    context.stroke();
    context.beginPath();
    context.arc(camera.toX(held.point[0]), camera.toY(held.point[1]), 3.5, 0, TURN);
    context.fill();
  }
}

/* Show a live scene in an element, over a transport. `open()` of the result begins, `close()` ends it. */
export function mount(place, transport) {
  return new Live(place, transport);
}
