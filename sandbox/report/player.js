// The player: draws the panes at one time, and moves the cursor shared by the charts.
// Lengths are in px of the scene, times in s; a frame is a row of the packed paths.
"use strict";
(() => {
  const element = (id) => document.getElementById(id);
  const read = (id) => JSON.parse(element(id).textContent);
  const unpack = (text, Numbers) => new Numbers(Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer);

  const data = read("data");
  const [width, height] = data.size;
  const balls = data.radius.length;
  const panes = [...document.querySelectorAll("#panes figure")].map((figure, index) => ({
    name: figure.querySelector("strong").textContent,
    canvas: figure.querySelector("canvas"),
    reading: figure.querySelector(".reading"),
    path: unpack(data.engines[index].path, Uint16Array),
    readings: unpack(data.engines[index].readings, Float32Array),
  }));
  const reference = panes[data.against];
  const last = reference.path.length / (2 * balls) - 1;
  const times = Array.from({ length: last + 1 }, (_, at) => at * data.frame); // of the frames
  const framesPerSecond = Math.round(1 / data.frame);

  const [play, scrubber, speed, ghosts, trails] = ["play", "scrubber", "speed", "ghosts", "trails"].map(element);
  let frame = 0;
  let chosen = null; // the button of the selected difference
  const cursors = [];

  // Panes

  const MIN_DASHED = 9; // px of the screen, the least radius of a dashed outline
  const place = (pane, at, ball) => {
    const index = 2 * (at * balls + ball);
    return [pane.path[index] * data.unit - data.margin, pane.path[index + 1] * data.unit - data.margin];
  };

  const isDark = (color) => {
    const [red, green, blue] = [1, 3, 5].map((start) => parseInt(color.slice(start, start + 2), 16));
    return 0.299 * red + 0.587 * green + 0.114 * blue < 128;
  };
  const background = data.background;
  const ink = isDark(background) ? "#ffffff" : "#000000"; // visible on the background, as a ball's own colour may not be
  const visible = (ball) => (data.colors[ball] === background ? ink : data.colors[ball]);

  const addCircle = (context, x, y, radius) => {
    context.moveTo(x + radius, y);
    context.arc(x, y, radius, 0, 2 * Math.PI);
  };

  function draw(pane) {
    const context = pane.canvas.getContext("2d");
    const scale = pane.canvas.width / width;
    const thin = devicePixelRatio / scale; // one px of the screen
    context.setTransform(scale, 0, 0, scale, 0, 0);
    context.lineCap = "round";
    context.fillStyle = background;
    context.fillRect(0, 0, width, height);
    drawWalls(context, thin);
    if (trails.checked) drawTrails(context, pane, 2 * thin);
    drawBalls(context, pane, thin);
    if (ghosts.checked && pane !== reference) drawGhosts(context, thin);
    if (isChosen(pane)) drawRings(context, pane, 3 * thin);
  }

  const POINT = 1e-3; // px, of the line of a peg, whose ends are one point: none would be drawn without a length

  function drawWalls(context, thin) {
    context.strokeStyle = ink;
    for (const [x0, y0, x1, y1, thickness] of data.walls) {
      context.lineWidth = Math.max(thickness, thin);
      context.beginPath();
      context.moveTo(x0, y0);
      context.lineTo(x1 + POINT, y1);
      context.stroke();
    }
  }

  function drawTrails(context, pane, thick) {
    context.lineWidth = thick;
    context.lineJoin = "bevel";
    context.globalAlpha = 0.45;
    const skip = data.numbered ? 1 : 5; // with many balls, coarser trails draw several times as fast
    const start = Math.ceil(Math.max(0, frame - framesPerSecond) / skip) * skip;
    for (let ball = 0; ball < balls; ball++) {
      context.strokeStyle = visible(ball);
      context.beginPath();
      for (let at = start; at < frame; at += skip) context.lineTo(...place(pane, at, ball));
      context.lineTo(...place(pane, frame, ball));
      context.stroke();
    }
    context.globalAlpha = 1;
  }

  function drawBalls(context, pane, thin) {
    context.lineWidth = thin;
    context.strokeStyle = ink;
    context.textAlign = "center";
    context.textBaseline = "middle";
    for (let ball = 0; ball < balls; ball++) {
      const [x, y] = place(pane, frame, ball);
      const radius = data.radius[ball];
      context.fillStyle = data.colors[ball];
      context.beginPath();
      addCircle(context, x, y, radius);
      context.fill();
      if (radius >= MIN_DASHED * thin || data.colors[ball] === background) context.stroke(); // small discs would be blots
      if (data.numbered && radius / thin >= 6) {
        context.fillStyle = isDark(data.colors[ball]) ? "#ffffff" : "#000000";
        context.font = `600 ${1.2 * radius}px system-ui, sans-serif`;
        context.fillText(ball, x, y);
      }
    }
  }

  function drawGhosts(context, thin) {
    context.strokeStyle = ink;
    for (const dashed of [true, false]) { // dashes of small outlines are blots
      context.lineWidth = (dashed ? 1.5 : 1) * thin;
      context.setLineDash(dashed ? [4 * thin, 3 * thin] : []);
      context.beginPath();
      for (let ball = 0; ball < balls; ball++) {
        const radius = data.radius[ball];
        if (radius >= MIN_DASHED * thin === dashed) addCircle(context, ...place(reference, frame, ball), radius);
      }
      context.stroke();
    }
    context.setLineDash([]);
  }

  const isChosen = (pane) =>
    chosen &&
    (pane === reference || pane.name === chosen.dataset.engine) &&
    Math.abs(times[frame] - chosen.dataset.time) <= 1;

  function drawRings(context, pane, thick) {
    context.lineWidth = thick;
    context.strokeStyle = ink;
    context.beginPath();
    for (const ball of chosen.dataset.balls.split(" ").map(Number)) {
      addCircle(context, ...place(pane, frame, ball), data.radius[ball] + 2 * thick);
    }
    context.stroke();
  }

  function fit() {
    for (const { canvas } of panes) {
      canvas.width = Math.round(canvas.clientWidth * devicePixelRatio);
      canvas.height = Math.round((canvas.width * height) / width);
    }
    show(frame);
  }

  // Time

  function show(wanted) {
    frame = Math.min(Math.max(wanted, 0), last);
    const time = times[frame];
    scrubber.value = frame;
    element("time").value = `${time.toFixed(3)} s`;
    scrubber.setAttribute("aria-valuetext", element("time").value);
    for (const pane of panes) {
      draw(pane);
      showReadings(pane);
    }
    for (const cursor of cursors) cursor.location = time;
  }

  function written(gap) {
    const digits = { maximumFractionDigits: Math.max(0, -Math.round(Math.log10(data.least))) };
    if (gap > 0 && gap < data.least) return `< ${data.least.toLocaleString("en", digits)}`;
    return Number(gap.toPrecision(3)).toLocaleString("en", digits);
  }

  function showReadings(pane) {
    const [gap, energy, contacts] = pane.readings.subarray(3 * frame, 3 * frame + 3);
    const texts = [`energy ${energy.toFixed(1)} ${data.energy}`, `${contacts.toLocaleString("en")} contact${contacts === 1 ? "" : "s"}`];
    if (pane !== reference) texts.unshift(`gap ${written(gap)} ${data.length}`);
    pane.reading.replaceChildren(
      ...texts.map((text) => Object.assign(document.createElement("span"), { textContent: text })),
    );
  }

  const slight = 1e-6 * data.frame;

  // The first frame at or after a time, or else the last.
  function frameAt(time) {
    const found = times.findIndex((one) => one >= time - slight);
    return found < 0 ? last : found;
  }

  // Playing

  let playing = false;

  function setPlaying(value) {
    playing = value;
    play.textContent = playing ? "Pause" : "Play";
    if (!playing) return;
    let next = frame < last ? frame : 0;
    let time = times[next];
    let before = null;
    const tick = (now) => {
      if (!playing) return;
      if (before !== null) time += ((now - before) / 1000) * speed.value;
      before = now;
      while (next < last && times[next + 1] <= time + slight) next++;
      if (next !== frame) show(next);
      if (frame < last) requestAnimationFrame(tick);
      else setPlaying(false);
    };
    requestAnimationFrame(tick);
  }

  function seek(frame) {
    setPlaying(false);
    show(frame);
  }

  function choose(button) {
    chosen?.removeAttribute("aria-current");
    chosen = button;
    chosen.setAttribute("aria-current", "true");
    const details = chosen.closest("li").cloneNode(true);
    details.querySelector("button").replaceWith(`${chosen.dataset.engine} at ${chosen.textContent}: `);
    element("chosen").replaceChildren(...details.childNodes);
    seek(frameAt(chosen.dataset.time));
  }

  // Input

  document.addEventListener("click", (event) => {
    const button = event.target.closest("[data-time]");
    if (!button) return;
    choose(button);
    element("player").parentElement.scrollIntoView();
  });
  play.addEventListener("click", () => setPlaying(!playing));
  element("back").addEventListener("click", () => seek(frame - 1));
  element("on").addEventListener("click", () => seek(frame + 1));
  scrubber.addEventListener("input", () => seek(Number(scrubber.value)));
  for (const box of [ghosts, trails]) box.addEventListener("change", () => show(frame));

  scrubber.max = last;
  new ResizeObserver(fit).observe(element("panes"));

  charts.onDrawn((figures) => {
    cursors.length = 0;
    for (const figure of figures) {
      const found = figure.center.filter((renderer) => renderer.name === "cursor");
      cursors.push(...found);
      figure.on_event("tap", (event) => seek(frameAt(event.x - data.frame / 2)));
      figure.on_event("doubletap", () => figure.x_range.setv({ start: 0, end: times[last] }));
    }
    show(frame);
  });
  addEventListener("beforeprint", () => document.querySelectorAll("details").forEach((details) => (details.open = true)));
})();
