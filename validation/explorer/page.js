"use strict";
// The page: what the controls say is drawn. `data` stands before this script, see page.py.

const explorer = (() => {
  const byId = (id) => document.getElementById(id);
  const NAMES = ["gamma", "sigma", "n", "kd", "theta", "masking"];
  const ANGLES = data.traced.theta_o;
  // Lines differ in their dashes and points in their shapes, not by colour alone.
  const LINES = [
    { key: "total", name: "theory, specular and body", colour: "#000000", dash: "" },
    { key: "specular", name: "theory, specular", colour: "#b34700", dash: "7 4" },
    { key: "body", name: "theory, body", colour: "#0072b2", dash: "2 3" },
  ];
  const POINTS = [
    { key: "all", name: "traced, all orders", colour: "#000000", shape: "diamond" },
    { key: "specular", name: "traced, order-1 specular", colour: "#b34700", shape: "square" },
    { key: "body", name: "traced, order-1 body", colour: "#0072b2", shape: "circle" },
  ];
  let cursor = 60, shown = null;

  // The slider of γ walks along a list, that of others is the value itself.
  function settings() {
    const values = { gamma: data.gammas[byId("gamma").value] };
    for (const name of ["sigma", "n", "kd", "theta"]) values[name] = Number(byId(name).value);
    return { ...values, masking: byId("masking").value };
  }

  function set(values) {
    for (const name of NAMES.filter((name) => name in values)) {
      const k = data.gammas.indexOf(Number(values.gamma));
      if (name !== "gamma") byId(name).value = values[name];
      else if (k >= 0) byId("gamma").value = k;
    }
    update();
  }

  function tracedSet(at) {
    return data.traced.sets.find((s) => ["gamma", "sigma", "n", "theta"].every((k) => s[k] === at[k]));
  }

  // Mean and half width of the 95 % interval over surfaces of a sum over body events of w^b f.
  function overSurfaces(surfaces, weights) {
    const { student } = data.traced, count = surfaces.length;
    const values = surfaces.map((events) =>
      ANGLES.map((_, k) => events.reduce((sum, f, b) => sum + weights[b] * f[k], 0)));
    const mean = ANGLES.map((_, k) => values.reduce((sum, v) => sum + v[k], 0) / count);
    const band = mean.map((m, k) => {
      const squares = values.reduce((sum, v) => sum + (v[k] - m) ** 2, 0);
      return student * Math.sqrt(squares / (count * (count - 1)));
    });
    return { mean, band };
  }

  function tracedAt(at) {
    const one = tracedSet(at);
    if (!one) return null;
    const w = theory.bodyWeight(at.n, at.kd);
    const powers = one.all_orders[0].map((_, b) => w ** b);
    return {
      specular: overSurfaces(one.order_one, [1, 0]),
      body: overSurfaces(one.order_one, [0, w]),
      all: overSurfaces(one.all_orders, powers),
    };
  }

  const digits = (value) => (value === 0 ? "0" : Number(value.toPrecision(3)).toString());
  const element = (name, attributes, text = "") => {
    const shown = Object.entries(attributes).map(([k, v]) => `${k}="${v}"`).join(" ");
    return `<${name} ${shown}>${text}</${name}>`;
  };

  function mark(shape, x, y, colour) {
    const look = { fill: "none", stroke: colour, "stroke-width": 1.2 };
    if (shape === "circle") return element("circle", { cx: x, cy: y, r: 3, ...look });
    const d = shape === "square" ? "-2.7,-2.7 5.4,0 0,5.4 -5.4,0" : "0,-3.8 3.4,3.8 -3.4,3.8 -3.4,-3.8";
    return element("path", { d: `M${x},${y}m${d.split(" ").join("l")}z`, ...look });
  }

  // Axes, lines and points as SVG, at the size that the page has for them.
  function plot() {
    const width = Math.max(280, byId("plot").clientWidth), narrow = width < 520;
    const height = narrow ? 220 : 400;
    const [left, right, top, bottom] = [52, width - 10, 10, height - 42];
    const logarithmic = byId("scale").value === "log";
    const peak = Math.max(...shown.lobes.total, ...(shown.traced ? shown.traced.all.mean : [0]));
    const ceiling = peak * (logarithmic ? 1.6 : 1.08), floor = logarithmic ? peak * 1e-3 : 0;
    const x = (angle) => left + ((angle + 90) / 180) * (right - left);
    const part = (v) => (logarithmic
      ? Math.log(Math.max(v, 1e-30) / floor) / Math.log(ceiling / floor) : v / ceiling);
    const y = (v) => Math.min(height, Math.max(-height, bottom - part(v) * (bottom - top)));
    const out = [];
    for (let angle = -90; angle <= 90; angle += 30) {
      out.push(element("line", { x1: x(angle), x2: x(angle), y1: top, y2: bottom, stroke: "#ddd" }));
      out.push(element("text", { x: x(angle), y: bottom + 15, "text-anchor": "middle" }, `${angle}°`));
    }
    for (const v of ticks(floor, ceiling, logarithmic)) {
      out.push(element("line", { x1: left, x2: right, y1: y(v), y2: y(v), stroke: "#ddd" }));
      out.push(element("text", { x: left - 5, y: y(v) + 4, "text-anchor": "end" }, digits(v)));
    }
    out.push(element("text", { x: (left + right) / 2, y: height - 6, "text-anchor": "middle" },
      narrow ? "θ_o, mirror side positive" : "detector θ_o in the plane of incidence, mirror side positive"));
    out.push(element("text", { transform: `translate(12 ${(top + bottom) / 2}) rotate(-90)`, "text-anchor": "middle" },
      "BRDF (1/sr)"));
    const inside = [];
    const at = shown.settings.theta;
    inside.push(element("line", { x1: x(at), x2: x(at), y1: top, y2: bottom, stroke: "#666", "stroke-dasharray": "1 4" }));
    if (shown.traced) {
      POINTS.forEach(({ key, colour, shape }) => {
        const { mean, band } = shown.traced[key];
        const edge = (sign) => ANGLES.map((a, k) => `${x(a)},${y(mean[k] + sign * band[k])}`);
        inside.push(element("polygon", { points: [...edge(1), ...edge(-1).reverse()].join(" "), fill: colour, opacity: 0.2 }));
        const every = narrow ? 5 : 3;
        ANGLES.forEach((a, k) => k % every === 0 && mean[k] > 0 && inside.push(mark(shape, x(a), y(mean[k]), colour)));
      });
    }
    for (const { key, colour, dash } of LINES) {
      const points = ANGLES.map((a, k) => `${x(a)},${y(shown.lobes[key][k])}`).join(" ");
      inside.push(element("polyline", { points, fill: "none", stroke: colour, "stroke-width": 1.8, "stroke-dasharray": dash, "data-line": key }));
    }
    inside.push(element("line", { x1: x(cursor), x2: x(cursor), y1: top, y2: bottom, stroke: "#000", "stroke-width": 1 }));
    const clip = element("clipPath", { id: "inside" },
      element("rect", { x: left, y: top, width: right - left, height: bottom - top }));
    byId("plot").innerHTML = element("svg",
      { width, height, viewBox: `0 0 ${width} ${height}`, role: "img", "aria-labelledby": "reading" },
      clip + out.join("") + element("g", { "clip-path": "url(#inside)" }, inside.join("")) +
      element("path", { d: `M${left},${top}V${bottom}H${right}`, fill: "none", stroke: "#111" }));
    byId("legend").innerHTML = [
      ...LINES.map(({ name, colour, dash }) => [name, element("line",
        { x1: 0, x2: 34, y1: 6, y2: 6, stroke: colour, "stroke-width": 1.8, "stroke-dasharray": dash })]),
      ...(shown.traced ? POINTS.map(({ name, colour, shape }) => [name,
        element("rect", { width: 34, height: 12, fill: colour, opacity: 0.2 }) + mark(shape, 17, 6, colour)]) : []),
    ].map(([name, sample]) => element("li", {},
      element("svg", { width: 34, height: 12, "aria-hidden": "true" }, sample) + name)).join("");
  }

  function ticks(floor, ceiling, logarithmic) {
    const step = 10 ** Math.floor(Math.log10(ceiling / 2));
    if (!logarithmic) {
      const wide = ceiling / step > 8 ? 5 * step : ceiling / step > 4 ? 2 * step : step;
      return Array.from({ length: Math.floor(ceiling / wide) + 1 }, (_, k) => k * wide);
    }
    const first = Math.ceil(Math.log10(floor)), last = Math.floor(Math.log10(ceiling));
    return Array.from({ length: last - first + 1 }, (_, k) => 10 ** (first + k));
  }

  // The lobes in words, for those who read off a value and those who hear the page.
  function read() {
    cursor = Number(byId("cursor").value);
    const k = ANGLES.reduce((best, a, j) => (Math.abs(a - cursor) < Math.abs(ANGLES[best] - cursor) ? j : best), 0);
    const { lobes, traced } = shown;
    let words = `At θ_o = ${ANGLES[k]}° the theory of order 1 gives ${digits(lobes.total[k])}/sr: `
      + `specular ${digits(lobes.specular[k])}, body ${digits(lobes.body[k])}.`;
    if (traced) {
      const value = (of) => `${digits(of.mean[k])} ± ${digits(of.band[k])}`;
      words += ` Traced: specular ${value(traced.specular)}, body ${value(traced.body)}, `
        + `all orders ${value(traced.all)} (95 %).`;
    }
    byId("reading").textContent = words;
    byId("cursor-value").textContent = `${ANGLES[k]}°`;
  }

  function table() {
    const columns = ["θ_o (°)", "specular", "body", "total"];
    if (shown.traced) columns.push("traced specular", "traced body", "traced, all orders");
    const cell = (of, k) => `${digits(of.mean[k])} ± ${digits(of.band[k])}`;
    const rows = ANGLES.map((a, k) => [a, ...["specular", "body", "total"].map((key) => digits(shown.lobes[key][k])),
      ...(shown.traced ? ["specular", "body", "all"].map((key) => cell(shown.traced[key], k)) : [])])
      .filter(([a]) => a % 10 === 0);
    byId("table").innerHTML = element("caption", {}, "BRDF in 1/sr, every 10°; ± 95 %")
      + element("thead", {}, element("tr", {}, columns.map((c) => element("th", { scope: "col" }, c)).join("")))
      + element("tbody", {}, rows.map(([a, ...cells]) => element("tr", {},
        element("th", { scope: "row" }, a) + cells.map((c) => element("td", {}, c)).join(""))).join(""));
  }

  function say(at) {
    const named = at.gamma === 2 ? " (GGX)" : at.gamma === 100 ? " (nearly Beckmann)" : "";
    for (const [name, text] of [
      ["gamma", `${at.gamma}${named}`], ["sigma", at.sigma], ["n", at.n], ["kd", at.kd], ["theta", `${at.theta}°`],
    ]) {
      byId(`${name}-value`).textContent = text;
      byId(name).setAttribute("aria-valuetext", text);
    }
    byId("preset").value = tracedSet(at) ? data.traced.sets.indexOf(tracedSet(at)) : "";
    byId("has-traced").textContent = tracedSet(at)
      ? `Points are traced on ${data.traced.surfaces} surfaces of ${data.traced.cells}² cells, with 95 % bands over them.`
      : "No surface was traced at these values: choose a traced set to see points.";
  }

  function update() {
    const at = settings();
    shown = { settings: at, lobes: theory.lobesInBins(at, ANGLES), traced: tracedAt(at) };
    say(at);
    read();
    plot();
    table();
    const range = relief.draw(byId("relief"), data.tiles, data.side, at);
    const words = `Surface of γ = ${at.gamma} and σ = ${at.sigma}, ${data.side} cells a side, to scale: heights from `
      + `${range.lowest.toFixed(1)} to ${range.highest.toFixed(1)} cells. Light comes from the right, ${at.theta}° from above.`;
    byId("relief").setAttribute("aria-label", words);
    byId("relief-words").textContent = words;
    history.replaceState(null, "", `#${new URLSearchParams(at)}`);
  }

  function begin() {
    data.traced.sets.forEach((s, k) => byId("preset").add(
      new Option(`γ = ${s.gamma}, σ = ${s.sigma}, n = ${s.n}, ${s.theta}°`, k)));
    for (const name of NAMES) byId(name).addEventListener("input", update);
    byId("preset").addEventListener("input", () => set(data.traced.sets[byId("preset").value] ?? {}));
    byId("cursor").addEventListener("input", () => { read(); plot(); });
    byId("scale").addEventListener("input", plot);
    window.addEventListener("resize", plot);
    set({ ...data.start, ...Object.fromEntries(new URLSearchParams(location.hash.slice(1))) });
  }

  begin();
  return { settings, set, shown: () => shown };
})();
