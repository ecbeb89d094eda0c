// What the page of a run is drawn with; knows nothing of the run.

const byId = id => document.getElementById(id);
const isKnown = value => value !== null && value !== undefined;
const anyKnown = values => values.some(isKnown);

/** A number as people write it, with so many significant digits. */
function figure(value, digits) {
  if (!isKnown(value)) return '–';
  return String(Number(value.toPrecision(digits || 4)));
}
const percent = ratio => isKnown(ratio) ? figure(100 * ratio, 3) + ' %' : '–';

function escaped(text) {
  return String(text).replace(/[&<>"']/g, c => '&#' + c.charCodeAt(0) + ';');
}

function element(parent, name, text, className) {
  const child = document.createElement(name);
  if (text !== undefined) child.textContent = text;
  if (className) child.className = className;
  parent.appendChild(child);
  return child;
}

function drawn(parent, name, attributes, text) {
  const child = document.createElementNS('http://www.w3.org/2000/svg', name);
  for (const key in attributes) child.setAttribute(key, attributes[key]);
  if (text !== undefined) child.textContent = text;
  parent.appendChild(child);
  return child;
}

/** Index ranges [first, last] over which a condition holds. */
function ranges(count, condition) {
  const found = [];
  for (let i = 0; i < count; ++i) {
    if (!condition(i)) continue;
    if (found.length && found[found.length - 1][1] === i - 1) found[found.length - 1][1] = i;
    else found.push([i, i]);
  }
  return found;
}

/** SVG path over index range [first, last], without steps below half a unit. */
function pathOf(x, y, first, last, step) {
  let path = '', fromX, fromY;
  for (let i = first; i <= last; ++i) {
    if (!isKnown(x[i]) || !isKnown(y[i])) { fromX = undefined; continue; }
    const starts = fromX === undefined;
    if (!starts && i < last && Math.hypot(x[i] - fromX, y[i] - fromY) < step) continue;
    path += `${starts ? 'M' : 'L'}${x[i]} ${y[i]}`;
    fromX = x[i];
    fromY = y[i];
  }
  return path;
}

function quantile(values, share) {
  const ascending = values.slice().sort((a, b) => a - b);
  return ascending[Math.round(share * (ascending.length - 1))];
}

/** Ticks of a log axis: 1, 2, 5 of every decade, or as few as there is room for. */
function logTicks(low, high, pixels) {
  const most = Math.max(2, Math.floor(pixels / 30));
  const first = Math.floor(Math.log10(low)), last = Math.ceil(Math.log10(high));
  const among = (steps, every) => {
    const found = [];
    for (let k = first; k <= last; ++k) {
      if (k % every) continue;
      for (const step of steps) {
        const v = Number(`${step}e${k}`);
        if (v >= low && v <= high) found.push(v);
      }
    }
    return found;
  };
  let ticks = among([1, 2, 5], 1);
  if (ticks.length < 2) {  // within one step: linear
    const rough = (high - low) / most, unit = Math.pow(10, Math.floor(Math.log10(rough)));
    const step = [1, 2, 5, 10].find(s => s * unit >= rough) * unit;
    ticks = [];
    for (let k = Math.ceil(low / step); k * step <= high; ++k) ticks.push(k * step);
  }
  for (let every = 1; ticks.length > most; ++every) ticks = among([1], every);
  return ticks.map(v => ({v, label: figure(v, 3)}));
}

/** What was applied fills the plot; what was asked beyond that leaves it. */
function rangeOfApplied(applied, asked) {
  const known = applied.filter(isKnown), all = known.concat(asked.filter(isKnown));
  if (known.length === 0) return null;
  const ends = values => [values.reduce((m, v) => Math.min(m, v), 0), values.reduce((m, v) => Math.max(m, v), 0)];
  const [low, high] = ends(known), [lowest, highest] = ends(all), margin = 0.25 * (high - low);
  return margin > 0 ? [Math.max(low - margin, lowest), Math.min(high + margin, highest)].map((v, i) => v + (i ? 0.02 : -0.02) * (high - low)) : null;
}
