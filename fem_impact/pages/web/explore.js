"use strict";
(() => {
  // Plots are drawn on a canvas, so CSS cannot set their colours.
  const NAMES = ["body", "map", "force", "spectrum"];
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
  const paint = () => {
    const page = Bokeh.documents[0];
    const dress = (model, look) => model.setv(look, { sync: false });   // only this browser's look changes
    for (const name of NAMES) {
      const plot = page.get_model_by_name(name);
      dress(plot, { outline_line_color: colour("rule") });
      dress(plot.title, { text_color: colour("ink") });
      for (const axis of [...plot.below, ...plot.left]) {
        dress(axis, {
          axis_line_color: colour("rule"), major_tick_line_color: colour("rule"), minor_tick_line_color: null,
          axis_label_text_color: colour("soft"), major_label_text_color: colour("soft"),
        });
      }
      for (const grid of plot.center) if ("grid_line_color" in grid) dress(grid, { grid_line_color: colour("rule") });
    }
    for (const name of ["force-line", "spectrum-line"]) dress(page.get_model_by_name(name), { line_color: { value: colour("line") } });
    dress(page.get_model_by_name("limit-span"), { line_color: colour("ink") });
    const fill = { value: colour("body") };
    dress(page.get_model_by_name("body-fill"), { fill_color: fill, line_color: fill });
  };
  // Bokeh's slider titles cannot show a number with its unit: each slider gets a label, which screen readers read too.
  const label = (page) => {
    const { name, title, text } = page.get_model_by_name("said").data;
    name.forEach((one, i) => {
      const root = Bokeh.index.find_one(page.get_model_by_name(one)).shadow_el;
      if (!root.querySelector(".said")) {
        const line = document.createElement("div");
        line.className = "said";
        line.append(document.createElement("span"), document.createElement("b"));
        root.prepend(line);
      }
      root.querySelector(".said span").textContent = title[i];
      root.querySelector(".said b").textContent = text[i];
      const handle = root.querySelector(".noUi-handle");
      handle.setAttribute("aria-label", title[i]);
      handle.setAttribute("aria-valuetext", text[i]);
    });
  };
  const begin = () => {
    const page = Bokeh.documents[0];
    if (!page?.get_model_by_name("spectrum") || !Bokeh.index.find_one(page.get_model_by_name("mass"))) {
      setTimeout(begin, 20);
      return;
    }
    paint();
    label(page);
    page.get_model_by_name("said").properties.data.change.connect(() => label(page));
    dark.addEventListener("change", paint);
    const sound = page.get_model_by_name("sound");
    sound.properties.data.change.connect(() => {
      const player = document.getElementById("player");
      document.getElementById("heard").textContent = sound.data.note[0];
      if (!sound.data.uri[0]) return;   // not there yet
      player.src = sound.data.uri[0];
      player.play().catch(() => {});   // the browser may require another click before it plays
    });
    document.documentElement.dataset.ready = "true";
  };
  begin();
})();
