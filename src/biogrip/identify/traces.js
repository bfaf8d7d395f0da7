// Drawings of identified traces and of their distributions, and the table to sort, filter and open.
(() => {
  "use strict";
  const byId = (id) => document.getElementById(id);
  const read = (id) => JSON.parse(byId(id).textContent);
  const escaped = (text) => String(text).replace(/[&<>"]/g, (letter) => `&#${letter.charCodeAt(0)};`);
  const few = (value) => value.toFixed(1).replace(/\.0$/, "");
  const extent = (values) => [Math.min(...values), Math.max(...values)];

  // Numbers in words.

  const raised = (power) => [...String(power)].map((digit) => "⁰¹²³⁴⁵⁶⁷⁸⁹"[digit] || "⁻").join("");

  function inDigits(value, step) {
    const size = Math.abs(value);
    if (size < step / 1e6) return "0";
    const power = Math.floor(Math.log10(size) + 1e-9);
    const digits = Math.max(0, power - Math.floor(Math.log10(step) + 1e-9));
    if (power >= 5 || power < -3) {
      const mantissa = (value / 10 ** power).toFixed(digits);
      return `${mantissa === "1" ? "" : `${mantissa}·`}10${raised(power)}`.replace("-", "−");
    }
    return value.toFixed(Math.max(0, digits - power)).replace("-", "−");
  }

  const short = (value) => (value === 0 ? "0" : inDigits(Number(value.toPrecision(3)), 10 ** (Math.floor(Math.log10(Math.abs(value))) - 2)));

  // Scales, and their ticks as pairs of place and label.

  // The finest steps of 1, 2 or 5 that have no more ticks than most.
  function linearTicks([low, high], most) {
    const ten = 10 ** Math.floor(Math.log10((high - low) / most));
    for (const step of [0.5, 1, 2, 5, 10].map((m) => m * ten)) {
      const first = Math.ceil(low / step - 1e-9), last = Math.floor(high / step + 1e-9);
      if (last - first < most) return Array.from({ length: last - first + 1 }, (_, i) => (first + i) * step).map((v) => [v, inDigits(v, step)]);
    }
    return [];
  }

  function logTicks([low, high], most) {
    const first = Math.ceil(Math.log10(low) - 1e-9), last = Math.floor(Math.log10(high) + 1e-9);
    if (last - first >= 1) {
      const step = Math.ceil((last - first) / (most - 1));
      return Array.from({ length: Math.floor((last - first) / step) + 1 }, (_, i) => first + i * step).map((p) => [10 ** p, `10${raised(p)}`]);
    }
    const steps = [first - 1, first, first + 1].flatMap((p) => [1, 2, 5].map((m) => [m * 10 ** p, 10 ** p])).filter(([v]) => v >= low * 0.999 && v <= high * 1.001);
    return steps.length < 2 ? linearTicks([low, high], most) : steps.map(([v, step]) => [v, inDigits(v, step)]);
  }

  function scaleOf(axis, from, to) {
    const along = axis.log ? Math.log : (value) => value;
    const [low, high] = axis.ends.map(along);
    return (value) => from + ((along(value) - low) / (high - low || 1)) * (to - from);
  }

  // Parts of a name like c_p + c below the line.
  const written = (name) => escaped(name).replace(/_(\w+)/g, '<tspan dy="3" font-size="8">$1</tspan><tspan dy="-3">\u200b</tspan>');
  const withUnit = (name, unit) => (unit ? `${name} (${unit})` : name);

  // A pair of axes in a box of a drawing: x and y have ends, label, log and most (ticks).
  function axes({ left, top, width, height }, x, y, title = "") {
    const X = scaleOf(x, 0, width), Y = scaleOf(y, height, 0);
    const outside = [], inside = [];
    const ticks = (axis) => axis.ticks || (axis.log ? logTicks : linearTicks)(axis.ends, axis.most || 5);
    outside.push(`<path class="axis" d="M0 0V${height}H${width}"/>`);
    for (const [place, label] of x.hidden ? [] : ticks(x)) {
      outside.push(`<path class="axis" d="M${few(X(place))} ${height}v3"/><text class="tick-x" x="${few(X(place))}" y="${height + 14}" text-anchor="middle">${escaped(label)}</text>`);
    }
    for (const [place, label] of ticks(y)) {
      outside.push(`<path class="axis" d="M0 ${few(Y(place))}h-3"/><text class="tick-y" x="-6" y="${few(Y(place) + 3.8)}" text-anchor="end">${escaped(label)}</text>`);
    }
    if (x.label && !x.hidden) outside.push(`<text x="${few(width / 2)}" y="${height + 29}" text-anchor="middle">${written(x.label)}</text>`);
    if (y.label) outside.push(`<text transform="translate(${-left + 11} ${few(height / 2)}) rotate(-90)" text-anchor="middle">${written(y.label)}</text>`);
    if (title) outside.push(`<text class="title" x="0" y="-6">${escaped(title)}</text>`);
    const path = (name, d) => inside.push(`<path class="${name}" d="${d}"/>`);
    const place = (xs, ys) => xs.map((value, i) => `${few(X(value))} ${few(Y(ys[i]))}`);
    return {
      X, Y,
      path,
      line: (name, xs, ys) => path(name, `M${place(xs, ys).join("L")}`),
      dots: (name, xs, ys) => path(`dots ${name}`, place(xs, ys).map((at) => `M${at}h0`).join("")),
      across: (name, at) => path(name, `M0 ${few(Y(at))}H${width}`),
      upright: (name, at) => path(name, `M${few(X(at))} 0V${height}`),
      band: (name, x0, y0, x1, y1) => inside.push(`<rect class="${name}" x="${few(x0)}" y="${few(y0)}" width="${few(Math.max(x1 - x0, 0))}" height="${few(Math.max(y1 - y0, 0))}"/>`),
      add: (text) => inside.push(text),
      text: () => `<g transform="translate(${left} ${top})"><svg width="${width}" height="${height}">${inside.join("")}</svg>${outside.join("")}</g>`,
    };
  }

  const drawing = (width, height, label, parts) => `<svg viewBox="0 0 ${width} ${height}" role="img" aria-label="${escaped(label)}">${parts.join("")}</svg>`;
  const figure = (svg, caption) => `<figure>${svg}<figcaption>${caption}</figcaption></figure>`;
  const key = (shape) => `<svg class="key" viewBox="0 0 20 10" aria-hidden="true">${shape}</svg>`;
  const widened = ([low, high], share) => [low - share * (high - low || 1), high + share * (high - low || 1)];

  // One trace.

  function drawTrace(data, name) {
    const [logTime, logRead] = data.log, [first, last] = [data.time[0], data.time[data.time.length - 1]];
    const x = { ends: [first, last], log: logTime, label: "time (s)" };
    const [low, high] = extent(data.read);
    const y = { ends: logRead ? [0.8 * low, 1.25 * high] : widened([low, high], 0.02), log: logRead, label: data.reads };
    const trace = axes({ left: 50, top: 8, width: 305, height: 165 }, { ...x, hidden: true }, y);
    trace.dots("measured", data.time, data.read);
    trace.line("fitted dashed", ...data.fit);
    const left = data.left.map((value) => value * data.deviation);
    const reach = 1.15 * Math.max(...left.map(Math.abs)) || 1;
    const residual = axes({ left: 50, top: 186, width: 305, height: 70 }, x, { ends: [-reach, reach], label: data.leaves, most: 3 });
    residual.dots("measured", data.time, left);
    residual.across("fitted dashed", 0);
    const shown = data.time.length < data.samples ? `; ${data.time.length} of ${data.samples} readings, the extremes among them` : "";
    const caption = `${key('<path class="dots measured" d="M4 5h0M10 3h0M16 6h0"/>')} recorded trace, ${key('<path class="fitted dashed" d="M1 5H19"/>')} best fit; below, the residuals${shown}.`;
    return [drawing(370, 290, `Trace, best fit and residuals of ${name}: ${data.reads} over time`, [trace.text(), residual.text()]), caption];
  }

  function drawResiduals(data, normal, name) {
    const time = { ends: [data.time[0], data.time[data.time.length - 1]], log: data.log[0], label: "time (s)", most: 4 };
    const box = { left: 54, top: 20, width: 240, height: 140 };
    const most = 1.05 * Math.max(...data.left.map(Math.abs)) || 1;
    const over = axes(box, time, { ends: [-most, most], label: "residual (sd)" }, "over time");
    const [middles, means] = data.blocks, reach = data.white * Math.sqrt(middles.length);
    over.band("shade", 0, over.Y(reach), box.width, over.Y(-reach));
    over.dots("measured", data.time, data.left);
    over.across("target", 0);
    over.line("fitted", middles, means);
    const lags = data.correlation.map((_, i) => i + 1);
    const [low, high] = widened(extent([...data.correlation, -data.white, data.white]), 0.05);
    const correlation = axes(box, { ends: [0, lags.length + 1], label: "lag (samples)" }, { ends: [low, high], label: "autocorrelation", most: 4 }, "autocorrelation");
    correlation.band("shade", 0, correlation.Y(data.white), box.width, correlation.Y(-data.white));
    correlation.path("fitted", lags.map((lag, i) => `M${few(correlation.X(lag))} ${few(correlation.Y(0))}V${few(correlation.Y(data.correlation[i]))}`).join(""));
    correlation.across("target", 0);
    const expected = normal[data.quantiles.length], ends = widened(extent([...expected, ...data.quantiles]), 0.04);
    const quantiles = axes(box, { ends: widened(extent(expected), 0.04), label: "normal quantile" }, { ends, label: "residual quantile" }, "distribution");
    quantiles.line("target", expected, expected);
    quantiles.dots("fitted", expected, data.quantiles);
    const panel = (drawn, what, caption) => figure(drawing(308, 195, `Residuals of ${name}: ${what}`, [drawn.text()]), caption);
    return [
      panel(over, "over time", "Line: means of stretches; shaded: where 95 % of the means of white noise are."),
      panel(correlation, "autocorrelation", "Shaded: of white noise."),
      panel(quantiles, "normal quantiles", "Line: a normal distribution."),
    ].join("");
  }

  // The root of a parabola is straight: between two points, the root is interpolated.
  function curveOf({ values, increases }) {
    const xs = [], ys = [];
    for (let i = 0; i + 1 < values.length; i += 1) {
      const [a, b] = [Math.log(values[i]), Math.log(values[i + 1])], [r, s] = [Math.sqrt(increases[i]), Math.sqrt(increases[i + 1])];
      for (let step = i ? 1 : 0; step <= 5; step += 1) {
        xs.push(Math.exp(a + (b - a) * step / 5));
        ys.push((r + (s - r) * step / 5) ** 2);
      }
    }
    return [xs, ys];
  }

  function drawProfile(profile, levels, name) {
    const box = { left: 36, top: 20, width: 220, height: 120 };
    const x = { ends: profile.axis, log: profile.log, label: withUnit(profile.quantity, profile.unit), most: profile.log ? 3 : 4 };
    const drawn = axes(box, x, { ends: [-0.3, 12], label: "rise of χ²", most: 4 }, profile.verdict);
    for (let i = 0; i + 1 < profile.allowed.length; i += 2) {
      const [from, to] = profile.allowed.slice(i, i + 2).map(drawn.X);
      drawn.band("shade", Math.max(from, 0), 0, Math.min(to, box.width), box.height);
    }
    levels.forEach(([level], i) => drawn.across(`target ${["dashed", "dotted"][i]}`, level));
    const ends = [profile.allowed[0], profile.allowed[profile.allowed.length - 1]];
    profile.closed.forEach((closed, i) => { if (closed) drawn.upright("limit", ends[i]); });
    drawn.line("fitted", ...curveOf(profile));
    return `<figure>${drawing(268, 180, `Profile likelihood of ${profile.quantity}, ${name}: ${profile.verdict}`, [drawn.text()])}</figure>`;
  }

  function drawProfiles(data, name) {
    const [inner, outer] = data.levels.map(([, label]) => escaped(label));
    const caption = `${key('<path class="fitted" d="M1 8Q10 -4 19 8"/>')} this trace; ${key('<path class="target dashed" d="M1 5H19"/>')} ${inner}; ${key('<path class="target dotted" d="M1 5H19"/>')} ${outer}; ${key('<rect class="shade" width="20" height="10"/><path class="limit" d="M19 0V10"/>')} allowed, with its limits.`;
    return `${data.profiles.map((own) => drawProfile(own, data.levels, name)).join("")}<p class="soft">${caption}</p>`;
  }

  function draw(within, number, name) {
    const data = read(`curves-${number}`), part = (what) => within.querySelector(`[data-draw="${what}"]`);
    const [svg, caption] = drawTrace(data, name);
    part("trace").innerHTML = `${svg}<figcaption>${caption}</figcaption>`;
    part("profiles").innerHTML = drawProfiles(data, name);
    part("residuals").innerHTML = drawResiduals(data, read("normal"), name);
  }

  const table = document.querySelector("table.traces");
  if (!table) {
    draw(document, 1, document.querySelector("h1").textContent);
    return;
  }

  // The table.

  const bodies = [...table.tBodies];
  const buttonOf = (body) => body.querySelector("button.open");

  function open(body, wanted = true) {
    const button = buttonOf(body);
    if (!button) return;
    const detail = body.rows[1], inner = detail.querySelector(".inner");
    detail.classList.toggle("opened", wanted);
    button.setAttribute("aria-expanded", String(wanted));
    const packed = inner.querySelector(":scope > noscript");
    if (wanted && packed) {
      // What a noscript element holds is text to a browser that runs scripts.
      inner.innerHTML = packed.textContent;
      draw(inner, body.id.replace("trace-", ""), button.textContent);
    }
  }

  table.addEventListener("click", ({ target }) => {
    const button = target.closest("button.open");
    if (button) open(button.closest("tbody"), button.getAttribute("aria-expanded") !== "true");
  });

  function openNamed() {
    const body = byId(decodeURIComponent(location.hash.slice(1)));
    if (!body) return;
    if (body.tagName === "DETAILS") body.open = true;
    if (bodies.includes(body)) {
      body.hidden = false;
      open(body);
    }
    body.scrollIntoView();
  }
  window.addEventListener("hashchange", openNamed);

  const sortKey = (body, column) => {
    const cell = body.rows[0].cells[column];
    if (!cell) return null;
    if (cell.dataset.sort === undefined) return cell.textContent;
    return Number.isNaN(Number(cell.dataset.sort)) ? null : Number(cell.dataset.sort);
  };
  const inOrder = new Intl.Collator(undefined, { numeric: true }).compare;
  const heads = [...table.tHead.rows[0].cells];

  heads.forEach((head, column) => head.querySelector("button").addEventListener("click", () => {
    const down = head.getAttribute("aria-sort") === "ascending";
    heads.forEach((other) => other.removeAttribute("aria-sort"));
    head.setAttribute("aria-sort", down ? "descending" : "ascending");
    const keyed = bodies.map((body, place) => ({ body, place, own: sortKey(body, column) }));
    keyed.sort((a, b) => {
      // What has no number comes last either way.
      if (a.own === null || b.own === null) return (a.own === null) - (b.own === null) || a.place - b.place;
      const order = typeof a.own === "string" || typeof b.own === "string" ? inOrder(a.own, b.own) : a.own - b.own;
      return (down ? -order : order) || a.place - b.place;
    });
    table.append(...keyed.map((each) => each.body));
  }));

  const boxes = [...document.querySelectorAll("input[name=status]")];
  const texts = bodies.map((body) => {
    const cells = [...body.rows[0].cells];
    return cells.slice(0, cells.findIndex((cell) => cell.classList.contains("status"))).map((cell) => cell.textContent.toLowerCase()).join("\n");
  });

  function filter() {
    const text = byId("filter").value.trim().toLowerCase(), kept = new Set(boxes.filter((box) => box.checked).map((box) => box.value));
    let shown = 0;
    bodies.forEach((body, i) => {
      body.hidden = !(kept.has(body.dataset.status) && texts[i].includes(text));
      shown += !body.hidden;
    });
    byId("shown").textContent = `${shown} of ${bodies.length} shown`;
  }
  byId("filter").addEventListener("input", filter);
  boxes.forEach((box) => box.addEventListener("change", filter));

  // Some at a time, so that the page answers meanwhile.
  byId("open-all").addEventListener("click", ({ target }) => {
    const wanted = target.dataset.done !== "yes", left = bodies.filter((body) => !body.hidden);
    target.dataset.done = wanted ? "yes" : "";
    target.textContent = wanted ? "Close all that are shown" : "Open all that are shown";
    const next = () => {
      left.splice(0, 100).forEach((body) => open(body, wanted));
      if (left.length) setTimeout(next);
    };
    next();
  });

  // Distributions.

  const all = byId("strips-data") && read("strips-data");

  const levelOf = (cell, column) => (column < 0 ? "" : cell.levels[column] || "–");

  function drawStrip(index, column) {
    const { name, unit } = all.quantities[index], counts = { determined: 0, "bounded below": 0, "bounded above": 0, "not determined": 0 };
    const cells = [];
    let rejected = 0;
    all.cells.forEach((cell, number) => {
      if (!cell.found[index]) return;
      if (cell.fit === "rejected") { rejected += 1; return; }
      const [value, low, high] = cell.found[index];
      const kind = low !== null ? (high !== null ? "determined" : "bounded below") : (high !== null ? "bounded above" : "not determined");
      counts[kind] += 1;
      const at = kind === "determined" ? value : low ?? high;
      if (at > 0) cells.push({ number, at, low, high, kind, hollow: cell.fit === "doubtful", level: levelOf(cell, column) });
    });
    const words = Object.entries(counts).filter(([, count]) => count).map(([kind, count]) => `${count} ${kind}${kind === "not determined" ? " (not drawn)" : ""}`);
    if (rejected) words.push(`${rejected} with rejected fits left out`);
    const caption = `<strong>${escaped(name)}</strong>: ${words.join(", ")}.`;
    const element = document.createElement("figure");
    if (!cells.length) {
      element.innerHTML = `<figcaption>${caption}</figcaption>`;
      return element;
    }
    cells.sort((a, b) => a.at - b.at);
    const levels = [...new Set(all.cells.map((cell) => levelOf(cell, column)))];
    const [low, high] = extent(cells.flatMap((c) => [c.at, c.low, c.high]).filter((v) => typeof v === "number" && v > 0));
    const margin = Math.max((high / low) ** 0.06, 1.01), arrow = Math.max((high / low) ** 0.15, 1.03);
    const room = (kind) => (cells.some((cell) => cell.kind === kind) ? arrow : margin);
    const box = { left: 54, top: 10, width: 318, height: 180 };
    const each = box.width / levels.length;
    const ticks = levels.map((level, i) => [(i + 0.5) / levels.length, level.length > each / 6 ? `${level.slice(0, Math.max(Math.floor(each / 6) - 1, 1))}…` : level]);
    const drawn = axes(box, { ends: [0, 1], ticks: column < 0 ? [] : ticks, label: column < 0 ? "cells" : all.columns[column] },
      { ends: [low / room("bounded above"), high * room("bounded below")], log: true, label: withUnit(name, unit), most: 5 });
    const dots = [];
    levels.forEach((level, i) => {
      const own = cells.filter((cell) => cell.level === level), step = 0.86 * each / Math.max(own.length, 1);
      const bars = [], width = few(Math.max(Math.min(step * 0.4, 1.2), 0.2));
      const radius = Math.max(Math.min(step * 0.45, 3.2), 0.9);
      own.forEach((cell, place) => {
        cell.x = (i + 0.07) * each + (place + 0.5) * step;
        cell.y = drawn.Y(cell.at);
        const at = few(cell.x), head = Math.min(Math.max(step * 0.4, 1.5), 3.5);
        if (cell.kind === "determined") {
          bars.push(`M${at} ${few(drawn.Y(cell.low))}V${few(drawn.Y(cell.high))}`);
          if (cell.hollow) drawn.add(`<circle class="hollow" cx="${at}" cy="${few(cell.y)}" r="${few(radius)}"/>`);
          else dots.push(`<path class="cell dots" style="stroke-width:${few(2 * radius)}" d="M${at} ${few(cell.y)}h0"/>`);
        } else {
          const way = cell.kind === "bounded below" ? -1 : 1, tip = cell.y + 16 * way;
          const shape = `M${few(cell.x - head)} ${few(cell.y)}h${few(2 * head)}M${at} ${few(cell.y)}V${few(tip)}M${few(cell.x - head)} ${few(tip - head * way)}L${at} ${few(tip)}L${few(cell.x + head)} ${few(tip - head * way)}`;
          drawn.add(`<path class="cell arrow${cell.hollow ? " dotted" : ""}" style="stroke-width:${width}" d="${shape}"/>`);
        }
      });
      drawn.add(`<path class="cell bars" style="stroke-width:${width}" d="${bars.join("")}"/>`);
    });
    dots.forEach(drawn.add);
    element.innerHTML = `${drawing(380, 226, `Distribution of ${name}: ${words.join(", ")}`, [drawn.text()])}<figcaption>${caption}</figcaption>`;
    const svg = element.querySelector("svg");
    const nearest = (event) => {
      const { left, top, width } = svg.getBoundingClientRect(), ratio = 380 / width;
      const away = (cell) => Math.hypot((event.clientX - left) * ratio - box.left - cell.x, (event.clientY - top) * ratio - box.top - cell.y);
      const best = cells.reduce((a, b) => (away(b) < away(a) ? b : a));
      return away(best) < 25 ? best : null;
    };
    svg.addEventListener("pointermove", (event) => {
      const cell = nearest(event);
      const limits = cell && [cell.low, cell.high].map((v) => (v === null ? "?" : short(v))).join(" to ");
      element.title = cell ? `${all.cells[cell.number].name}: ${limits}` : "";
    });
    svg.addEventListener("click", (event) => {
      const cell = nearest(event);
      if (cell) location.hash = `trace-${cell.number + 1}`;
    });
    return element;
  }

  function drawStrips(column) {
    byId("strips").replaceChildren(...all.quantities.map((_, index) => drawStrip(index, column)));
  }

  if (all) {
    if (all.columns.length) {
      const label = document.createElement("label"), select = document.createElement("select");
      select.append(...all.columns.map((name, i) => new Option(name, i)));
      select.addEventListener("change", () => drawStrips(Number(select.value)));
      label.append("By column", select);
      byId("by").append(label);
    }
    drawStrips(all.columns.length ? 0 : -1);
  }
  filter();
  openNamed();
})();
