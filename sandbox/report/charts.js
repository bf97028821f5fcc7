// The charts of a page, which are pictures on paper.
"use strict";
const charts = (() => {
  const { document: drawing, roots } = JSON.parse(document.getElementById("document").textContent);
  const drawn = []; // functions called with the figures once they have been drawn
  let views = [];

  async function draw() {
    Bokeh.set_log_level("warn");
    const item = { docid: "charts", roots, root_ids: Object.keys(roots) };
    const managers = await Bokeh.embed.embed_items({ charts: drawing }, [item]);
    views = managers.flatMap((manager) => manager.roots).filter((view) => view.model.id in roots);
    for (const call of drawn) call(views.map((view) => view.model));
  }

  // A chart does not change its width for paper, so a picture of it stands there.
  function print() {
    for (const view of views) {
      const place = document.getElementById(roots[view.model.id]);
      const picture = Object.assign(new Image(), { src: view.export("png").canvas.toDataURL(), alt: "" });
      place.querySelector("img")?.remove();
      place.append(picture);
    }
  }

  addEventListener("beforeprint", print);
  addEventListener("afterprint", () => document.querySelectorAll(".chart img").forEach((picture) => picture.remove()));

  addEventListener("DOMContentLoaded", draw); // once all scripts have asked for the figures
  return { onDrawn: (call) => drawn.push(call) };
})();
