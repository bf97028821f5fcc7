// The table of before and after: the motion of the balls of one contact in each engine.
"use strict";
(() => {
  const data = JSON.parse(document.getElementById("data").textContent).impacts;
  const unpack = (text, Numbers) => new Numbers(Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer);
  const create = (tag, properties = {}, ...children) => {
    const element = Object.assign(document.createElement(tag), properties);
    element.append(...children);
    return element;
  };

  const engines = [...document.querySelectorAll("[data-impacts]")].map((place) => {
    const packed = data.engines[place.dataset.impacts];
    const [numbers, motion] = [unpack(packed.contacts, Float64Array), unpack(packed.motion, Float32Array)];
    const contacts = Array.from({ length: numbers.length / 3 }, (_, index) => {
      const [time, first, second] = numbers.subarray(3 * index, 3 * index + 3);
      return { time, first, second, motion: motion.subarray(12 * index, 12 * index + 12) };
    });
    return { select: place.querySelector("select"), bodies: place.querySelector(".bodies"), contacts };
  });

  const pair = ({ first, second }) =>
    second >= 0 ? `balls ${first} and ${second}` : `ball ${first} and ${data.walls[~second]}`;

  // Numbers as people write them, with five digits; rounding of contacts is far below 1e-6.
  function written(value) {
    if (Math.abs(value) < 1e-6) return "0";
    const digits = Math.max(0, 4 - Math.floor(Math.log10(Math.abs(value))));
    return value.toLocaleString("en", { maximumFractionDigits: Math.min(digits, 6) }).replace("-", "−");
  }

  // Rows of a ball: label, unit with the factor from px, value before and after. Energy is that of flight and spin.
  function motionOf(ball, values) {
    const [mass, moment] = [data.mass[ball], data.moment[ball]];
    const [before, after] = [values.subarray(0, 3), values.subarray(3, 6)];
    const { VELOCITY, MOMENTUM, ENERGY } = data.units;
    const rows = [
      ["mass", ["kg", 1], () => mass],
      ["speed", VELOCITY, ([x, y]) => Math.hypot(x, y)],
      ["velocity x", VELOCITY, ([x]) => x],
      ["velocity y", VELOCITY, ([, y]) => y],
      ["momentum x", MOMENTUM, ([x]) => mass * x],
      ["momentum y", MOMENTUM, ([, y]) => mass * y],
      ["energy", ENERGY, ([x, y, spin]) => (mass * (x * x + y * y) + moment * spin * spin) / 2],
      ["spin", ["rad/s", 1], ([, , spin]) => spin],
    ];
    return rows.map(([label, [unit, factor], value]) => {
      return { label, unit, before: factor * value(before), after: factor * value(after) };
    });
  }

  const SUMMED = ["momentum x", "momentum y", "energy"];

  function sumOf(one, other) {
    return one
      .map((row, index) => ({ ...row, before: row.before + other[index].before, after: row.after + other[index].after }))
      .filter((row) => SUMMED.includes(row.label));
  }

  function table(caption, rows) {
    const head = ["", "before", "after"].map((text) => create("th", { scope: "col", textContent: text }));
    const body = rows.map(({ label, unit, before, after }) =>
      create(
        "tr",
        {},
        create("th", { scope: "row" }, `${label} `, create("small", { textContent: unit })),
        create("td", { textContent: written(before) }),
        create("td", { textContent: written(after) }),
      ),
    );
    const parts = [create("caption", { textContent: caption }), create("thead", {}, create("tr", {}, ...head))];
    return create("table", {}, ...parts, create("tbody", {}, ...body));
  }

  function show(engine, index) {
    const contact = engine.contacts[index];
    engine.select.value = index;
    const first = motionOf(contact.first, contact.motion.subarray(0, 6));
    const tables = [table(`Ball ${contact.first}`, first)];
    if (contact.second >= 0) {
      const second = motionOf(contact.second, contact.motion.subarray(6, 12));
      tables.push(table(`Ball ${contact.second}`, second), table("Sum of both", sumOf(first, second)));
    }
    engine.bodies.replaceChildren(...tables);
  }

  function showNearest(engine, { time, first, second }) {
    const same = engine.contacts
      .map((contact, index) => ({ index, away: Math.abs(contact.time - time), contact }))
      .filter(({ contact }) => Math.min(contact.first, contact.second) === Math.min(first, second))
      .filter(({ contact }) => Math.max(contact.first, contact.second) === Math.max(first, second));
    if (same.length) show(engine, same.reduce((a, b) => (b.away < a.away ? b : a)).index);
    else {
      engine.select.value = "";
      engine.bodies.replaceChildren(create("p", { textContent: "No contact of these bodies." }));
    }
  }

  function choose(engine, index) {
    show(engine, index);
    for (const other of engines) if (other !== engine) showNearest(other, engine.contacts[index]);
  }

  for (const engine of engines) {
    engine.select.append(
      ...engine.contacts.map((contact, index) =>
        create("option", { value: index, textContent: `${contact.time.toFixed(3)} s, ${pair(contact)}` }),
      ),
    );
    engine.select.addEventListener("change", () => {
      if (engine === engines[0]) choose(engine, Number(engine.select.value));
      else show(engine, Number(engine.select.value));
    });
  }
  const between = engines[0]?.contacts.findIndex((contact) => contact.second >= 0);
  if (engines.length) choose(engines[0], Math.max(between, 0));
})();
