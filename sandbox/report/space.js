// The player of recorded Spaces. Lengths are in px of the Space, times in s.
"use strict";
(() => {
  const JOINT = "rgb(142 68 173)"; // Pymunk's constraint_color
  const OUTLINE = "rgb(44 62 80)"; // Pymunk's shape_outline_color
  const STATIC = -1;
  const unpack = (text) => new Float32Array(Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer);
  const players = [];

  function playerOf(section, data) {
    const find = (name) => section.querySelector(name);
    const [play, scrubber, time, speed, outlines, marks, canvas] =
      [".play", ".scrubber", ".time", ".speed", ".outlines", ".marks", "canvas"].map(find);
    if (!data) {
      find(".stage").hidden = true;
      return null;
    }
    const poses = unpack(data.poses);
    const reference = data.reference && unpack(data.reference);
    const [left, bottom, width, height] = data.view;
    const last = data.times.length - 1;
    let frame = 0;
    let chosen = null;

    // The pose of a body: x, y and angle; undefined if it is not there.
    function pose(numbers, body) {
      if (body === STATIC) return [0, 0, 0];
      const at = 3 * (frame * data.bodies + body);
      return at + 2 < numbers.length && !Number.isNaN(numbers[at]) ? numbers.subarray(at, at + 3) : undefined;
    }

    function place([x, y, angle], [dx, dy]) {
      const [cos, sin] = [Math.cos(angle), Math.sin(angle)];
      return [x + cos * dx - sin * dy, y + sin * dx + cos * dy];
    }

    function trace(context, shape, at, thin) {
      const points = shape.points.map((point) => place(at, point));
      context.beginPath();
      if (shape.kind === "Circle") {
        const [x, y] = points[0];
        context.arc(x, y, shape.radius, 0, 2 * Math.PI);
        context.moveTo(x, y);
        context.lineTo(x + shape.radius * Math.cos(at[2]), y + shape.radius * Math.sin(at[2]));
      } else if (shape.kind === "Segment" && shape.radius > thin) {
        const [[x0, y0], [x1, y1]] = points;
        const angle = Math.atan2(y1 - y0, x1 - x0);
        context.arc(x0, y0, shape.radius, angle + Math.PI / 2, angle - Math.PI / 2);
        context.arc(x1, y1, shape.radius, angle - Math.PI / 2, angle + Math.PI / 2);
        context.closePath();
      } else {
        points.forEach((point) => context.lineTo(...point));
        context.closePath();
      }
    }

    function draw() {
      const context = canvas.getContext("2d");
      const scale = canvas.width / width;
      const thin = devicePixelRatio / scale; // one px of the screen
      context.setTransform(1, 0, 0, 1, 0, 0);
      context.fillStyle = "#ffffff";
      context.fillRect(0, 0, canvas.width, canvas.height);
      if (data.down) context.setTransform(scale, 0, 0, scale, -scale * left, -scale * bottom);
      else context.setTransform(scale, 0, 0, -scale, -scale * left, scale * (bottom + height));
      context.lineJoin = "round";
      const present = data.shapes.filter((shape) => shape.from <= frame && frame < shape.to);
      for (const shape of present) {
        const at = pose(poses, shape.body);
        if (!at) continue;
        trace(context, shape, at, thin);
        context.fillStyle = shape.color;
        context.strokeStyle = shape.kind === "Segment" && shape.radius <= thin ? shape.color : OUTLINE;
        context.lineWidth = shape.kind === "Segment" && shape.radius <= thin ? 2 * thin : thin;
        context.fill();
        context.stroke();
      }
      drawJoints(context, thin);
      if (reference && outlines.checked) drawOutlines(context, present, thin);
      if (chosen) drawRings(context, thin);
    }

    function drawJoints(context, thin) {
      context.strokeStyle = context.fillStyle = JOINT;
      context.lineWidth = 1.5 * thin;
      for (const joint of data.joints) {
        if (joint.from > frame || frame >= joint.to) continue;
        const ends = joint.points.map(([body, ...point]) => [pose(poses, body), point]);
        if (!ends.every(([at]) => at)) continue;
        const points = ends.map(([at, point]) => place(at, point));
        context.beginPath();
        points.forEach((point) => context.lineTo(...point));
        context.stroke();
        for (const [x, y] of points) {
          context.beginPath();
          context.arc(x, y, 3 * thin, 0, 2 * Math.PI);
          context.fill();
        }
      }
    }

    function drawOutlines(context, present, thin) {
      context.strokeStyle = "#c0392b";
      context.lineWidth = 1.5 * thin;
      context.setLineDash([5 * thin, 3 * thin]);
      for (const shape of present) {
        const at = shape.body === STATIC ? undefined : pose(reference, shape.body);
        if (!at) continue;
        trace(context, shape, at, thin);
        context.stroke();
      }
      context.setLineDash([]);
    }

    function drawRings(context, thin) {
      context.strokeStyle = "#e69f00";
      context.lineWidth = 3 * thin;
      for (const text of chosen.dataset.places.trim().split(" ").filter(Boolean)) {
        const [x, y] = text.split(",").map(Number);
        context.beginPath();
        context.arc(x, y, 14 * thin, 0, 2 * Math.PI);
        context.stroke();
      }
    }

    function fit() {
      canvas.width = Math.round(canvas.clientWidth * devicePixelRatio);
      canvas.height = Math.round((canvas.width * height) / width);
      draw();
    }

    function show(wanted) {
      frame = Math.min(Math.max(wanted, 0), last);
      scrubber.value = frame;
      time.value = `${data.times[frame].toFixed(3)} s`;
      scrubber.setAttribute("aria-valuetext", time.value);
      draw();
    }

    const { toggle, seek } = playbackOf(data.times, play, speed, () => frame, show);

    function choose(button) {
      chosen?.removeAttribute("aria-current");
      chosen = button;
      chosen.setAttribute("aria-current", "true");
      const found = data.times.findIndex((at) => at >= button.dataset.time - 1e-6);
      seek(found < 0 ? last : found);
    }

    scrubber.max = last;
    play.addEventListener("click", toggle);
    scrubber.addEventListener("input", () => seek(Number(scrubber.value)));
    outlines?.addEventListener("change", draw);
    for (const button of section.querySelectorAll("li [data-time]")) {
      button.addEventListener("click", () => {
        choose(button);
        find(".stage").scrollIntoView({ block: "nearest" });
      });
      const mark = document.createElement("i");
      mark.style.left = `${(100 * Math.min(button.dataset.time / data.times[last], 1)).toFixed(2)}%`;
      mark.addEventListener("click", () => choose(button));
      marks.append(mark);
    }
    new ResizeObserver(fit).observe(canvas);
    show(0);
    return { seek, toggle, at: () => frame, last };
  }

  const data = JSON.parse(document.getElementById("data").textContent);
  document.querySelectorAll(".space").forEach((section, index) => players.push(playerOf(section, data[index])));
  const first = players.find(Boolean);
  const keys = first && {
    " ": first.toggle,
    ArrowLeft: () => first.seek(first.at() - 1),
    ArrowRight: () => first.seek(first.at() + 1),
    Home: () => first.seek(0),
    End: () => first.seek(first.last),
  };
  document.addEventListener("keydown", (event) => {
    const isTaken = event.target.closest("select, input[type=range]") || (event.key === " " && event.target.closest("button, input"));
    if (!keys || !(event.key in keys) || isTaken || event.ctrlKey || event.altKey || event.metaKey) return;
    event.preventDefault();
    keys[event.key]();
  });
})();
