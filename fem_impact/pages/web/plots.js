"use strict";
// What the pages with sliders share: numbers with their units, and plots on canvases.
const plots = (() => {
  const $ = (id) => document.getElementById(id);
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
        .map(([value, step]) => [value, si(value * (axis.times ?? 1), axis.unit, step * (axis.times ?? 1))]);
      const rows = ticks(y, 5);
      const left = Math.max(y.hidden ? 0 : 30, ...rows.map(([, text]) => c.measureText(text).width)) + (y.hidden ? 10 : 8) + (y.label ? 18 : 0);
      Object.assign(x, { from: left, to: wide - 14 });
      Object.assign(y, { from: tall - (x.label ? 40 : 24), to: 10 });
      if (this.square) this.square();
      const columns = ticks(x, (x.to - x.from) / (x.times ? 45 : 75));
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

  const ends = ([low, high]) => ({ low, high });
  // The body: lengths alike along both axes, some room around; `marks` draws what lies on it.
  const bodyPlot = (id, facts, marks) => {
    let loops = [], ribs = [], flat, left, right, low, high;
    const axis = (label) => ({ low: 0, high: 1, unit: "", times: 1000, label: `${label} in mm` });
    const body = new Plot(id, axis("x"), axis("y"), (c) => {
      c.beginPath();
      for (const loop of loops) {
        for (const [i, [x, y]] of loop.entries()) c[i ? "lineTo" : "moveTo"](body.px(x), body.py(y));
        c.closePath();
      }
      c.fillStyle = look.body;
      c.strokeStyle = look.edge;
      c.lineWidth = flat ? 2 : 8;
      c.fill("evenodd");
      c.stroke();
      c.beginPath();
      for (const [from, to] of ribs.flat()) {
        c.moveTo(body.px(from[0]), body.py(from[1]));
        c.lineTo(body.px(to[0]), body.py(to[1]));
      }
      c.stroke();
      marks(([x, y]) => [body.px(x), body.py(y ?? 0)]);
    });
    body.show = (shape) => {
      ({ loops, ribs } = shape);
      const corners = loops.flat();
      const reach = (i) => corners.map((one) => one[i]).reduce(([a, b], one) => [Math.min(a, one), Math.max(b, one)], [Infinity, -Infinity]);
      [left, right] = reach(0);
      body.flat = flat = corners.some((one) => one[1] !== corners[0][1]);
      [low, high] = flat ? reach(1) : [-0.1 * (right - left), 0.1 * (right - left)];
      body.y.hidden = !flat;
      body.y.label = flat ? "y in mm" : "";
    };
    if (facts) body.show(facts);
    body.square = () => {
      if (!loops.length) return;
      const { x, y } = body, wide = x.to - x.from, tall = y.from - y.to;
      const scale = Math.max((right - left) / wide, (high - low) / tall) * 1.08;
      Object.assign(x, { low: 0.5 * (left + right - wide * scale), high: 0.5 * (left + right + wide * scale) });
      Object.assign(y, { low: 0.5 * (low + high - tall * scale), high: 0.5 * (low + high + tall * scale) });
    };
    return body;
  };

  // Force over time and its spectrum, with those of `shown.kept` dashed.
  const frequencies = ({ band: [low, high], points }) => Array.from({ length: points }, (_, i) => low * (high / low) ** (i / (points - 1)));
  const forceAndSpectrum = (facts, shown) => {
    const both = (c, draw) => {
      c.lineWidth = 2;
      c.setLineDash([6, 4]);
      for (const kept of [shown.kept ?? []].flat()) {
        c.strokeStyle = kept.colour ?? look.struck;
        draw(kept);
      }
      c.setLineDash([]);
      c.strokeStyle = look.line;
      draw(shown);
    };
    const force = new Plot("force-plot", { low: 0, high: 1, unit: "s" }, { low: 0, high: 1, unit: "N" }, (c) => {
      both(c, ({ time, force: values }) => force.curve(time, values));
    });
    const hertz = frequencies(facts);
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
        both(c, ({ spectrum: values }) => spectrum.curve(hertz, values));
      });
    const most = (list) => list.reduce((a, b) => Math.max(a, b), 0);
    const fit = (blows) => {   // axes that hold all of some blows
      force.x.high = most(blows.map((one) => one.time.at(-1) ?? 0)) || 1;
      force.y.high = 1.08 * most(blows.map((one) => most(one.force))) || 1;
      const top = most(blows.map((one) => most(one.spectrum))) || 1;
      Object.assign(spectrum.y, { low: facts.depth * top, high: 2 * top });
    };
    return [force, spectrum, fit];
  };

  const mapPlot = (mass, stiffness, paint) => new Plot(
    "map-plot", { ...ends(mass), log: true, unit: "kg", label: "mass of the striker" },
    { ...ends(stiffness), log: true, unit: "", label: "stiffness over the scene's" }, paint);
  // Numbers of impacts as pixels, each point in the middle of one, and the threshold.
  const drawMap = (map, c, cells) => {
    const [x0, x1] = cells.mass.map((one) => map.px(one)), [y0, y1] = cells.stiffness.map((one) => map.py(one));
    const wide = (x1 - x0) / (cells.columns - 1), tall = (y0 - y1) / (cells.rows - 1);
    c.imageSmoothingEnabled = false;
    c.drawImage(cells.image, x0 - 0.5 * wide, y1 - 0.5 * tall, x1 - x0 + wide, y0 - y1 + tall);
    c.setLineDash([7, 5]);
    c.strokeStyle = look.over;
    c.lineWidth = 2;
    map.curve(cells.x, cells.y);
    c.setLineDash([]);
  };
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

  return { $, root, bytes, floats, si, look, dress, Plot, ends, bodyPlot, frequencies, forceAndSpectrum, mapPlot, drawMap, paintMap };
})();
