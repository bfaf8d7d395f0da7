// What a trace tells of a sample: first order about a point, and profiles by least squares.
//
// A layout says which elements of the network are free: ["k", 0], ["k_p"], ["c", 0], ["c_p"] with
// the logarithms of their ranges. Values are logarithms throughout.
const inference = (() => {
  const STEP = 1e-4, HINGE = 10;

  function sampleOf(layout, logs) {
    const sample = { k_p: 0, c_p: 0, k: [], c: [] };
    layout.elements.forEach(([name, branch], i) => {
      if (branch === null) sample[name] = Math.exp(logs[i]);
      else sample[name][branch] = Math.exp(logs[i]);
    });
    return sample;
  }

  function logsOf(layout, sample) {
    return layout.elements.map(([name, branch], i) => {
      const value = branch === null ? sample[name] : sample[name][branch];
      return clamp(value > 0 ? Math.log(value) : -Infinity, layout.low[i], layout.high[i]);
    });
  }

  function sensitivities(respond, logs) {
    return logs.map((_, i) => {
      const moved = (by) => respond(logs.map((u, j) => (i === j ? u + by : u)));
      const up = moved(STEP), down = moved(-STEP);
      return up.map((value, n) => (value - down[n]) / (2 * STEP));
    });
  }

  // Standard deviations of logarithms with all elements free, each known beforehand to its range;
  // of each element, then of the sum of the dampers if there are two.
  function deviations(layout, logs, respond, noise) {
    const rows = sensitivities(respond, logs);
    const matrix = rows.map((a, i) => rows.map((b, j) => {
      const width = layout.high[i] - layout.low[i];
      return dot(a, b) / noise ** 2 + (i === j ? 12 / width ** 2 : 0);
    }));
    const inverse = inverted(matrix);
    const found = logs.map((_, i) => Math.sqrt(inverse[i][i]));
    const slope = sumSlope(layout, logs);
    if (slope) {
      let variance = 0;
      slope.forEach((a, i) => slope.forEach((b, j) => { variance += a * b * inverse[i][j]; }));
      found.push(Math.sqrt(variance));
    }
    return found;
  }

  function dampers(layout) {
    return layout.elements.flatMap(([name], i) => (name === "c" || name === "c_p" ? [i] : []));
  }

  function sumSlope(layout, logs) {
    const members = dampers(layout);
    if (members.length < 2) return null;
    const total = members.reduce((sum, i) => sum + Math.exp(logs[i]), 0);
    return logs.map((u, i) => (members.includes(i) ? Math.exp(u) / total : 0));
  }

  // Least squares over what `expand` maps to log-parameters, within bounds (Levenberg, Marquardt).
  function fitted(residuals, start, low, high) {
    let x = start.map((u, i) => clamp(u, low[i], high[i]));
    let rows = residuals(x), cost = dot(rows, rows), damping = 1e-3;
    for (let n = 0; n < 60; n += 1) {
      const jacobian = x.map((_, i) => {
        const by = x[i] + STEP > high[i] ? -STEP : STEP;
        const moved = residuals(x.map((u, j) => (i === j ? u + by : u)));
        return moved.map((value, m) => (value - rows[m]) / by);
      });
      const gradient = jacobian.map((row) => dot(row, rows));
      const free = x.map((u, i) => !(u <= low[i] && gradient[i] > 0) && !(u >= high[i] && gradient[i] < 0));
      const which = x.map((_, i) => i).filter((i) => free[i]);
      if (!which.length) break;
      let better = false;
      while (damping < 1e12) {
        const matrix = which.map((i) => which.map((j) => dot(jacobian[i], jacobian[j])
          * (i === j ? 1 + damping : 1) + (i === j ? 1e-12 * cost : 0)));
        const step = solved(matrix, which.map((i) => -gradient[i]));
        const tried = x.slice();
        which.forEach((i, m) => { tried[i] = clamp(x[i] + clamp(step[m], -3, 3), low[i], high[i]); });
        const there = residuals(tried), lower = dot(there, there);
        if (lower < cost) {
          better = cost - lower > 1e-10 * cost;
          x = tried; rows = there; cost = lower; damping = Math.max(damping / 10, 1e-12);
          break;
        }
        damping *= 4;
      }
      if (!better) break;
    }
    return { x, cost };
  }

  // The rise of chi^2 with one quantity held, over `values`; quantity is an index, or "sum".
  // With the sum held, a branch that does not relax by the end of the trace costs chi^2, as in the
  // library: the damper of a branch that is not seen might else be of any size.
  function profile(layout, respond, trace, start, quantity, values, without, longest) {
    const residuals = (logs) => without(respond(logs).map((value, i) => value - trace[i]));
    const best = fitted(residuals, start, layout.low, layout.high);
    const noise = best.cost / (trace.length - start.length);
    const members = dampers(layout), all = start.map((_, i) => i);
    const place = (name) => layout.elements.findIndex(([element]) => element === name);
    const late = (logs) => HINGE * Math.max(0, logs[place("c")] - logs[place("k")] - Math.log(longest));
    const priced = (logs) => (quantity === "sum"
      ? [...residuals(logs), Math.sqrt(noise) * late(logs)] : residuals(logs));
    const held = (value) => {
      if (quantity !== "sum") {
        const rest = all.filter((i) => i !== quantity);
        return {
          expand: (free) => { const x = []; rest.forEach((i, m) => { x[i] = free[m]; }); x[quantity] = value; return x; },
          reduce: (x) => rest.map((i) => x[i]),
          low: rest.map((i) => layout.low[i]), high: rest.map((i) => layout.high[i]),
        };
      }
      const [first, second] = members, rest = all.filter((i) => i !== first && i !== second);
      return {
        expand: (free) => {
          const x = [];
          rest.forEach((i, m) => { x[i] = free[m]; });
          const ratio = free[rest.length];
          x[first] = value - Math.log1p(Math.exp(-ratio));
          x[second] = value - Math.log1p(Math.exp(ratio));
          return x;
        },
        reduce: (x) => [...rest.map((i) => x[i]), x[first] - x[second]],
        low: [...rest.map((i) => layout.low[i]), -20], high: [...rest.map((i) => layout.high[i]), 20],
      };
    };
    const points = values.map((value) => ({ value, cost: Infinity, x: null }));
    const from = (point, x) => {
      const { expand, reduce, low, high } = held(point.value);
      const found = fitted((free) => priced(expand(free)), reduce(x), low, high);
      if (found.cost < point.cost) { point.cost = found.cost; point.x = expand(found.x); }
    };
    points.forEach((point) => from(point, best.x));
    for (let i = 1; i < points.length; i += 1) from(points[i], points[i - 1].x);
    for (let i = points.length - 2; i >= 0; i -= 1) from(points[i], points[i + 1].x);
    return { best: best.x, noise: Math.sqrt(noise), rises: points.map((p) => (p.cost - best.cost) / noise) };
  }

  // Takes an offset, and perhaps a straight line, out of residuals.
  function projection(times, offset, drift) {
    const basis = [];
    if (offset) basis.push(times.map(() => 1));
    if (drift) basis.push(times.slice());
    basis.forEach((row, i) => {
      basis.slice(0, i).forEach((other) => {
        const share = dot(row, other);
        for (let n = 0; n < row.length; n += 1) row[n] -= share * other[n];
      });
      const length = Math.sqrt(dot(row, row));
      for (let n = 0; n < row.length; n += 1) row[n] /= length;
    });
    return (rows) => {
      basis.forEach((row) => {
        const share = dot(rows, row);
        for (let n = 0; n < rows.length; n += 1) rows[n] -= share * row[n];
      });
      return rows;
    };
  }

  function dot(a, b) {
    let sum = 0;
    for (let i = 0; i < a.length; i += 1) sum += a[i] * b[i];
    return sum;
  }

  const clamp = (value, low, high) => Math.min(Math.max(value, low), high);

  function solved(matrix, right) {
    const n = right.length, rows = matrix.map((row, i) => [...row, right[i]]);
    for (let i = 0; i < n; i += 1) {
      let pivot = i;
      for (let j = i + 1; j < n; j += 1) if (Math.abs(rows[j][i]) > Math.abs(rows[pivot][i])) pivot = j;
      [rows[i], rows[pivot]] = [rows[pivot], rows[i]];
      for (let j = i + 1; j < n; j += 1) {
        const share = rows[j][i] / rows[i][i];
        for (let m = i; m <= n; m += 1) rows[j][m] -= share * rows[i][m];
      }
    }
    const x = new Array(n);
    for (let i = n - 1; i >= 0; i -= 1) {
      x[i] = rows[i][n];
      for (let j = i + 1; j < n; j += 1) x[i] -= rows[i][j] * x[j];
      x[i] /= rows[i][i];
    }
    return x;
  }

  function inverted(matrix) {
    const scale = matrix.map((row, i) => 1 / Math.sqrt(row[i]));
    const even = matrix.map((row, i) => row.map((value, j) => value * scale[i] * scale[j]));
    const columns = matrix.map((_, i) => solved(even, matrix.map((__, j) => (i === j ? 1 : 0))));
    return columns.map((column, i) => column.map((value, j) => value * scale[i] * scale[j]));
  }

  return { sampleOf, logsOf, dampers, deviations, profile, projection };
})();
