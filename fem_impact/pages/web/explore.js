"use strict";
(() => {
  const { $, root, bytes, floats, look, dress, ends, bodyPlot, forceAndSpectrum, mapPlot, drawMap, paintMap } = plots;
  const facts = JSON.parse($("facts").textContent);

  dress();
  const shown = { at: null, ear: null, time: [], force: [], spectrum: [] };
  const body = bodyPlot("body-plot", null, (place) => {
    if (!shown.at) return;
    for (const { at, body: of, colour, letter } of kept.values()) {
      if (of !== `${facts.picks.drawing} ${facts.picks.unit}`) continue;
      body.mark(...place(at), colour);
      body.context.fillStyle = look.ink;
      body.context.textAlign = "left";
      body.context.fillText(letter, place(at)[0] + 10, place(at)[1] - 8);
    }
    body.mark(...place(shown.ear), look.heard, 4);
    body.mark(...place(shown.at), look.struck);
  });

  const kept = new Map();   // letter -> blow
  const COLOURS = ["#d55e00", "#009e73", "#cc79a7", "#b8860b", "#7e57c2", "#8d6e63", "#e64980", "#868e96"];
  const map = mapPlot([1, 10], [1, 10], (c) => {
    if (map.cells) drawMap(map, c, map.cells);
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
  const [force, spectrum, fit] = forceAndSpectrum(facts, shown);

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
    stale();
    pending = { ...pending, turn: { ...pending?.turn, ...values } };
    flush();
  };
  let sliders = {};
  const span = (slider) => [+slider.dataset.low, +slider.dataset.high, slider.dataset.logarithmic === "1"];
  const made = (kind, values, ...parts) => {
    const element = Object.assign(document.createElement(kind), values);
    element.append(...parts);
    return element;
  };
  const sliderOf = ({ name, label, low, high, step, logarithmic }) => {
    const slider = made("input", { type: "range", id: name, min: 0, max: facts.steps, autocomplete: "off" });
    slider.setAttribute("value", step);
    Object.assign(slider.dataset, { low, high, logarithmic: +logarithmic });
    slider.addEventListener("input", () => {
      const share = slider.value / slider.max;
      turn({ [name]: logarithmic ? low * (high / low) ** share : low + (high - low) * share });
    });
    sliders[name] = slider;
    const said = made("output", { id: `${name}-said` });
    said.htmlFor.add(name);
    return made("div", { className: "slider" }, made("label", { htmlFor: name, textContent: label }), said, slider);
  };
  const stand = (name, value) => {
    const slider = sliders[name];
    if (!slider) return;
    const [low, high, log] = span(slider);
    slider.value = Math.round(slider.max * (log ? Math.log(value / low) / Math.log(high / low) : (value - low) / (high - low)));
  };

  // Sounds ------------------------------------------------------------------------------------------------------------
  let context = null;
  const heard = new Map();   // sounds of the present blow, and by letter and share of the speed
  const waiting = new Set();
  const forget = (letter) => { for (const key of [...heard.keys()]) if ((key[0] ?? " ") === letter) heard.delete(key); };
  let asking = false;   // for the sound of the present blow
  const stale = () => {   // the present blow is another one
    forget(" ");
    asking = false;
  };
  // As loud to each other as the program computed them, the loudest of the blows in question at a quarter of full scale.
  const volume = ({ unit, scale, peak }) => {
    const sounds = [heard.get(""), ...[...kept.values()].map(({ sound }) => sound)];
    return (0.25 * scale) / (Math.max(0, ...sounds.filter((one) => one?.uri && one.unit === unit).map((one) => one.peak)) || peak || 1);
  };
  const ring = async (sound, after = 0) => {
    if (!sound?.uri || !navigator.userActivation?.hasBeenActive) return;
    context ??= new AudioContext();
    if (context.state === "suspended") context.resume();
    sound.buffer ??= context.decodeAudioData(bytes(sound.uri.slice(sound.uri.indexOf(",") + 1)).buffer);
    const source = context.createBufferSource(), gain = context.createGain();
    source.buffer = await sound.buffer;
    gain.gain.value = volume(sound);
    source.connect(gain).connect(context.destination);
    source.start(context.currentTime + after);
    root.dataset.rung = +(root.dataset.rung ?? 0) + 1;
  };
  const strike = () => {
    if (heard.has("")) return ring(heard.get(""));
    asking = true;
    say({ play: "blow" });
  };
  const hit = (letter, share) => {
    const key = `${letter} ${share}`;
    const known = heard.get(key) ?? (share === 1 ? kept.get(letter)?.sound : null);
    if (known) ring(known);
    else if (!waiting.has(key)) {
      waiting.add(key);
      say({ hit: { letter, share } });
    }
  };
  const nth = (i) => {   // the kept blow of a key or a note, round and round
    const letters = [...kept.keys()].sort();
    return letters.length ? letters[((i % letters.length) + letters.length) % letters.length] : "";
  };

  // Blows kept to compare -------------------------------------------------------------------------------------------------
  const reach = () => fit([shown, ...kept.values()]);
  const compare = () => {
    const blows = [...kept.values()].sort((a, b) => (a.letter < b.letter ? -1 : 1));
    shown.kept = blows;
    $("kept").replaceChildren(...blows.map(({ letter, heading, words, cells: numbers, sound, colour }) => {
      const mark = made("b", { textContent: letter });
      mark.style.color = colour;
      const play = made("button", { type: "button", textContent: `Play ${letter}`, disabled: !sound.uri, onclick: () => hit(letter, 1) });
      const away = made("button", { type: "button", className: "quiet", textContent: `Forget ${letter}`, onclick: () => say({ forget: letter }) });
      const list = numbers.map(([name, text]) => made("div", {}, made("dt", { textContent: name }), made("dd", { textContent: text })));
      return made("article", {}, made("h3", {}, mark, ` ${heading}`), made("p", { className: "note", textContent: words }), made("dl", {}, ...list), made("div", { className: "buttons" }, play, away));
    }));
    $("turns").disabled = blows.length < 2;
    put($("turns"), blows.length > 2 ? blows.map((one) => one.letter).join(" then ") : "A then B");
    root.dataset.kept = blows.map((one) => one.letter).join("");
    reach();
    for (const plot of [force, spectrum, body]) plot.draw();
  };
  $("keep").onclick = () => say({ keep: true });
  $("turns").onclick = () => shown.kept.forEach(({ sound }, i) => ring(sound, 1.2 * i));   // each has rung for a second

  // Keys and MIDI ---------------------------------------------------------------------------------------------------------
  const ROWS = [["zxcvbnm,", 0.5], ["asdfghjk", 1], ["qwertyui", 2]];
  addEventListener("keydown", (event) => {
    const { key, target, repeat, ctrlKey, altKey, metaKey } = event;
    if (repeat || ctrlKey || altKey || metaKey || target.matches("select, input:not([type=range], [type=radio], [type=checkbox])")) return;
    if (key === " ") {
      if (target.matches("button, a, audio, [type=radio], [type=checkbox]")) return;   // it presses these
      event.preventDefault();
      strike();
    }
    for (const [row, share] of ROWS) if (row.includes(key.toLowerCase())) hit(nth(row.indexOf(key.toLowerCase())), share);
  });
  $("midi").onclick = async () => {
    if (!navigator.requestMIDIAccess) {
      put($("midi-said"), "This browser has no Web MIDI. Chrome, Edge and Firefox have; or play by `fem-impact play SCENE --midi-port`.");
      return;
    }
    try {
      const access = await navigator.requestMIDIAccess(), inputs = [...access.inputs.values()];
      for (const input of inputs) {
        input.onmidimessage = ({ data: [status, note, velocity] }) => {
          // sixteen steps, so that a sound once computed sounds at once; the hardest is twice as fast as the blow
          if ((status & 0xf0) === 0x90 && velocity) hit(nth(note - 60), Math.ceil((velocity / 127) * 16) / 8);
        };
      }
      const names = inputs.map(({ name }) => name).join(", ");
      put($("midi-said"), names ? `Listening to ${names}: middle C strikes A, the next keys B, C …; velocity is speed.` : "No MIDI keyboard is connected: connect one and press again.");
    } catch (error) {
      put($("midi-said"), `The browser does not allow MIDI: ${error.message}`);
    }
  };

  // What comes back ---------------------------------------------------------------------------------------------------
  const before = [];   // windows of the map to go back to
  const cells = Object.fromEntries([...document.querySelectorAll("#numbers dd")].map((one) => [one.dataset.name, one]));
  const put = (element, text) => { if (element.textContent !== text) element.textContent = text; };
  const sentence = (text) => text && text[0].toUpperCase() + text.slice(1);
  const take = {
    setup(got) {
      Object.assign(facts, got);
      Object.assign(shown, { at: got.at, ear: got.ear, time: [], force: [], spectrum: [], mass: null, resonance: null, limit: null });
      document.title = $("heading").textContent = got.heading;
      put($("notes"), got.notes.map((one) => `${one}.`).join(" "));
      sliders = {};
      for (const [card, list] of Object.entries(got.cards)) $(`sliders-${card}`).replaceChildren(...list.map(sliderOf));
      body.show(facts);
      Object.assign(map.x, ends(facts.mass));
      Object.assign(map.y, ends(facts.stiffness));
      map.cells = null;
      before.length = 0;
      $("back").disabled = $("whole").disabled = true;
      for (const plot of [body, map]) plot.draw();
      pick(got.picks);
      [busy, pending] = [false, null];
      turn({});
    },
    bench(got) {
      put($("bench-said"), got.failed ? `${got.failed}.` : "Computing the modes …");
      $("bench-said").className = got.failed ? "note missed" : "note";
      root.dataset.bench = got.failed ? "failed" : "busy";
    },
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
        reach();
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
      if (!got.exact) return;
      root.dataset.judged = got.number;
      if ($("aloud").checked && navigator.userActivation?.hasBeenActive && !heard.has("") && !asking) strike();
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
        reach();
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
      if (asking) heard.set("", got);   // neither a roll, nor the sound of a blow before
      asking = false;
      ring(got);
    },
    hit(got) {
      const key = `${got.letter} ${got.share}`;
      waiting.delete(key);
      if (!got.uri) { put($("heard"), got.note); return; }
      if (got.letter ? kept.has(got.letter) : got.number === number && !pending) heard.set(key, got);
      ring(got);
    },
    kept(got) {
      const blow = { ...got, time: floats(got.time), force: floats(got.force), spectrum: floats(got.spectrum) };
      blow.colour = COLOURS[got.letter.charCodeAt(0) - 65];
      kept.set(got.letter, blow);
      compare();
    },
    forgotten(got) {
      kept.delete(got.letter);
      forget(got.letter);
      compare();
    },
  };
  socket.onmessage = ({ data }) => {
    const got = JSON.parse(data);
    take[got.kind](got);
    if (got.kind === "rest") root.dataset.ready = "true";
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

  // What lies on the bench ------------------------------------------------------------------------------------------------
  const order = (wanted) => say({ open: wanted });
  const options = (select, first, groups, picked, words = "") => {
    const wanted = words.toLowerCase().split(/[\s,]+/);
    const fits = (group, name) => name === picked || wanted.every((word) => `${group} ${name}`.toLowerCase().includes(word));
    const option = (name) => made("option", { value: name, textContent: name, selected: name === picked });
    const kept = groups.map(([group, names]) => [group, names.filter((name) => fits(group, name))]).filter(([, names]) => names.length);
    select.replaceChildren(
      made("option", { value: "", textContent: first, selected: !picked }),
      ...kept.map(([group, names]) => made("optgroup", { label: group }, ...names.map(option))),
    );
  };
  const lists = { material: ["materials", "as in the scene"], mallet: ["mallets", "as in the scene"] };
  const pick = (picks) => {
    facts.picks = picks;
    for (const [name, [key, first]] of Object.entries(lists)) {
      options($(`pick-${name}`), first, picks[key], picks[name], $(`search-${name}`).value);
      $(`of-${name}`).hidden = !picks[key].length;
    }
    options($("pick-unit"), "as the file says", [["unit", picks.units]], picks.unit);
    $("of-unit").hidden = !picks.units.length;
    $("of-thickness").hidden = picks.thickness === null;
    $("pick-thickness").value = picks.thickness === null ? "" : +picks.thickness.toPrecision(6);
    put($("drawing"), picks.drawing ? `On the bench: ${picks.drawing}` : "");
    $("first").hidden = !picks.drawing || !picks.first;
    put($("first"), `Back to “${picks.first}”`);
    put($("bench-said"), "");
    root.dataset.bench = JSON.stringify([picks.drawing, picks.material, picks.mallet, picks.thickness]);
  };
  for (const name of ["material", "mallet", "unit"]) $(`pick-${name}`).onchange = ({ target }) => order({ [name]: target.value });
  for (const [name, [key, first]] of Object.entries(lists)) {
    $(`search-${name}`).oninput = ({ target }) => options($(`pick-${name}`), first, facts.picks[key], facts.picks[name], target.value);
  }
  $("pick-thickness").onchange = ({ target }) => order({ thickness: +target.value });
  $("first").onclick = () => order({ drawing: "" });
  const drop = async (file) => {
    if (!file) return;
    take.bench({});
    try {
      const answer = await fetch(`/drop?name=${encodeURIComponent(file.name)}`, { method: "POST", body: file });
      const text = await answer.text();
      if (answer.ok) order({ drawing: text, unit: "" });
      else take.bench({ failed: answer.status === 400 && text.length < 400 && !text.startsWith("<") ? text : `${file.name} was refused (${answer.status})` });
    } catch {
      take.bench({ failed: `${file.name} could not be handed over: it has ${(file.size / 1e6).toPrecision(3)} MB, at most ${facts.largest / 1e6} MB are taken` });
    }
  };
  $("file").onchange = ({ target }) => {
    drop(target.files[0]);
    target.value = "";   // the same file again is another choice
  };
  for (const kind of ["dragover", "dragleave", "drop"]) {
    addEventListener(kind, (event) => {
      event.preventDefault();
      $("drop").classList.toggle("over", kind === "dragover");
      if (kind === "drop") drop(event.dataTransfer.files[0]);
    });
  }

  // Hands on the pictures -----------------------------------------------------------------------------------------------
  $("listen").onclick = strike;
  $("roll").onclick = () => {
    asking = false;
    say({ play: "roll" });
  };
  let dragged = null;   // which point the hand holds
  const near = (point, { offsetX, offsetY }) => Math.hypot(body.px(point[0]) - offsetX, body.py(point[1] ?? 0) - offsetY);
  body.canvas.addEventListener("pointerdown", (event) => {
    if (event.button || !shown.at) return;
    dragged = $("listens").checked ? "ear" : "at";
    const other = dragged === "at" ? "ear" : "at";
    if (near(shown[other], event) < 12 && near(shown[dragged], event) > 12) dragged = other;
    body.canvas.setPointerCapture(event.pointerId);
    moved(event);
  });
  body.canvas.addEventListener("pointermove", (event) => { if (dragged) moved(event); });
  for (const kind of ["pointerup", "pointercancel"]) body.canvas.addEventListener(kind, () => { dragged = null; });
  const moved = ({ offsetX, offsetY }) => {
    const x = body.value(body.x, offsetX), y = body.flat ? body.value(body.y, offsetY) : 0;
    if (dragged === "ear") {
      stale();
      pending = { ...pending, ear: [x, y] };
      flush();
      return;
    }
    follow = true;
    turn(body.flat ? { x, y } : { x });
  };

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
  const letGo = () => {
    from = map.dragged = null;
    map.draw();
  };
  map.canvas.addEventListener("pointerup", (event) => {
    if (!from) return;
    const [to, dragged] = [held(event), map.dragged];
    letGo();
    if (dragged) {
      before.push(now());
      view([map.value(map.x, dragged[0]), map.value(map.x, dragged[2])], [map.value(map.y, dragged[1]), map.value(map.y, dragged[3])]);
    } else {
      follow = true;
      turn({ mass: map.value(map.x, to[0]), stiffness: map.value(map.y, to[1]) });
    }
  });
  map.canvas.addEventListener("pointercancel", letGo);
  addEventListener("keydown", ({ key }) => { if (key === "Escape") letGo(); });
})();
