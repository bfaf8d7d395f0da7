// A trace and the response of a sample to its protocol, with a slider for each parameter.
//
// Equal arms without inertia turn by tau / (a + d s + l G(s)), with a and d the stiffness and the
// damping of an arm, l twice its squared lever, and G = k_p + c_p s + k s/(s + k/c) the sample.
// That is 1 / (A + B s + K s/(s + r)), whose two poles p are real and negative: of
// B p^2 + (A + K + B r) p + A r. After a unit step each adds W (1 - e^(p t)), and W is positive.

function modes({ k, k_p, c, c_p }, { stiffness, damping, lever }) {
  const [A, B, K, r] = [stiffness + lever * k_p, damping + lever * c_p, lever * k, k / c];
  const q = (A + K + B * r + Math.sqrt((A + K - B * r) ** 2 + 4 * B * r * K)) / 2;
  const [fast, slow] = [-q / B, (-A * r) / q];
  const weight = (p, other) => -(p + r) / (B * p * (p - other));
  return [[fast, weight(fast, slow)], [slow, weight(slow, fast)]];
}

function response(sample, arm, steps, times) {
  const own = modes(sample, arm);
  return times.map((time) => {
    let sum = 0;
    for (const [start, height] of steps)
      if (time >= start)
        for (const [p, weight] of own) sum -= height * weight * Math.expm1(p * (time - start));
    return sum;
  });
}

function showSliders(root, data) {
  const [left, right, top, bottom] = [52, 590, 12, 300];
  const svg = root.querySelector("svg");
  const sample = { ...data.sample };
  const scaled = (values) => values.map((value) => value * data.factor);
  const readings = scaled(data.readings);
  const [low, high] = [Math.min(...readings), Math.max(...readings)];
  const end = data.times.at(-1);
  const x = (time) => left + ((right - left) * time) / end;
  const y = (value) => bottom - ((bottom - top) * (value - low)) / (high - low);
  const add = (name, attributes, text = "") => {
    const made = document.createElementNS("http://www.w3.org/2000/svg", name);
    for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
    made.textContent = text;
    return svg.appendChild(made);
  };
  const ticks = (from, to) => {
    const power = 10 ** Math.floor(Math.log10((to - from) / 3));
    const step = power * [5, 2, 1].find((each) => each * power <= (to - from) / 3);
    const count = Math.floor(to / step) - Math.ceil(from / step) + 1;
    return [...Array(count).keys()].map((i) => +((Math.ceil(from / step) + i) * step).toPrecision(6));
  };
  const points = (values) => values.map((v, i) => `${x(data.times[i]).toFixed(1)},${y(v).toFixed(1)}`);
  for (const at of ticks(0, end)) add("text", { x: x(at), y: bottom + 18, class: "middle" }, at);
  for (const at of ticks(low, high)) add("text", { x: left - 8, y: y(at) + 4, class: "end" }, at);
  add("path", { d: `M${left},${top}V${bottom}H${right}`, class: "axis" });
  add("text", { x: right, y: bottom + 34, class: "end" }, "time (s)");
  add("text", { x: left + 6, y: top + 8 }, data.read);
  add("path", { d: points(readings).map((point) => `M${point}h0`).join(""), class: "readings" });
  const curve = add("path", { class: "curve" });

  const inputs = Object.fromEntries(
    [...root.querySelectorAll("input[type=range]")].map((input) => [input.name, input]));
  const together = root.querySelector("input[type=checkbox]");
  const draw = () => {
    const drawn = response(sample, data.arm, data.steps, data.times);
    curve.setAttribute("d", `M${points(scaled(drawn)).join("L")}`);
    for (const [name, input] of Object.entries(inputs)) {
      input.value = Math.log10(sample[name]);
      const told = `${+sample[name].toPrecision(3)} ${name.startsWith("k") ? "N/m" : "N s/m"}`;
      input.nextElementSibling.textContent = told;
      input.setAttribute("aria-valuetext", told);
    }
    const squares = data.readings.map((value, i) => (value - drawn[i]) ** 2);
    const misfit = Math.sqrt(squares.reduce((sum, each) => sum + each, 0) / squares.length);
    root.querySelector("p > output").textContent = (misfit * data.factor).toPrecision(4);
  };
  const other = { c: "c_p", c_p: "c" };
  for (const [name, input] of Object.entries(inputs))
    input.addEventListener("input", () => {
      const sum = sample.c + sample.c_p;
      sample[name] = 10 ** input.value;
      if (together.checked && name in other) {
        const least = 10 ** input.min;
        sample[name] = Math.min(sample[name], sum - least);
        sample[other[name]] = Math.max(sum - sample[name], least);
      }
      draw();
    });
  root.querySelector("button").addEventListener("click", () => {
    Object.assign(sample, data.sample);
    draw();
  });
  draw();
}
