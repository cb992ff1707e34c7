"use strict";
(() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const $ = (id) => document.getElementById(id);
  const canvas = $("shape"), pick = $("mode"), phase = $("phase"), play = $("play");
  const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
  const still = matchMedia("(prefers-reduced-motion: reduce)");
  let moving = !still.matches, last = 0;

  data.names.forEach((name, i) => pick.add(new Option(`Mode ${i + 1}, ${name}`, i)));

  // Draw the points from the side and above, at one moment of the swing.
  const draw = () => {
    const ratio = devicePixelRatio || 1, width = canvas.clientWidth, height = canvas.clientHeight;
    canvas.width = ratio * width;
    canvas.height = ratio * height;
    const c = canvas.getContext("2d"), size = 0.62 * Math.min(width, 1.7 * height);
    c.scale(ratio, ratio);
    const shape = data.shapes[pick.value], swing = 0.22 * Math.sin(2 * Math.PI * phase.value);
    const at = (i, moved) => {
      const [x, y] = data.points[i];
      return [width / 2 + size * (x + 0.35 * y), height / 2 - size * (0.45 * y + moved * swing * shape[i])];
    };
    const lines = (moved, stroke, thick) => {
      c.beginPath();
      for (const [i, j] of data.edges) { c.moveTo(...at(i, moved)); c.lineTo(...at(j, moved)); }
      c.strokeStyle = stroke;
      c.lineWidth = thick;
      c.stroke();
    };
    lines(0, colour("rule"), 1);
    lines(1, colour("accent"), 1.6);
    c.fillStyle = colour("ink");
    data.points.forEach((_, i) => { c.beginPath(); c.arc(...at(i, 1), 3, 0, 2 * Math.PI); c.fill(); });
    canvas.setAttribute("aria-label", `Measured shape of ${data.names[pick.value]}`);
  };

  const frame = (now) => {
    if (moving) {
      phase.value = (+phase.value + Math.min(0.1, (now - last) / 2500)) % 1;
      last = now;
      draw();
      requestAnimationFrame(frame);
    }
  };
  const start = () => {
    play.textContent = moving ? "Pause" : "Play";
    last = performance.now();
    requestAnimationFrame(moving ? frame : draw);
  };
  play.addEventListener("click", () => { moving = !moving; start(); });
  pick.addEventListener("change", draw);
  phase.addEventListener("input", () => { moving = false; start(); });
  addEventListener("resize", draw);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
  start();
})();
