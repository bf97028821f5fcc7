// The clock of a player: shows one frame after another, at the chosen speed, or stops at one. Times in s.
"use strict";
function playbackOf(times, button, speed, shown, show) {
  const last = times.length - 1;
  const slight = (1e-6 * times[last]) / Math.max(last, 1);
  let playing = false;

  function set(value) {
    playing = value;
    button.textContent = playing ? "Pause" : "Play";
    if (!playing) return;
    let next = shown() < last ? shown() : 0;
    let time = times[next];
    let before = null;
    const tick = (now) => {
      if (!playing) return;
      if (before !== null) time += ((now - before) / 1000) * speed.value;
      before = now;
      while (next < last && times[next + 1] <= time + slight) next++;
      if (next !== shown()) show(next);
      if (shown() < last) requestAnimationFrame(tick);
      else set(false);
    };
    requestAnimationFrame(tick);
  }

  function seek(frame) {
    set(false);
    show(frame);
  }

  return { toggle: () => set(!playing), seek };
}
