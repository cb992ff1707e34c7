"use strict";
(() => {
  const $ = (id) => document.getElementById(id);
  const facts = JSON.parse($("facts").textContent);
  const root = document.documentElement;
  const bytes = (text) => Uint8Array.from(atob(text), (one) => one.charCodeAt(0));
  const floats = (text) => new Float32Array(bytes(text).buffer);

  // Numbers with their units ------------------------------------------------------------------------------------------
  const PREFIXES = ["f", "p", "n", "µ", "m", "", "k", "M", "G", "T"];  // as in sentences.py
  const si = (value, unit, step) => {
    if (unit === "kg" && Math.abs(value) < 1) { value *= 1000; step *= 1000; unit = "g"; }
    const power = value ? Math.max(-5, Math.min(4, Math.floor(Math.log10(Math.abs(value)) / 3 + 1e-9))) : 0;
    const digits = value ? Math.max(1, Math.min(12, Math.ceil(Math.log10(Math.abs(value) / step) + 1e-9) + 1)) : 1;
    if (!unit) return String(+value.toPrecision(digits));
    return `${+(value / 10 ** (3 * power)).toPrecision(digits)} ${PREFIXES[power + 5]}${unit}`;
  };
  const linear = (low, high, most) => {
    const rough = (high - low) / most, decade = 10 ** Math.floor(Math.log10(rough));
    const step = decade * [1, 2, 5, 10].find((part) => part * decade >= rough * (1 - 1e-9));
    const found = [];
    for (let i = Math.ceil(low / step - 1e-9); i * step <= high + 1e-9 * step; i++) found.push([i * step, step]);
    return found;
  };
  const logarithmic = (low, high, most) => {
    const decades = Math.log10(high / low);
    if (decades < 0.7) return linear(low, high, most);
    const parts = decades < 1.6 ? [1, 2, 5] : decades < 2.6 ? [1, 3] : [1];
    const every = parts.length > 1 ? 1 : Math.max(1, Math.ceil(decades / most)), found = [];
    for (let e = Math.floor(Math.log10(low)); e <= Math.log10(high) + 1e-9; e++) {
      if (e % every === 0) for (const part of parts) found.push([part * 10 ** e, part * 10 ** e]);
    }
    return found.filter(([value]) => value >= low * (1 - 1e-9) && value <= high * (1 + 1e-9));
  };

  // Plots: canvases, because redrawing one takes a millisecond ----------------------------------------------------------
  const look = {};
  const dress = () => {
    const style = getComputedStyle(root);
    for (const name of ["card", "ink", "soft", "rule", "line", "body", "edge", "struck", "heard", "over", "n0", "n1", "n2", "n3", "n4"]) {
      look[name] = style.getPropertyValue(`--${name}`).trim();
    }
    look.font = `12px ${getComputedStyle(document.body).fontFamily}`;
  };
  class Plot {
    constructor(id, x, y, paint) {
      Object.assign(this, { canvas: $(id), x, y, paint });
      this.context = this.canvas.getContext("2d");
      new ResizeObserver(() => this.draw()).observe(this.canvas);
    }
    place(axis, value) {
      const { low, high, from, to, log } = axis;
      return from + (to - from) * (log ? Math.log(value / low) / Math.log(high / low) : (value - low) / (high - low));
    }
    value(axis, pixel) {
      const { low, high, from, to, log } = axis, share = (pixel - from) / (to - from);
      return log ? low * (high / low) ** share : low + (high - low) * share;
    }
    px(value) { return this.place(this.x, value); }
    py(value) { return this.place(this.y, value); }
    draw() {
      const { canvas, context: c, x, y } = this, scale = devicePixelRatio || 1;
      const wide = canvas.clientWidth, tall = canvas.clientHeight;
      if (!wide || !tall) return;
      if (canvas.width !== Math.round(wide * scale) || canvas.height !== Math.round(tall * scale)) {
        canvas.width = Math.round(wide * scale);
        canvas.height = Math.round(tall * scale);
      }
      c.setTransform(scale, 0, 0, scale, 0, 0);
      c.clearRect(0, 0, wide, tall);
      c.font = look.font;
      const ticks = (axis, most) => axis.hidden ? [] : (axis.log ? logarithmic : linear)(axis.low, axis.high, most)
        .map(([value, step]) => [value, si(value, axis.unit, step)]);
      const rows = ticks(y, 5);
      const left = Math.max(y.hidden ? 0 : 30, ...rows.map(([, text]) => c.measureText(text).width)) + (y.hidden ? 10 : 8) + (y.label ? 18 : 0);
      Object.assign(x, { from: left, to: wide - 14 });
      Object.assign(y, { from: tall - (x.label ? 40 : 24), to: 10 });
      if (this.square) this.square();
      const columns = ticks(x, (x.to - x.from) / 75);
      c.strokeStyle = look.rule;
      c.fillStyle = look.soft;
      c.lineWidth = 1;
      c.textAlign = "center";
      c.textBaseline = "top";
      let end = -1e9;
      for (const [value, text] of columns) {
        const at = this.px(value), half = 0.5 * c.measureText(text).width, middle = Math.min(at, wide - half - 1);
        this.stroke([[at, y.from], [at, y.to]]);
        if (middle - half > end + 8) { c.fillText(text, middle, y.from + 6); end = middle + half; }
      }
      if (x.label) c.fillText(x.label, 0.5 * (x.from + x.to), y.from + 23);
      c.textAlign = "right";
      c.textBaseline = "middle";
      for (const [value, text] of rows) {
        const at = this.py(value);
        this.stroke([[x.from, at], [x.to, at]]);
        c.fillText(text, x.from - 6, at);
      }
      if (y.label) {
        c.save();
        c.translate(9, 0.5 * (y.from + y.to));
        c.rotate(-0.5 * Math.PI);
        c.textAlign = "center";
        c.fillText(y.label, 0, 0);
        c.restore();
      }
      c.save();
      c.beginPath();
      c.rect(x.from, y.to, x.to - x.from, y.from - y.to);
      c.clip();
      this.paint(c);
      c.restore();
      c.strokeStyle = look.rule;
      c.strokeRect(x.from, y.to, x.to - x.from, y.from - y.to);
    }
    stroke(points) {
      const c = this.context;
      c.beginPath();
      for (const [i, [x, y]] of points.entries()) i ? c.lineTo(x, y) : c.moveTo(x, y);
      c.stroke();
    }
    curve(xs, ys) {
      const c = this.context;
      c.beginPath();
      let on = false;
      for (let i = 0; i < xs.length; i++) {
        const y = this.py(ys[i]);
        if (Number.isFinite(y)) on ? c.lineTo(this.px(xs[i]), y) : c.moveTo(this.px(xs[i]), y);
        on = Number.isFinite(y);
      }
      c.stroke();
    }
    mark(x, y, colour, sides) {
      const c = this.context, r = 7;
      c.beginPath();
      if (sides) for (let i = 0; i < sides; i++) c.lineTo(x + r * Math.sin((2 * Math.PI * i) / sides), y + r * Math.cos((2 * Math.PI * i) / sides));
      else c.arc(x, y, r, 0, 2 * Math.PI);
      c.closePath();
      c.fillStyle = colour;
      c.strokeStyle = "#ffffff";
      c.lineWidth = 2;
      c.fill();
      c.stroke();
    }
  }

  dress();
  const shown = { at: facts.at, ear: facts.at, time: [], force: [], spectrum: [] };
  const corners = facts.loops.flat(), flat = corners.some((one) => one[1] !== corners[0][1]);
  const reach = (i) => [Math.min(...corners.map((one) => one[i])), Math.max(...corners.map((one) => one[i]))];
  const [left, right] = reach(0), [low, high] = flat ? reach(1) : [-0.1 * (right - left), 0.1 * (right - left)];
  const body = new Plot("body-plot", { low: left, high: right, unit: "m" }, { low, high, unit: "m", hidden: !flat }, (c) => {
    c.beginPath();
    for (const loop of facts.loops) {
      for (const [i, [x, y]] of loop.entries()) c[i ? "lineTo" : "moveTo"](body.px(x), body.py(y));
      c.closePath();
    }
    c.fillStyle = look.body;
    c.strokeStyle = look.edge;
    c.lineWidth = flat ? 2 : 8;
    c.fill("evenodd");
    c.stroke();
    c.beginPath();
    for (const [from, to] of facts.ribs.flat()) {
      c.moveTo(body.px(from[0]), body.py(from[1]));
      c.lineTo(body.px(to[0]), body.py(to[1]));
    }
    c.stroke();
    const [ear, at] = [shown.ear, shown.at].map(([x, y]) => [body.px(x), body.py(y ?? 0)]);
    body.mark(...ear, look.heard, 4);
    body.mark(...at, look.struck);
  });
  body.square = () => {  // lengths alike along both axes, and some room around
    const { x, y } = body, wide = x.to - x.from, tall = y.from - y.to;
    const scale = Math.max((right - left) / wide, (high - low) / tall) * 1.08;
    Object.assign(x, { low: 0.5 * (left + right - wide * scale), high: 0.5 * (left + right + wide * scale) });
    Object.assign(y, { low: 0.5 * (low + high - tall * scale), high: 0.5 * (low + high + tall * scale) });
  };

  const ends = ([low, high]) => ({ low, high });
  const map = new Plot(
    "map-plot", { ...ends(facts.mass), log: true, unit: "kg", label: "mass of the striker" },
    { ...ends(facts.stiffness), log: true, unit: "", label: "stiffness over the scene's" }, (c) => {
      const { cells } = map;
      if (cells) {  // each point stands in the middle of its pixel
        const [x0, x1] = cells.mass.map((one) => map.px(one)), [y0, y1] = cells.stiffness.map((one) => map.py(one));
        const wide = (x1 - x0) / (cells.columns - 1), tall = (y0 - y1) / (cells.rows - 1);
        c.imageSmoothingEnabled = false;
        c.drawImage(cells.image, x0 - 0.5 * wide, y1 - 0.5 * tall, x1 - x0 + wide, y0 - y1 + tall);
        c.setLineDash([7, 5]);
        c.strokeStyle = look.over;
        c.lineWidth = 2;
        map.curve(cells.x, cells.y);
        c.setLineDash([]);
      }
      if (shown.mass) map.mark(map.px(shown.mass), map.py(shown.stiffness), look.struck);
      if (map.dragged) {
        const [a, b, d, e] = map.dragged;
        c.strokeStyle = look.over;
        c.lineWidth = 1.5;
        c.fillStyle = "rgb(255 255 255 / 35%)";
        c.fillRect(a, b, d - a, e - b);
        c.strokeRect(a, b, d - a, e - b);
      }
    });
  const force = new Plot("force-plot", { low: 0, high: 1, unit: "s" }, { low: 0, high: 1, unit: "N" }, (c) => {
    c.strokeStyle = look.line;
    c.lineWidth = 2;
    force.curve(shown.time, shown.force);
  });
  const frequencies = Array.from({ length: facts.points }, (_, i) => facts.band[0] * (facts.band[1] / facts.band[0]) ** (i / (facts.points - 1)));
  const spectrum = new Plot(
    "spectrum-plot", { ...ends(facts.band), log: true, unit: "Hz" }, { low: 1e-3, high: 1, log: true, unit: "N s" }, (c) => {
      c.lineWidth = 2;
      c.strokeStyle = look.heard;
      const upright = (at) => spectrum.stroke([[spectrum.px(at), spectrum.y.from], [spectrum.px(at), spectrum.y.to]]);
      if (shown.resonance) upright(shown.resonance);
      c.setLineDash([7, 5]);
      c.strokeStyle = look.ink;
      if (shown.limit) upright(shown.limit);
      c.setLineDash([]);
      c.strokeStyle = look.line;
      spectrum.curve(frequencies, shown.spectrum);
    });
  const paintMap = (cells) => {
    const image = document.createElement("canvas");
    [image.width, image.height] = [cells.columns, cells.rows];
    const c = image.getContext("2d", { willReadFrequently: true }), data = c.createImageData(cells.columns, cells.rows), colours = [];
    for (let i = 0; i < 5; i++) {
      c.fillStyle = look[`n${i}`];
      c.fillRect(0, 0, 1, 1);
      colours.push(c.getImageData(0, 0, 1, 1).data);
    }
    const whole = new Uint32Array(data.data.buffer), colour = colours.map((one) => new Uint32Array(one.buffer)[0]);
    for (let j = 0; j < cells.rows; j++) {
      const from = (cells.rows - 1 - j) * cells.columns;  // the softest contact at the bottom
      for (let i = 0; i < cells.columns; i++) whole[from + i] = colour[Math.max(0, cells.counts[j * cells.columns + i])];
    }
    c.putImageData(data, 0, 0);
    cells.image = image;
  };

  // One request at a time: what the hand does meanwhile is sent together once the answer is here --------------------------
  const socket = new WebSocket(`ws://${location.host}/talk`);
  let pending = null, busy = true, number = 0, follow = false;
  const say = (message) => { if (socket.readyState === WebSocket.OPEN) socket.send(JSON.stringify(message)); };
  const flush = () => {
    if (busy || !pending) return;
    busy = true;
    say({ number: ++number, ...pending });
    pending = null;
  };
  const turn = (values) => {
    pending = { ...pending, turn: { ...pending?.turn, ...values } };
    flush();
  };
  const sliders = Object.fromEntries([...document.querySelectorAll("input[type=range]")].map((one) => [one.id, one]));
  const span = (slider) => [+slider.dataset.low, +slider.dataset.high, slider.dataset.logarithmic === "1"];
  for (const [name, slider] of Object.entries(sliders)) {
    slider.addEventListener("input", () => {
      const [low, high, log] = span(slider), share = slider.value / slider.max;
      turn({ [name]: log ? low * (high / low) ** share : low + (high - low) * share });
    });
  }
  const stand = (name, value) => {
    const slider = sliders[name];
    if (!slider) return;
    const [low, high, log] = span(slider);
    slider.value = Math.round(slider.max * (log ? Math.log(value / low) / Math.log(high / low) : (value - low) / (high - low)));
  };

  // What comes back ---------------------------------------------------------------------------------------------------
  const cells = Object.fromEntries([...document.querySelectorAll("#numbers dd")].map((one) => [one.dataset.name, one]));
  const put = (element, text) => { if (element.textContent !== text) element.textContent = text; };
  const sentence = (text) => text && text[0].toUpperCase() + text.slice(1);
  const take = {
    blow(got) {
      for (const name of ["at", "ear", "mass", "stiffness"]) if (name in got) shown[name] = got[name];
      for (const [name, text] of Object.entries(got.said ?? {})) {
        if (!sliders[name]) continue;
        put($(`${name}-said`), text);
        sliders[name].setAttribute("aria-valuetext", text);
      }
      if ("note" in got) put($("note"), got.note);
      if ("failed" in got) {
        for (const cell of Object.values(cells)) put(cell, "—");
        put($("verdict"), sentence(got.failed));
        $("verdict").className = "missed";
        [shown.time, shown.force, shown.spectrum] = [[], [], []];
        spectrum.draw();
      } else if (got.force) {
        [shown.time, shown.force] = [floats(got.time), floats(got.force)];
        Object.assign(force.x, { high: shown.time.at(-1) || 1 });
        Object.assign(force.y, { high: 1.08 * shown.force.reduce((a, b) => Math.max(a, b), 0) || 1 });
        for (const [name, text] of got.cells) put(cells[name], text);
        put($("what"), got.what);
        const error = cells["estimated error"], own = cells["model's error"];
        error.className = got.exact ? (got.missed ? "missed" : "") : "later";
        own.className = got.exact ? (got.trusted || got.missed ? "" : "missed") : "later";
        if (!got.exact) put(own, "refining …");
        put($("verdict"), got.exact ? `${sentence(got.verdict)}.` : "Preview. Errors are checked when you stop.");
        $("verdict").className = got.exact && !got.trusted ? "missed" : "";
        $("model").replaceChildren(...(got.model ?? []).map((text) => Object.assign(document.createElement("li"), { textContent: sentence(text) })));
      }
      force.draw();
      root.dataset.answered = got.number;
      if (got.spectrum) take.rest(got);
      if (got.exact) root.dataset.judged = got.number;
    },
    rest(got) {
      if (got.resonates) {
        const [resonance, more] = got.resonates.split(", ");
        const cell = cells["contact resonance"];
        cell.replaceChildren(resonance, Object.assign(document.createElement("small"), { textContent: more }));
        shown.resonance = got.resonance;
        shown.limit = got.limit;
        $("scene").href = got.scene;
      }
      if (got.spectrum) {
        shown.spectrum = floats(got.spectrum);
        Object.assign(spectrum.y, { low: facts.depth * got.top, high: 2 * got.top });
      }
      spectrum.draw();
      map.draw();
      body.draw();
      if (got.kind !== "rest") return;
      if (follow) {
        stand("x", shown.at[0]);
        stand("y", shown.at[1]);
        stand("mass", shown.mass);
        stand("stiffness", shown.stiffness);
        follow = false;
      }
      root.dataset.rested = got.number;
      busy = false;
      flush();
    },
    map(got) {
      put($("computing"), got.failed ? `: ${got.failed}` : got.computing ? ", computing …" : "");
      if (got.counts) {
        map.cells = { ...got, counts: new Int8Array(bytes(got.counts).buffer), x: floats(got.x), y: floats(got.y) };
        paintMap(map.cells);
        map.draw();
        root.dataset.map = JSON.stringify([got.mass, got.stiffness, got.columns, got.exact]);
      }
    },
    note(got) { put($("note"), sentence(got.text)); },
    sound(got) {
      put($("heard"), got.note);
      const player = $("player");
      if (!got.uri) return;   // not there yet
      player.src = got.uri;
      player.play().catch(() => {});   // the browser may require another click before it plays
    },
  };
  socket.onmessage = ({ data }) => {
    const got = JSON.parse(data);
    take[got.kind](got);
    root.dataset.ready = "true";
  };
  socket.onopen = () => {
    busy = false;
    turn({});
  };
  socket.onclose = () => {
    put($("verdict"), "The connection to fem-impact has ended: start it again, then reload this page.");
    $("verdict").className = "missed";
  };
  const redress = () => {
    dress();
    if (map.cells) paintMap(map.cells);
    for (const plot of [body, map, force, spectrum]) plot.draw();
  };
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redress);

  // Hands on the pictures -----------------------------------------------------------------------------------------------
  $("listen").onclick = () => say({ play: "blow" });
  $("roll").onclick = () => say({ play: "roll" });
  body.canvas.addEventListener("click", ({ offsetX, offsetY }) => {
    const x = body.value(body.x, offsetX), y = flat ? body.value(body.y, offsetY) : 0;
    if ($("listens").checked) {
      pending = { ...pending, ear: [x, y] };
      flush();
      return;
    }
    follow = true;
    turn(flat ? { x, y } : { x });
  });

  const before = [];   // windows to go back to
  let wheeled = 0;
  const view = (x, y) => {
    const inside = ([low, high], [least, most]) => {
      [low, high] = [Math.max(Math.min(low, high), least), Math.min(Math.max(low, high), most)];
      if (high >= low * facts.narrowest) return [low, high];
      low = Math.max(least, Math.min(Math.sqrt(low * high / facts.narrowest), most / facts.narrowest));
      return [low, low * facts.narrowest];
    };
    Object.assign(map.x, ends(inside(x, facts.mass)));
    Object.assign(map.y, ends(inside(y, facts.stiffness)));
    const whole = map.x.low <= facts.mass[0] && map.x.high >= facts.mass[1] && map.y.low <= facts.stiffness[0] && map.y.high >= facts.stiffness[1];
    if (whole) before.length = 0;
    $("back").disabled = $("whole").disabled = whole;
    map.draw();   // the old map, stretched, until the new one is there
    say({ view: whole ? null : { mass: [map.x.low, map.x.high], stiffness: [map.y.low, map.y.high] } });
  };
  const now = () => [[map.x.low, map.x.high], [map.y.low, map.y.high]];
  const zoom = (factor, x, y) => {
    const narrowed = (axis, at) => [axis.low, axis.high].map((end) => at * (end / at) ** factor);
    view(narrowed(map.x, x), narrowed(map.y, y));
  };
  $("closer").onclick = () => {
    before.push(now());
    const held = (axis, at) => at >= axis.low && at <= axis.high ? at : Math.sqrt(axis.low * axis.high);
    zoom(0.5, held(map.x, shown.mass), held(map.y, shown.stiffness));
  };
  $("back").onclick = () => view(...(before.pop() ?? [facts.mass, facts.stiffness]));
  $("whole").onclick = () => view(facts.mass, facts.stiffness);
  map.canvas.addEventListener("wheel", (event) => {
    if (event.ctrlKey || (event.deltaY > 0 && $("whole").disabled)) return;   // the page may scroll
    event.preventDefault();
    if (event.timeStamp - wheeled > 500) before.push(now());
    wheeled = event.timeStamp;
    zoom(1.25 ** Math.sign(event.deltaY), map.value(map.x, event.offsetX), map.value(map.y, event.offsetY));
  }, { passive: false });
  let from = null;
  const held = ({ offsetX, offsetY }) => [
    Math.max(map.x.from, Math.min(map.x.to, offsetX)), Math.max(map.y.to, Math.min(map.y.from, offsetY)),
  ];
  map.canvas.addEventListener("pointerdown", (event) => {
    if (event.button) return;
    from = held(event);
    map.canvas.setPointerCapture(event.pointerId);
  });
  map.canvas.addEventListener("pointermove", (event) => {
    if (!from) return;
    const to = held(event);
    map.dragged = Math.max(Math.abs(to[0] - from[0]), Math.abs(to[1] - from[1])) > 6 ? [...from, ...to] : null;
    map.draw();
  });
  const drop = () => {
    from = map.dragged = null;
    map.draw();
  };
  map.canvas.addEventListener("pointerup", (event) => {
    if (!from) return;
    const [to, dragged] = [held(event), map.dragged];
    drop();
    if (dragged) {
      before.push(now());
      view([map.value(map.x, dragged[0]), map.value(map.x, dragged[2])], [map.value(map.y, dragged[1]), map.value(map.y, dragged[3])]);
    } else {
      follow = true;
      turn({ mass: map.value(map.x, to[0]), stiffness: map.value(map.y, to[1]) });
    }
  });
  map.canvas.addEventListener("pointercancel", drop);
  addEventListener("keydown", ({ key }) => { if (key === "Escape") drop(); });
})();
