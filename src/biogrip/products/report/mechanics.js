// The closed form of the linear model without inertia, corrected eqs. (4)-(6), for equal arms.
//
// A sample is {k_p, c_p, k: [...], c: [...]}, SI units; a gripper {k, c, lever}. With r_j = k_j/c_j,
//
//   phi(s) / tau(s) = 1 / f(s),   f(s) = k_g + c_g s + 2 b^2 (k_p + c_p s + sum k_j s / (s + r_j)).
//
// f rises everywhere between its poles -r_j, so that each of the intervals that these and zero
// cut off holds exactly one root. It is sought as its distance from the nearer end: none of the
// digits of a root close to a pole is lost.
const mechanics = (() => {
  const HALVINGS = 90;

  function branchesOf(sample) {
    const merged = new Map();
    sample.k.forEach((k, j) => {
      const rate = k / sample.c[j];
      merged.set(rate, (merged.get(rate) || 0) + k);
    });
    return [...merged].map(([rate, k]) => ({ rate, k })).sort((a, b) => a.rate - b.rate);
  }

  function modes(gripper, sample) {
    const coupling = 2 * gripper.lever ** 2;
    const branches = branchesOf(sample);
    const constant = gripper.k + coupling * sample.k_p;
    const slope = gripper.c + coupling * sample.c_p;
    // From which end (a rate) a root is counted, and by how much it is beyond.
    const distance = (j, end, by) => branches[j].rate === end ? -by : branches[j].rate - end - by;
    const f = (end, by) => {
      const s = -end - by;
      let sum = constant + slope * s;
      branches.forEach((b, j) => { sum += coupling * b.k * (s / distance(j, end, by)); });
      return sum;
    };
    const ends = [0, ...branches.map((b) => b.rate)];
    return ends.map((end, i) => {
      const next = ends[i + 1];
      let from = end, sign = 1, most = Math.max(end, 1) * 1e30;
      if (next !== undefined) {
        most = 0.5 * (next - end);
        // Above zero there the root is further out: counted from the next end, inwards.
        if (f(end, most) > 0) { from = next; sign = -1; }
      }
      let low = Math.log(most) - 160, high = Math.log(most);
      for (let n = 0; n < HALVINGS; n += 1) {
        const middle = 0.5 * (low + high);
        const above = f(from, sign * Math.exp(middle)) > 0;
        if (above === (sign > 0)) low = middle; else high = middle;
      }
      const by = sign * Math.exp(0.5 * (low + high));
      const rate = -from - by;
      let steepness = slope;
      branches.forEach((b, j) => {
        steepness += coupling * b.k * b.rate / distance(j, from, by) ** 2;
      });
      return { rate, rotation: 1 / (rate * steepness),
        force: -(gripper.k + gripper.c * rate) / (gripper.lever * rate * steepness) };
    });
  }

  // phi_n(z) = (e^z - sum_{k<n} z^k / k!) / z^n
  function phi(order, z) {
    if (order === 0) return Math.exp(z);
    if (Math.abs(z) < 1) {
      let value = 0, factorial = 1;
      for (let n = 2; n <= 18 + order; n += 1) factorial *= n;
      for (let k = 18; k >= 0; k -= 1) {
        value = value * z + 1 / factorial;
        factorial /= k + order;
      }
      return value;
    }
    let value = Math.expm1(z) / z, factorial = 1;
    for (let n = 1; n < order; n += 1) {
      factorial *= n;
      value = (value - 1 / factorial) / z;
    }
    return value;
  }

  // Torque is what sets in when: {jumps: [[time, order, height]], swings: [[time, omega, re, im]]}.
  function rotation(gripper, sample, torque, times) {
    const found = new Float64Array(times.length);
    for (const mode of modes(gripper, sample)) {
      for (const [start, order, height] of torque.jumps) {
        const amplitude = mode.rotation * height;
        for (let i = firstAfter(times, start); i < times.length; i += 1) {
          const t = times[i] - start;
          found[i] += amplitude * (order === 0 ? Math.expm1(mode.rate * t)
            : mode.rate * t ** (order + 1) * phi(order + 1, mode.rate * t));
        }
      }
      for (const [start, omega, re, im] of torque.swings) {
        // p / (i omega - p)
        const size = mode.rate ** 2 + omega ** 2;
        const shareRe = -(mode.rate ** 2) / size, shareIm = -mode.rate * omega / size;
        const aRe = mode.rotation * (re * shareRe - im * shareIm);
        const aIm = mode.rotation * (re * shareIm + im * shareRe);
        for (let i = firstAfter(times, start); i < times.length; i += 1) {
          const t = times[i] - start, fading = Math.exp(mode.rate * t);
          found[i] += aRe * (Math.cos(omega * t) - fading) - aIm * Math.sin(omega * t);
        }
      }
    }
    return found;
  }

  function jawForce(gripper, sample, torque, times) {
    const found = new Float64Array(times.length);
    const coupling = 2 * gripper.lever ** 2;
    const rest = 2 * gripper.lever * sample.k_p / (gripper.k + coupling * sample.k_p);
    const all = modes(gripper, sample);
    for (const [start, order, height] of torque.jumps) {
      let factorial = 1;
      for (let n = 2; n <= order; n += 1) factorial *= n;
      for (let i = firstAfter(times, start); i < times.length; i += 1) {
        const t = times[i] - start;
        let sum = rest / factorial;
        for (const mode of all) sum += mode.force * phi(order, mode.rate * t);
        found[i] += height * t ** order * sum;
      }
    }
    for (const [start, omega, re, im] of torque.swings) {
      let steadyRe = rest * re, steadyIm = rest * im;
      const fading = all.map((mode) => {
        const size = mode.rate ** 2 + omega ** 2;
        // i omega / (i omega - p) and p / (p - i omega), times the amplitude.
        const re1 = omega ** 2 / size, im1 = -omega * mode.rate / size;
        steadyRe += mode.force * (re * re1 - im * im1);
        steadyIm += mode.force * (re * im1 + im * re1);
        const re2 = mode.rate ** 2 / size, im2 = mode.rate * omega / size;
        return mode.force * (re * re2 - im * im2);
      });
      for (let i = firstAfter(times, start); i < times.length; i += 1) {
        const t = times[i] - start;
        found[i] += steadyRe * Math.cos(omega * t) - steadyIm * Math.sin(omega * t);
        all.forEach((mode, j) => { found[i] += fading[j] * Math.exp(mode.rate * t); });
      }
    }
    return found;
  }

  function scaled(torque, factor) {
    return {
      jumps: torque.jumps.map(([t, order, height]) => [t, order, factor * height]),
      swings: torque.swings.map(([t, omega, re, im]) => [t, omega, factor * re, factor * im]),
    };
  }

  function firstAfter(times, start) {
    let low = 0, high = times.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (times[middle] < start) low = middle + 1; else high = middle;
    }
    return low;
  }

  return { rotation, jawForce, scaled };
})();
