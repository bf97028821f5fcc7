// The charts of a page: drawn in the colours that the reader prefers, and as pictures on paper.
"use strict";
const charts = (() => {
  const { document: drawing, roots, dark } = JSON.parse(document.getElementById("document").textContent);
  const prefersDark = matchMedia("(prefers-color-scheme: dark)");
  const drawn = []; // functions called with the figures whenever they have been drawn
  let views = [];
  let last = Promise.resolve(); // the last drawing: one starts after the one before has ended

  function coloured() {
    if (!prefersDark.matches) return drawing;
    const light = new RegExp(Object.keys(dark).join("|"), "g");
    return JSON.parse(JSON.stringify(drawing).replace(light, (color) => dark[color]));
  }

  async function embed() {
    for (const view of views) view.remove();
    Bokeh.documents.length = 0;
    for (const name of Object.values(roots)) document.getElementById(name).replaceChildren();
    const item = { docid: "charts", roots, root_ids: Object.keys(roots) };
    const managers = await Bokeh.embed.embed_items({ charts: coloured() }, [item]);
    views = managers.flatMap((manager) => manager.roots).filter((view) => view.model.id in roots);
    for (const call of drawn) call(views.map((view) => view.model));
  }

  function draw() {
    Bokeh.set_log_level("warn");
    last = last.then(embed);
  }

  // A chart does not change its width for paper, so a picture of it stands there.
  function print() {
    for (const view of views) {
      const place = document.getElementById(roots[view.model.id]);
      const picture = Object.assign(new Image(), { src: view.export("png").canvas.toDataURL(), alt: "" });
      picture.className = prefersDark.matches ? "dark" : "";
      place.querySelector("img")?.remove();
      place.append(picture);
    }
  }

  prefersDark.addEventListener("change", draw);
  addEventListener("beforeprint", print);
  addEventListener("afterprint", () => document.querySelectorAll(".chart img").forEach((picture) => picture.remove()));

  addEventListener("DOMContentLoaded", draw); // once all scripts have asked for the figures
  return { onDrawn: (call) => drawn.push(call) };
})();
