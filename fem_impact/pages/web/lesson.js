(async () => {
  const { $, root, bytes, si, look, dress, bodyPlot, frequencies, forceAndSpectrum, mapPlot, drawMap, paintMap } = plots;
  const facts = JSON.parse($("facts").textContent);
  const inflate = async (text, kind) => {
    const stream = new Blob([bytes(text)]).stream().pipeThrough(new DecompressionStream("deflate"));
    return new kind(await new Response(stream).arrayBuffer());
  };
  const held = {};
  for (const name of ["resonance", "omega", "zeta", "struck", "heard", "numbers", "ends"]) held[name] = await inflate(facts[name], Float32Array);
  for (const name of ["lengths", "time", "force"]) held[name] = await inflate(facts[name], Uint16Array);
  held.met = await inflate(facts.met, Uint8Array);
  const from = new Uint32Array(held.lengths.length + 1);
  for (const [i, n] of held.lengths.entries()) from[i + 1] = from[i] + n;
  const maps = [];
  for (const one of facts.maps) maps.push({
    ...one, counts: await inflate(one.counts, Int8Array), x: await inflate(one.x, Float32Array), y: await inflate(one.y, Float32Array),
  });

  // A blow of the grid ------------------------------------------------------------------------------------------------
  const [nPlaces, nSpeeds, nStiffnesses, nMasses] = facts.shape;
  const at = Object.fromEntries(["place", "speed", "stiffness", "mass"].map((name, i) => [name, facts.start[i]]));
  const number = (p) => ((p.place * nSpeeds + p.speed) * nStiffnesses + p.stiffness) * nMasses + p.mass;
  const hertz = frequencies(facts);
  const curve = (i) => {
    const n = held.lengths[i], time = new Float64Array(n), force = new Float64Array(n);
    const [end, top] = held.ends.subarray(2 * i);
    for (let j = 0, sum = 0; j < n; j++) {
      sum += held.time[from[i] + j];
      time[j] = (sum * end) / facts.steps;
      force[j] = (held.force[from[i] + j] * top) / facts.steps;
    }
    return { time, force };
  };
  // Magnitude of the transform of straight pieces, exactly: about its middle a piece has its mean times sinc and half
  // its rise times the first spherical Bessel function.
  const magnitude = ({ time, force }, f) => {
    const w = 2 * Math.PI * f;
    let re = 0, im = 0;
    for (let j = 1; j < time.length; j++) {
      const h = time[j] - time[j - 1], sum = force[j] + force[j - 1], rise = force[j] - force[j - 1];
      if (!(h > 0) || (!sum && !rise)) continue;
      const y = 0.5 * w * h, middle = w * (time[j - 1] + 0.5 * h);
      const sinc = y < 1e-4 ? 1 : Math.sin(y) / y, bessel = y < 1e-2 ? y / 3 - y ** 3 / 30 : Math.sin(y) / y ** 2 - Math.cos(y) / y;
      const a = 0.5 * h * sum * sinc, b = -0.5 * h * rise * bessel, c = Math.cos(middle), s = Math.sin(middle);
      re += a * c + b * s;
      im += b * c - a * s;
    }
    return Math.hypot(re, im);
  };
  const blow = (p) => {
    const i = number(p), found = { ...curve(i), met: held.met[i] === 1 };
    for (const [j, name] of facts.names.entries()) found[name] = held.numbers[i * facts.names.length + j];
    found.spectrum = hertz.map((f) => magnitude(found, f));
    found.resonance = held.resonance[(p.speed * nStiffnesses + p.stiffness) * nMasses + p.mass];
    found.limit = facts.limits[p.place][p.mass];
    return found;
  };

  // The sound: each mode driven by the force, exactly where that is a straight line -------------------------------------
  const samples = (p, rate) => {
    const { time, force } = curve(number(p)), n = Math.round(facts.played * rate), out = new Float64Array(n);
    const last = time.at(-1), knots = [], drive = [];   // the points of the curve and all samples until its end
    for (let j = 0, k = 0; j < time.length || k / rate <= last;) {
      const now = j < time.length && time[j] <= k / rate ? time[j] : k / rate;
      if (k / rate > last && j >= time.length) break;
      const sample = now === k / rate ? k++ : -1, before = Math.max(1, Math.min(j, time.length - 1));
      const share = (now - time[before - 1]) / (time[before] - time[before - 1] || 1);
      knots.push([now, sample]);
      drive.push(force[before - 1] + (force[before] - force[before - 1]) * Math.min(1, Math.max(0, share)));
      if (j < time.length && time[j] === now) j++;
    }
    for (const [m, omega] of held.omega.entries()) {
      if (omega >= Math.PI * rate) continue;   // it would alias
      const decay = held.zeta[m] * omega, swing = omega * Math.sqrt(Math.max(1e-12, 1 - held.zeta[m] ** 2));
      const size = held.heard[m] * held.struck[p.place * held.omega.length + m];
      // z = p - conj(s) q with z' = s z + F and s = -decay + i swing; p = Re z + (decay / swing) ... as q = Im z / swing
      let re = 0, im = 0, next = 0;
      const put = (k) => { if (k >= 0 && k < n) out[k] += size * (re - (decay / swing) * im); };
      put(knots[0][1]);
      for (let j = 1; j < knots.length; j++) {
        const h = knots[j][0] - knots[j - 1][0], f0 = drive[j - 1], f1 = drive[j];
        const fall = Math.exp(-decay * h), c = fall * Math.cos(swing * h), s = fall * Math.sin(swing * h);
        [re, im] = [re * c - im * s, re * s + im * c];
        if (f0 || f1) {   // Gauss's three points: the force is a straight line, and h is short beside the mode's period
          for (const [x, weight] of [[-0.7745966692414834, 5 / 18], [0, 4 / 9], [0.7745966692414834, 5 / 18]]) {
            const share = 0.5 * (1 + x), rest = h * (1 - share), push = h * weight * (f0 + (f1 - f0) * share) * Math.exp(-decay * rest);
            re += push * Math.cos(swing * rest);
            im += push * Math.sin(swing * rest);
          }
        }
        put(knots[j][1]);
        if (knots[j][1] >= 0) next = knots[j][1] + 1;
      }
      const gap = next / rate - knots.at(-1)[0], fall = Math.exp(-decay / rate), c = fall * Math.cos(swing / rate), s = fall * Math.sin(swing / rate);
      const first = Math.exp(-decay * gap), c0 = first * Math.cos(swing * gap), s0 = first * Math.sin(swing * gap);
      [re, im] = [re * c0 - im * s0, re * s0 + im * c0];
      for (let k = next; k < n; k++) {
        put(k);
        [re, im] = [re * c - im * s, re * s + im * c];
      }
    }
    return out;
  };
  let context = null;
  const listen = () => {
    context ??= new AudioContext();
    context.resume();
    const heard = samples(at, context.sampleRate), peak = heard.reduce((a, b) => Math.max(a, Math.abs(b)), 0);
    const fade = Math.round(0.05 * context.sampleRate), raised = Math.max(peak / facts.full, 0.1);   // quiet sounds stay quiet, but can be heard
    const buffer = context.createBuffer(1, heard.length, context.sampleRate), data = buffer.getChannelData(0);
    for (let i = 0; i < heard.length; i++) data[i] = (0.9 * heard[i] * Math.min(1, (heard.length - i) / fade)) / facts.full / raised;
    const source = context.createBufferSource();
    source.buffer = buffer;
    source.connect(context.destination);
    source.start();
    $("heard").textContent = peak ? `Peak ${three(peak, "m/s")} at the listening point.` : "Silent: the body does not move there.";
    root.dataset.played = peak;
  };

  // What is shown -------------------------------------------------------------------------------------------------------
  dress();
  const shown = { time: [], force: [], spectrum: [] };
  const here = () => facts.places[at.place];
  const body = bodyPlot("body-plot", facts, (place) => {
    for (const one of facts.places) body.mark(...place(one), look.body);
    body.mark(...place(facts.ear), look.heard, 4);
    body.mark(...place(here()), look.struck);
  });
  const { mass, stiffness } = facts.axes;
  const map = mapPlot([mass[0], mass.at(-1)], [stiffness[0], stiffness.at(-1)], (c) => {
    drawMap(map, c, maps[at.place * nSpeeds + at.speed]);
    if (shown.kept) map.mark(map.px(mass[shown.kept.at.mass]), map.py(stiffness[shown.kept.at.stiffness]), look.body);
    map.mark(map.px(mass[at.mass]), map.py(stiffness[at.stiffness]), look.struck);
  });
  const [force, spectrum, fit] = forceAndSpectrum(facts, shown);
  const cells = Object.fromEntries([...document.querySelectorAll("#numbers dd")].map((one) => [one.dataset.name, one]));
  const sliders = Object.fromEntries([...document.querySelectorAll("input[type=range]")].map((one) => [one.id, one]));
  const three = (value, unit) => Number.isFinite(value) ? si(value, unit, Math.abs(value) / 10) : "—";
  const show = () => {
    const found = blow(at), failed = Number.isNaN(found.n_impacts);
    Object.assign(shown, found);
    for (const [name, slider] of Object.entries(sliders)) {
      slider.value = at[name];
      $(`${name}-said`).textContent = JSON.parse(slider.dataset.said)[at[name]];
      slider.setAttribute("aria-valuetext", $(`${name}-said`).textContent);
    }
    const said = {
      "impacts": failed ? "—" : String(found.n_impacts), "peak force": three(found.peak_force, "N"), "contact time": three(found.contact_time, "s"),
      "restitution": three(found.restitution, "").replace("-", "−"), "contact resonance": three(found.resonance, "Hz"),
      "estimated error": failed ? "failed" : found.error === Infinity ? "not resolvable" : found.error > 0 ? found.error.toExponential(0).replace("-", "−") : "0",
    };
    for (const [name, text] of Object.entries(said)) cells[name].textContent = text;
    cells["estimated error"].className = found.met ? "" : "missed";
    $("said").textContent = found.met ? "" : failed ? "This blow failed." : "This blow misses its tolerance: trust neither its last digits nor the number of its impacts.";
    fit([found, ...[shown.kept ?? []].flat()]);
    for (const plot of [body, map, force, spectrum]) plot.draw();
    root.dataset.shown = number(at);
  };
  const turn = (change) => {
    Object.assign(at, change);
    show();
  };
  for (const [name, slider] of Object.entries(sliders)) slider.addEventListener("input", () => turn({ [name]: +slider.value }));
  const nearest = (values, distance) => values.map(distance).reduce((best, one, i, all) => (one < all[best] ? i : best), 0);
  map.canvas.addEventListener("click", ({ offsetX, offsetY }) => turn({
    mass: nearest(mass, (one) => Math.abs(map.px(one) - offsetX)), stiffness: nearest(stiffness, (one) => Math.abs(map.py(one) - offsetY)),
  }));
  body.canvas.addEventListener("click", ({ offsetX, offsetY }) => turn({
    place: nearest(facts.places, ([x, y]) => Math.hypot(body.px(x) - offsetX, body.py(y ?? 0) - offsetY)),
  }));
  const read = (plot, name, say) => plot.canvas.addEventListener("pointermove", ({ offsetX, offsetY }) => {
    $(name).textContent = say(plot.value(plot.x, offsetX), plot.value(plot.y, offsetY));
  });
  read(force, "force-read", (t, f) => `${three(t, "s")}, ${three(f, "N")}`);
  read(spectrum, "spectrum-read", (f) => `${three(f, "Hz")}: ${three(magnitude(shown, f), "N s")}`);
  $("listen").onclick = listen;
  $("keep").onclick = () => {
    shown.kept = shown.kept ? null : { ...blow(at), at: { ...at } };
    $("keep").textContent = shown.kept ? "Forget the kept" : "Keep to compare";
    $("kept-legend").hidden = !shown.kept;
    show();
  };
  for (const button of document.querySelectorAll("[data-position]")) button.onclick = () => {
    const [place, speed, stiffness, mass] = button.dataset.position.split(" ").map(Number);
    turn({ place, speed, stiffness, mass });
    $("blow").scrollIntoView();
  };
  const printed = (open) => {
    for (const one of document.querySelectorAll(".worksheet details")) one.open = open;
    window.print();
  };
  $("print").onclick = () => printed(false);
  $("print-answers").onclick = () => printed(true);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
    dress();
    maps.forEach(paintMap);
    show();
  });
  maps.forEach(paintMap);
  show();
  root.lesson = { at, blow, samples };   // for tests, and for those who are curious
  root.dataset.ready = "true";
})();
