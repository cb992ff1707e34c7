"use strict";
(() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const $ = (id) => document.getElementById(id);
  const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
  const still = matchMedia("(prefers-reduced-motion: reduce)");
  const letter = parseFloat(getComputedStyle(document.documentElement).fontSize) / 16;   // plots follow the reader's font size
  const config = { responsive: true, displaylogo: false, displayModeBar: false };

  const PREFIX = ["f", "p", "n", "µ", "m", "", "k", "M", "G", "T"];

  // A number with an SI prefix.
  const si = (value, unit) => {
    if (!value) return `0 ${unit}`;
    const power = Math.max(-5, Math.min(4, Math.floor(Math.log10(Math.abs(value.toPrecision(4))) / 3 + 1e-12)));
    return `${+(value / 10 ** (3 * power)).toPrecision(4)} ${PREFIX[power + 5]}${unit}`;
  };

  // Unpack rows of little-endian 16-bit integers.
  const unpack = ({ step, rows, data: text }) => {
    const raw = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
    const view = new DataView(raw.buffer);
    const n = raw.length / 2 / rows;
    return Array.from({ length: rows }, (_, r) =>
      Float32Array.from({ length: n }, (_, i) => step * view.getInt16(2 * (r * n + i), true)));
  };

  const axis = (title, more) => ({
    title: { text: title, font: { size: 12 * letter }, standoff: 8 }, automargin: true,
    gridcolor: colour("rule"), linecolor: colour("rule"), zeroline: false, ...more,
  });
  // A linear axis takes its prefix from the largest value; a logarithmic axis has one at each decade.
  const linear = (title, unit, values, more) => {
    const most = values.reduce((top, v) => Math.max(top, Math.abs(v)), 0);
    const power = most ? Math.max(-5, Math.min(4, Math.floor(Math.log10(most) / 3 + 1e-12))) : 0;
    const scale = 10 ** (-3 * power), name = `${PREFIX[power + 5]}${unit}`;
    return { scale, name, of: (list) => list.map((v) => v * scale), axis: axis(`${title} [${name}]`, more) };
  };
  const decades = (title, unit, more, values = []) => axis(`${title} [${unit}]`, {
    type: "log", tickformat: "~s", dtick: values.length && Math.max(...values) < 30 * Math.min(...values) ? "D2" : 1, ...more,
  });
  const layout = (title, x, y, more) => ({
    title: { text: title, x: 0, xref: "paper", xanchor: "left", y: 0.985, yanchor: "top", font: { size: 14 * letter } },
    margin: { l: 60, r: 12, t: 34 * letter, b: 48 * letter }, paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)",
    font: { family: getComputedStyle(document.body).fontFamily, color: colour("ink"), size: 12 * letter },
    hoverlabel: { bgcolor: colour("card"), bordercolor: colour("grey"), font: { color: colour("ink") } },
    ...(x && { xaxis: x, yaxis: y }), hovermode: "closest", showlegend: false, dragmode: "zoom", ...more,
  });
  const line = (x, y, paint, hover, name, dash) => ({
    type: "scatter", mode: "lines", x, y, name, line: { color: colour(paint), width: 1.8, simplify: false, dash }, hovertemplate: `${hover}<extra></extra>`,
  });

  const legend = {
    showlegend: true, legend: { orientation: "h", x: 0, y: -0.22, yanchor: "top", bgcolor: "rgba(0,0,0,0)" },
    margin: { l: 60, r: 12, t: 34 * letter, b: 84 * letter },
  };
  const flat = {
    "plot-force": () => {
      const t = linear("time", "s", data.force.x), f = linear("force", "N", data.force.y, { rangemode: "tozero" });
      return [
        [line(t.of(data.force.x), f.of(data.force.y), "blue", `%{y:.4g} ${f.name} at %{x:.4g} ${t.name}`)],
        layout("Contact force", t.axis, f.axis, {
          shapes: data.impacts.map(([start, end]) => ({
            type: "rect", xref: "x", yref: "paper", x0: start * t.scale, x1: end * t.scale, y0: 0, y1: 1,
            fillcolor: colour("shade"), line: { width: 0 }, layer: "below",
          })),
        }),
      ];
    },
    "plot-spectrum": () => {
      const top = Math.log10(Math.max(...data.spectrum.y, 1e-300));
      return [
        [line(data.spectrum.x, data.spectrum.y, "blue", "%{y:.4s}N s at %{x:.4s}Hz", "force"), {
          name: "modes of the struck body",
          type: "scatter", mode: "markers", x: data.natural, y: data.natural.map(() => 10 ** (top - 3.95)),
          marker: { symbol: "line-ns-open", size: 10, color: colour("green"), line: { width: 1 } },
          hovertemplate: "mode of the struck body, %{x:.5s}Hz<extra></extra>",
        }],
        layout("Spectrum of the force", decades("frequency", "Hz"), decades("magnitude", "N s", { range: [top - 4.1, top + 0.2] }), legend),
      ];
    },
    "plot-mobility": () => [
      [line(data.mobility.x, data.mobility.y, "blue", "%{y:.4s}m/(N s) at %{x:.4s}Hz")],
      layout("Mobility at the strike point", decades("frequency", "Hz"), decades("velocity per force", "m/(N s)")),
    ],
    "plot-energy": () => {
      const t = linear("time", "s", data.energy.x), e = linear("energy", "J", data.energy.striker.concat(data.energy.body));
      const parts = [["striker", "striker", "blue"], ["body", "struck body", "vermilion"], ["rest", "contact and losses", "orange", "dash"]];
      const x = t.of(data.energy.x);
      return [
        parts.map(([key, name, paint, dash]) =>
          line(x, e.of(data.energy[key]), paint, `${name}, %{y:.4g} ${e.name} at %{x:.4g} ${t.name}`, name, dash)),
        layout("Energy during the blow", t.axis, e.axis, legend),
      ];
    },
    "plot-modal": () => {
      const top = Math.log10(Math.max(...data.modal.y, 1e-300)), foot = 10 ** (top - 9);
      return [
        [{
          type: "scatter", mode: "markers", x: data.modal.x, y: data.modal.y, marker: { size: 5, color: colour("vermilion") },
          error_y: {
            type: "data", symmetric: false, array: data.modal.y.map(() => 0), arrayminus: data.modal.y.map((y) => Math.max(0, y - foot)),
            width: 0, thickness: 1.2, color: colour("vermilion"),
          },
          hovertemplate: "%{y:.4s}J at %{x:.5s}Hz<extra></extra>",
        }],
        layout("Energy of each mode after the blow", decades("natural frequency", "Hz", {}, data.modal.x),
          decades("energy", "J", { range: [top - 7, top + 0.4] })),
      ];
    },
  };

  const view = data.view;
  const wave = unpack(view.wave), shapes = unpack(view.shapes);
  const span = Math.max(Math.max(...view.x) - Math.min(...view.x), Math.max(...view.y) - Math.min(...view.y));
  const side = (values) => Math.max(0.08, (Math.max(...values) - Math.min(...values)) / span);
  const largest = Math.max(...wave.map((row) => row.reduce((most, v) => Math.max(most, Math.abs(v)), 0))) || 1;
  const down = (row) => row.map((v) => -v);   // the blow comes from above
  // narrow screens and broad bodies need a camera farther away
  const far = (matchMedia("(max-width: 30rem)").matches ? 1.3 : 1) * (1 + 0.25 * Math.min(side(view.x), side(view.y)));
  const camera = () => ({ eye: { x: 0.75 * far, y: -1.2 * far, z: 0.75 * far }, center: { x: 0, y: 0, z: -0.08 } });
  const limits = { wave: 1.8 * largest, mode: 1.8 };
  // a curved body's rise is drawn to scale with its length and breadth, see `stage`; deflections are not
  const scaled = (rise, limit) => 4 * limit * rise / span;
  const raised = (values, limit) => (view.rise ? values.map((v, i) => v + scaled(view.rise[i], limit)) : values);
  const surface = (values, limit, unit) => ({  // with a unit, hovering shows the deflection of a flat body
    type: "mesh3d", x: view.x, y: view.y, z: raised(values, 1.8 * limit), i: view.cells[0], j: view.cells[1], k: view.cells[2], intensity: values,
    cmin: -limit, cmax: limit, flatshading: false, hoverinfo: unit && !view.rise ? "z" : "skip", showscale: false,
    hovertemplate: unit && !view.rise ? `%{z:.3s}${unit}<extra></extra>` : undefined,
    colorscale: [[0, "#b35806"], [0.25, "#f1a340"], [0.5, "#e9e6e2"], [0.75, "#998ec3"], [1, "#542788"]],
    lighting: { ambient: 0.62, diffuse: 0.7, specular: 0.12, roughness: 0.8 }, lightposition: { x: -2e4, y: 3e4, z: 6e4 },
  });
  const stage = (limit, was) => {
    const [low, high] = [Math.min, Math.max].map((end) => scaled(view.rise ? end(...view.rise) : 0, limit));
    const hide = { visible: false, showspikes: false };
    return layout("", undefined, undefined, {
      margin: { l: 0, r: 0, t: 0, b: 0 },
      scene: {
        xaxis: hide, yaxis: hide, zaxis: { ...hide, range: [low - limit, high + limit] }, aspectmode: "manual",
        aspectratio: { x: 1.4 * side(view.x), y: 1.4 * side(view.y), z: 0.7 * (1 + 0.5 * (high - low) / limit) }, camera: was || camera(), dragmode: "orbit",
      },
    });
  };
  let instant = 0, picked = Math.max(0, view.frequencies.findIndex((f) => f > 0)), phase = 1;
  // The tip sits on the surface during contact and at its true distance otherwise.
  const striker = () => ({
    type: "scatter3d", mode: "markers", x: [view.at[0]], y: [view.at[1]],
    z: [Math.min(0.17 * largest - view.surface[instant] + view.gap[instant], 1.75 * largest) + scaled(view.under || 0, limits.wave)],
    marker: { size: 8, color: colour("strike") }, hovertemplate: "striker<extra></extra>",
  });
  const atRest = (limit, [x, y, z], tone = "grey", width = 2) => ({
    type: "scatter3d", mode: "lines", x, y, z: z.map((v) => (v === null ? null : scaled(v, limit))),
    line: { color: colour(tone), width }, hoverinfo: "skip",
  });
  const lines = (limit, ...between) => [atRest(limit, view.rim), ...between, ...(view.ribs ? [atRest(limit, view.ribs, "strike", 3)] : [])];
  const solid = {
    "plot-wave": (was) => [[surface(down(wave[instant]), largest, "m"), ...lines(limits.wave, ...(view.gap ? [striker()] : []))], stage(limits.wave, was)],
    "plot-mode": (was) => [[surface(shapes[picked].map((v) => phase * v), 1, ""), ...lines(limits.mode)], stage(limits.mode, was)],
  };

  const draw = () => {
    for (const [id, make] of Object.entries(flat)) {
      if (!$(id)) continue;   // a sequence has no striker whose energy is drawn
      const [traces, what] = make();
      $(id).querySelector(":scope > svg")?.remove();
      Plotly.react(id, traces, what, config);
    }
    for (const [id, make] of Object.entries(solid)) {
      const box = $(id);
      const [traces, what] = make(box.layout?.scene?.camera);
      Plotly.react(id, traces, what, { ...config, scrollZoom: true });
    }
  };
  const canTurn = (() => {
    try { return Boolean(document.createElement("canvas").getContext("webgl")); } catch { return false; }
  })();
  if (!canTurn) {
    for (const id of Object.keys(solid)) {
      $(id).innerHTML = '<p class="message">This view needs WebGL, which is off in this browser. <code>fem-impact strike</code> writes the shapes to files.</p>';
      delete solid[id];
    }
  }
  const setWave = (n) => {
    instant = n;
    $("wave-time").value = n;
    const text = si(view.times[n], "s");
    $("wave-time").setAttribute("aria-valuetext", text);
    $("wave-out").textContent = text;
    if (!canTurn) return;
    const values = down(wave[n]);
    Plotly.restyle("plot-wave", { z: [raised(values, limits.wave)], intensity: [values] }, [0]);
    if (view.gap) Plotly.restyle("plot-wave", { z: [striker().z] }, [2]);
  };
  const setMode = () => {
    if (!canTurn) return;
    const values = shapes[picked].map((v) => phase * v);
    Plotly.restyle("plot-mode", { z: [raised(values, limits.mode)], intensity: [values] }, [0]);
  };

  // One timer per Play button; it never starts by itself.
  const player = (button, rate, tick, stopped) => {
    let timer = 0;
    button.addEventListener("click", () => {
      const starts = !timer;
      clearInterval(timer);
      timer = starts ? setInterval(tick, still.matches ? 4 * rate : rate) : 0;
      button.textContent = starts ? "Pause" : "Play";
      if (!starts) stopped?.();
    });
  };

  $("wave-time").max = view.times.length - 1;
  $("wave-time").addEventListener("input", (event) => setWave(+event.target.value));
  view.frequencies.forEach((frequency, i) => {
    const name = frequency ? si(frequency, "Hz") : "rigid motion";
    $("mode-pick").add(new Option(`${i + 1}: ${name}${view.damping[i] ? `, ${+(100 * view.damping[i]).toPrecision(3)} % damping` : ""}`, i));
  });
  $("mode-pick").value = picked;
  let turned = 0;
  player($("mode-play"), 50, () => { turned += 0.26; phase = Math.cos(turned); setMode(); }, () => { turned = 0; phase = 1; setMode(); });
  $("mode-pick").addEventListener("change", (event) => { picked = +event.target.value; setMode(); });
  player($("wave-play"), 60, () => { setWave((instant + 1) % view.times.length); });

  // Arrow keys turn a view; + and - zoom.
  const turn = (id, event) => {
    const box = $(id), now = box.layout?.scene?.camera;
    if (!now) return;
    const { x, y, z } = now.eye;
    const flatSize = Math.hypot(x, y), size = Math.hypot(x, y, z);
    let angle = Math.atan2(y, x), rise = Math.atan2(z, flatSize), distance = size;
    if (event.key === "ArrowLeft") angle -= 0.15;
    else if (event.key === "ArrowRight") angle += 0.15;
    else if (event.key === "ArrowUp") rise = Math.min(1.5, rise + 0.12);
    else if (event.key === "ArrowDown") rise = Math.max(-1.5, rise - 0.12);
    else if (event.key === "+" || event.key === "=") distance = Math.max(0.4, size / 1.15);
    else if (event.key === "-") distance = Math.min(6, size * 1.15);
    else return;
    event.preventDefault();
    const flatDistance = distance * Math.cos(rise);
    const eye = { x: flatDistance * Math.cos(angle), y: flatDistance * Math.sin(angle), z: distance * Math.sin(rise) };
    Plotly.relayout(id, { "scene.camera": { ...now, eye } });
  };
  for (const id of Object.keys(solid)) $(id).addEventListener("keydown", (event) => turn(id, event));

  draw();
  $("scale-low").textContent = si(largest, "m") + " down";
  $("scale-high").textContent = "up " + si(largest, "m");
  setWave(view.first);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
  matchMedia("print").addEventListener("change", draw);   // print uses the light colours
  addEventListener("beforeprint", () => {   // WebGL views print empty, so print an image of each
    for (const id of Object.keys(solid)) {
      const plot = $(id)._fullLayout.scene._scene.glplot;
      plot.redraw();
      const image = $(id).querySelector(".printed") || $(id).appendChild(new Image());
      image.className = "printed";
      image.alt = "";
      image.src = plot.canvas.toDataURL();
    }
  });
  document.documentElement.dataset.ready = "true";
})();
