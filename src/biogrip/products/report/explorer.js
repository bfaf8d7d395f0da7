// The explorer: controls, and plots that follow them.
(async () => {
  await new Promise((resolve) => {
    const packed = Uint8Array.from(atob(document.getElementById("plotly").textContent), (letter) => letter.charCodeAt(0));
    const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
    new Response(stream).text().then((text) => {
      document.head.append(Object.assign(document.createElement("script"), { textContent: text }));
      resolve();
    });
  });
  const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const INK = colour("--ink"), LINE = colour("--line"), MEASURED = "#56B4E9", FITTED = "#D55E00", BLUE = colour("--blue"), GREY = "#999999";
  const POINTS = 41, DRAWN = 801, MOST_DRAWN = 1000;
  const cases = JSON.parse(document.getElementById("data").textContent).map(unpacked);
  const element = (id) => document.getElementById(id);

  function unpacked(given) {
    const bytes = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer;
    const single = ({ step, counts }) => Array.from(new Int16Array(bytes(counts)), (count) => count * step);
    const times = Array.from(new Float64Array(bytes(given.time_s)));
    return {
      ...given, times, target: given.target && single(given.target),
      trace: (index) => single(given.traces[index]),
      layout: {
        elements: given.elements.map((e) => e.at),
        low: given.elements.map((e) => e.low), high: given.elements.map((e) => e.high),
      },
    };
  }

  function draw(id, title, x, y, traces, layout = {}) {
    const axis = { zeroline: false, automargin: true, linecolor: GREY, gridcolor: LINE, ticks: "outside", exponentformat: "power" };
    Plotly.react(id, traces, {
      title: { text: title, font: { size: 13 }, x: 0.02 }, font: { size: 11, color: INK },
      paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)",
      margin: { l: 58, r: 10, t: 34, b: 42 }, showlegend: traces.length > 1,
      legend: { orientation: "h", x: 1, xanchor: "right", y: 1.02, yanchor: "bottom", font: { size: 10 } },
      xaxis: { ...axis, title: { text: x }, ...layout.xaxis }, yaxis: { ...axis, title: { text: y }, ...layout.yaxis },
      shapes: layout.shapes || [], annotations: layout.annotations || [],
    }, { responsive: true, displaylogo: false, displayModeBar: false });
    element(id).setAttribute("role", "img");
    element(id).setAttribute("aria-label", `${title}: ${traces.map((t) => t.name).join(", ")}; ${y} over ${x}`);
  }

  // As many points as a screen shows, for browsers that draw without a graphics processor.
  function dots(x, y, name) {
    const stride = Math.ceil(x.length / MOST_DRAWN), few = (values) => values.filter((_, i) => i % stride === 0);
    return { x: few(x), y: few(y), name, mode: "markers", type: "scatter", marker: { size: 2, color: MEASURED } };
  }

  function options(id, pairs) {
    const select = element(id), before = select.value;
    select.replaceChildren(...pairs.map(([value, text]) => new Option(text, value)));
    if (pairs.some(([value]) => String(value) === before)) select.value = before;
  }

  const short = (value) => {
    const rounded = Number(value.toPrecision(3));
    return Math.abs(rounded) < 1e-3 && rounded !== 0 ? rounded.toExponential() : String(rounded);
  };

  const sumOf = (item, members) => members.map((i) => item.elements[i].name).join(" + ");

  // One trace.

  function chooseCase() {
    const item = cases[element("case").value];
    options("method", item.methods.map((m, i) => [i, m.title]));
    options("seed", item.seeds.map((seed) => [seed, seed]));
    const names = item.elements.map((e, i) => [i, e.name]);
    const dampers = inference.dampers(item.layout);
    options("quantity", dampers.length === 2 ? [["sum", sumOf(item, dampers)], ...names] : names);
    showTrace();
  }

  function showTrace() {
    const item = cases[element("case").value], seed = Number(element("seed").value);
    const method = item.methods[element("method").value];
    const fit = method.fits.find((f) => f.seed === seed);
    const trace = item.trace(item.seeds.indexOf(seed)), times = item.times;
    const without = inference.projection(times, item.offset, item.drift);
    const respond = (sample) => Array.from(mechanics.rotation(item.gripper, sample, item.torque, times));
    const lines = [dots(times, trace, item.target ? "noisy trace" : "recorded trace")];
    if (item.target) lines.push({ x: times, y: item.target, mode: "lines", line: { color: INK, width: 1.5 }, name: "target" });
    let residual = [];
    if (fit && item.closed_form) {
      const fitted = respond(fit.sample), left = without(trace.map((value, i) => value - fitted[i]));
      residual = left;
      lines.push({ x: times, y: trace.map((value, i) => value - left[i]), mode: "lines", line: { color: FITTED, width: 1.5, dash: "dash" }, name: "fit" });
    }
    draw("plot-trace", "Trace and fit", "time (s)", item.reads, lines);
    draw("plot-residual", "What the fit leaves", "time (s)", `trace − fit${item.unit && ` (${item.unit})`}`, [dots(times, residual, "residual")]);
    const history = fit ? fit.history : [];
    draw("plot-history", history.length ? "How it was found" : "This method has no generations", "generation", `lowest misfit${item.unit && ` (${item.unit})`}`,
      history.length ? [{ x: history[0], y: history[1], mode: "lines", line: { color: FITTED, shape: "hv" }, name: "lowest misfit" }] : [],
      { yaxis: { type: "log" } });
    const note = item.nonlinear ? " The study's model is nonlinear here; the page draws the linear one." : "";
    element("fit-words").textContent = !item.closed_form
      ? `${item.grips ? "Arms or torques differ, arms ring, or readings have weights" : "Creep and relaxation"}: the page does not compute that, and shows traces only.`
      : fit ? `${method.title}, seed ${seed}: ${fit.words}; misfit ${short(fit.misfit)} ${item.unit}.${note}` : "";
    element("plot-profile").dataset.ready = "";
    clearTimeout(showTrace.later);
    showTrace.later = setTimeout(() => { if (fit && item.closed_form) showProfile(item, trace, fit); }, 30);
  }

  function profileOf(item, trace, sample, quantity, values) {
    const respond = (logs) => Array.from(
      mechanics.rotation(item.gripper, inference.sampleOf(item.layout, logs), item.torque, item.times));
    const start = inference.logsOf(item.layout, sample);
    return inference.profile(item.layout, respond, trace, start, quantity, values, inference.projection(item.times, item.offset, item.drift), item.times[item.times.length - 1]);
  }

  function showProfile(item, trace, fit) {
    if (!item.elements.length) {
      draw("plot-profile", "Power-law samples: see their profiles among the figures", "", "rise of chi²", []);
      element("plot-profile").dataset.ready = "yes";
      return;
    }
    const chosen = element("quantity").value, quantity = chosen === "sum" ? "sum" : Number(chosen);
    const dampers = inference.dampers(item.layout);
    const members = quantity === "sum" ? dampers : [quantity];
    const low = Math.max(...members.map((i) => item.layout.low[i])), high = Math.min(...members.map((i) => item.layout.high[i]));
    const start = inference.logsOf(item.layout, fit.sample);
    const middle = Math.log(members.reduce((sum, i) => sum + Math.exp(start[i]), 0));
    const threshold = item.threshold;
    // A coarse look at the whole range first, then where the rise is small.
    const coarse = Array.from({ length: 15 }, (_, i) => low + (high - low) * (i + 0.5) / 15).concat([middle]).sort((a, b) => a - b);
    const seen = profileOf(item, trace, fit.sample, quantity, coarse);
    const inside = coarse.filter((_, i) => seen.rises[i] < 4 * threshold);
    const width = (high - low) / 15;
    let from = Math.max(low, Math.min(...inside, middle) - width), to = Math.min(high, Math.max(...inside, middle) + width);
    let fine = seen, values = coarse;
    for (let n = 0; n < 3; n += 1) {
      values = Array.from({ length: POINTS }, (_, i) => from + (to - from) * i / (POINTS - 1));
      fine = profileOf(item, trace, fit.sample, quantity, values);
      const near = values.filter((_, i) => fine.rises[i] < 4 * threshold);
      if (near.length > POINTS / 4) break;
      const step = (to - from) / (POINTS - 1);
      const centre = near.length ? near : [values[fine.rises.indexOf(Math.min(...fine.rises))]];
      from = Math.max(low, centre[0] - step); to = Math.min(high, centre[centre.length - 1] + step);
    }
    const name = element("quantity").selectedOptions[0].text, unit = item.elements[members[0]].unit;
    draw("plot-profile", `How far ${name} can be moved`, `${name} (${unit})`, "rise of chi²",
      [{ x: values.map(Math.exp), y: fine.rises, mode: "lines", line: { color: BLUE }, name: "profile" }],
      { xaxis: { type: to - from > 2 ? "log" : "linear" }, yaxis: { range: [0, 4 * threshold] },
        shapes: [{ type: "line", xref: "paper", x0: 0, x1: 1, y0: threshold, y1: threshold, line: { color: GREY, dash: "dot" } }] });
    element("plot-profile").dataset.ready = "yes";
  }

  // A sample of one's own.

  const tried = { index: 0, logs: [], torque: 1, noise: 0 };

  function sliders() {
    const item = cases[tried.index];
    const selector = document.createElement("label");
    selector.append("start from");
    const select = document.createElement("select");
    select.id = "try-case";
    cases.forEach((c, i) => { if (c.elements.length && c.grips) select.append(new Option(c.title, i)); });
    select.value = tried.index;
    select.addEventListener("change", () => { tried.index = Number(select.value); startFrom(); });
    selector.append(select);
    const all = item.elements.map((e, i) => slider(`try-${e.name}`, e.name, e.unit, e.low, e.high, tried.logs[i], (u) => { tried.logs[i] = u; }));
    all.push(slider("try-torque", "torque", "× the protocol's", Math.log(0.05), Math.log(20), Math.log(tried.torque), (u) => { tried.torque = Math.exp(u); }));
    all.push(slider("try-noise", "noise", "rad", Math.log(1e-9), Math.log(1e-1), Math.log(tried.noise), (u) => { tried.noise = Math.exp(u); }));
    element("sample-controls").replaceChildren(selector, ...all);
  }

  function slider(id, name, unit, low, high, value, moved) {
    const label = document.createElement("label"), input = document.createElement("input"), output = document.createElement("output");
    Object.assign(input, { type: "range", min: low, max: high, step: (high - low) / 2000, id });
    input.value = value;
    input.setAttribute("aria-label", `${name} (${unit})`);
    const say = (log) => { input.setAttribute("aria-valuetext", `${short(Math.exp(log))} ${unit}`); output.textContent = `${name} = ${short(Math.exp(log))} ${unit}`; };
    input.addEventListener("input", () => { tried.moved = true; moved(Number(input.value)); say(Number(input.value)); showTried(); });
    say(value);
    label.append(output, input);
    return label;
  }

  function startFrom() {
    const item = cases[tried.index];
    const sample = item.truth || item.methods[0].fits[0].sample;
    tried.logs = inference.logsOf(item.layout, sample);
    tried.torque = 1;
    tried.moved = false;
    tried.noise = Math.max(item.noise || item.methods[0].fits[0].misfit, 1e-9);
    sliders();
    showTried();
  }

  // What the profile of the study's trace says of a quantity, if the sample is the study's.
  function byProfile(item, name, firstOrder) {
    if (tried.moved || !item.truth || !(name in item.verdicts)) return "–";
    const verdict = item.verdicts[name];
    if (verdict === firstOrder || ![verdict, firstOrder].includes("determined") || firstOrder === "roughly") return verdict;
    return `${verdict}: the profile disagrees${firstOrder === "determined" ? ", as values far away fit, too" : ""}`;
  }

  function showTried() {
    const item = cases[tried.index];
    if (!item.closed_form) {
      element("force-words").textContent = "Arms or torques differ, arms ring, or readings have weights: the page does not compute that.";
      return;
    }
    const torque = mechanics.scaled(item.torque, tried.torque);
    const drawn = Array.from({ length: DRAWN }, (_, i) => item.end_s * i / (DRAWN - 1));
    const sample = inference.sampleOf(item.layout, tried.logs);
    const response = mechanics.rotation(item.gripper, sample, torque, drawn);
    const force = mechanics.jawForce(item.gripper, sample, torque, drawn);
    draw("plot-response", "Response, and the noise on it", "time (s)", "closing rotation (rad)", [
      { x: [...drawn, ...drawn.slice().reverse()], y: [...Array.from(response, (v) => v + tried.noise), ...Array.from(response, (v) => v - tried.noise).reverse()], fill: "toself", mode: "none", fillcolor: "rgba(86,180,233,0.35)", name: "± standard deviation", hoverinfo: "skip" },
      { x: drawn, y: Array.from(response), mode: "lines", line: { color: INK }, name: "response" }]);
    draw("plot-force", "Force of the jaws", "time (s)", "force (N)", [{ x: drawn, y: Array.from(force), mode: "lines", line: { color: BLUE }, name: "force" }],
      { shapes: [{ type: "line", xref: "paper", x0: 0, x1: 1, y0: 0, y1: 0, line: { color: GREY } }] });
    const lowest = Math.min(...force), most = Math.max(...force);
    element("force-words").textContent = lowest < -1e-9 * most
      ? `The jaws would have to pull, by ${short(-lowest)} N at most: without adhesion, contact is lost.`
      : "The jaws press all the time.";
    const respond = (logs) => mechanics.rotation(item.gripper, inference.sampleOf(item.layout, logs), torque, item.times);
    const found = inference.deviations(item.layout, tried.logs, (logs) => Array.from(respond(logs)), tried.noise);
    const names = item.elements.map((e) => e.name), units = item.elements.map((e) => e.unit);
    const values = tried.logs.map(Math.exp);
    const dampers = inference.dampers(item.layout);
    if (found.length > names.length) {
      names.push(sumOf(item, dampers));
      units.push("N s/m");
      values.push(dampers.reduce((sum, i) => sum + values[i], 0));
    }
    const words = found.map((d) => (d < 0.05 ? "determined" : d < 0.5 ? "roughly" : "not determined"));
    element("determined").replaceChildren(...names.map((name, i) => {
      const row = document.createElement("tr");
      const cells = [name, `${short(values[i])} ${units[i]}`,
        found[i] < 1 ? `${short(100 * found[i])} %` : `a factor of ${short(Math.exp(Math.min(found[i], 50)))}`,
        words[i], byProfile(item, name, words[i])];
      row.append(...cells.map((text) => Object.assign(document.createElement("td"), { textContent: text })));
      return row;
    }));
  }

  options("case", cases.map((c, i) => [i, c.title]));
  element("case").addEventListener("change", chooseCase);
  ["method", "seed", "quantity"].forEach((id) => element(id).addEventListener("change", showTrace));
  if (cases.length) {
    chooseCase();
    // A power law has no few elements that sliders could move.
    tried.index = cases.findIndex((c) => c.elements.length && c.grips);
    if (tried.index >= 0) startFrom();
    else if (element("force-words")) element("force-words").textContent = "The page has no sliders for power-law samples.";
  }
  window.biogrip = { cases, mechanics, inference, profileOf, dots };
})();
