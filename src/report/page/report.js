(function () {
'use strict';

// Colour-blind safe (Okabe and Ito 2008; the last two Tol's, told apart by lightness). In depth charts the estimate is blue and the truth black;
// elsewhere each point has its own colour.
const COLOURS = ['#0072B2', '#E69F00', '#009E73', '#D55E00', '#CC79A7', '#56B4E9', '#882255', '#999933'];
const ESTIMATE = COLOURS[0], ASKED = COLOURS[1], TRUTH = '#000000';
const SHOWN_POINTS = 8;  // with charts of their own
const MOST_ROWS = 16;    // of the table, when there are many points
const MANY = 12;         // more of them are shown by their depths, not by their ways

const data = JSON.parse(document.getElementById('data').textContent);
const run = data.run, time = data.time, frames = data.frames;
const points = data.points.map((point, index) => (
  {...point.columns, id: point.id, limit: point.limit, colour: COLOURS[index % COLOURS.length]}));
const events = run.events.map(event =>
  ({time: event.time - data.start, last: event.last - data.start, count: event.count, what: event.what}));
const areMany = data.all_points > MANY;

const hiddenPeriods = some => areMany && some.length > 1 ? [] : ranges(time.length, i => some.some(p => p.measured[i] === 0))
  .map(range => [time[range[0]], time[Math.min(range[1] + 1, time.length - 1)]]);

// ---- Tables -------------------------------------------------------------------------------------

/** What happens to a depth at the end, beside how well it is known. */
const NOW = {converging: 'being learnt', valid: 'observed', unexcited: 'not excited', coasting: 'hidden'};
function nowOf(point) {
  if (run.observes_depth === false && (point.status === 'unexcited' || point.status === 'valid')) return 'as given';
  return NOW[point.status] || point.status;
}

function showPoints() {
  const table = byId('points');
  const hasTruth = run.points.some(point => isKnown(point.Z_true));
  const head = element(element(table, 'thead'), 'tr');
  const titles = ['point', 'Z ± 2 sigma [m]', 'known to'].concat(hasTruth ? ['truth [m]', 'error'] : [],
    ['at the end', 'seen', 'to 5 %']);
  for (const title of titles) element(head, 'th', title, title === 'at the end' ? 'words' : undefined);
  head.lastChild.title = 'When 2 sigma fell below 10 % of Z; +n fr.: forecast, after n frames more like the last';
  const body = element(table, 'tbody');
  const listed = data.all_points > points.length ? run.points.slice(0, MOST_ROWS) : run.points;
  for (const point of listed) {
    const row = element(body, 'tr'), name = element(row, 'td');
    const shown = points.find(p => p.id === point.id);
    element(name, 'span', '', 'chip').style.background = shown ? shown.colour : 'none';
    name.append(point.id);
    const says = run.observes_depth === false || !isKnown(point.sigma_Z) || 2 * point.sigma_Z < point.Z;
    element(row, 'td', !says ? '–' : figure(point.Z) + (isKnown(point.sigma_Z) ? ` ± ${figure(2 * point.sigma_Z, 2)}` : ''));
    element(row, 'td', isKnown(point.sigma_Z) && point.Z > 0 ? knownTo(point.Z, point.sigma_Z) : '–');
    if (hasTruth) {
      element(row, 'td', figure(point.Z_true));
      element(row, 'td', percent(point.relative_error));
    }
    element(row, 'td', nowOf(point), 'words');
    const all = point.measured_frames + point.hidden_frames;
    element(row, 'td', percent(all ? point.measured_frames / all : null));
    element(row, 'td', isKnown(point.time_to_5pct_s) ? `${figure(point.time_to_5pct_s, 2)} s`
      : isKnown(point.frames_to_5pct) ? `+${figure(point.frames_to_5pct)} fr.` : 'never');
  }
  if (listed.length === data.all_points) return;
  byId('left-out').hidden = false;
  byId('left-out').textContent = `${listed.length} of ${data.all_points} points: those measured longest and those whose ` +
    `error is largest for their sigma. ${data.all_points - listed.length} are left out; features.csv has all.`;
}

/** The range in which depths are reported, as far as the configuration says. */
const range = {Z_min: 0, Z_max: Infinity, ...(run.configuration || {}).depth, ...run.configuration};
const isHeld = Z => Z >= 0.999 * range.Z_max || Z <= 1.001 * range.Z_min;

/** Two sigma as a share; above 100 % nothing is known, nor at an end of the range. */
function knownTo(Z, sigma_Z) {
  if (isHeld(Z)) return 'end of range';
  return 2 * sigma_Z < Z ? figure(200 * sigma_Z / Z, 2) + ' %' : 'not known';
}

function showFigures() {
  const list = byId('figures'), m = run.metrics, errors = run.robot_errors;
  const rows = [
    ['duration', `${figure(m.duration_s)} s, ${m.frames} frames`],
    ['image error', isKnown(m.final_error_px)
      ? figure(m.final_error_px, 3) + ' px rms (mean places of the last 2 s to the goals)' : null],
    ['camera at the end', isKnown(run.way_left) ? run.way_left : null],
    [run.truth_is_pose_of_motion ? 'disagreement with the pose of the target' : 'worst final depth error',
      isKnown(m.final_depth_error_max) ? percent(m.final_depth_error_max) + (run.truth_is_pose_of_motion
        ? ' at most. The same pose told the motion: this is agreement, not accuracy' : '') : null],
    ['points', isKnown(m.points_gone) && m.points_gone > 0
      ? `${data.all_points} at the end; ${m.points_gone} came and went` : null],
    ['truth within 2 sigma', isKnown(m.coverage_2sigma)
      ? percent(m.coverage_2sigma) + ' of the estimates (95.4 % if honest)' : null],
    ['lowest frame rate', isKnown(m.min_frame_rate) ? figure(m.min_frame_rate, 3) + ' Hz' : null],
    ['longest gap', m.max_gap_s > 0 ? figure(m.max_gap_s, 3) + ' s' : 'none'],
    ['smallest distance to the border', isKnown(m.min_border_px)
      ? figure(m.min_border_px, 3) + ' px' + (m.all_in_image ? '' : ' (outside the image)') : null],
    ['errors of the robot that were allowed for', errors && errors.profile ? (errors.considered
      ? `profile ${errors.profile}; its sizes stand under Effective configuration` : 'white noise alone') : null],
    ['images against odometry', run.diagnosis && run.diagnosis.cause === 'none' ? run.diagnosis.message : null],
    ...((run.joint && run.joint.words) || []).map(words => ['joint filter', words]),
    ['noise, learnt', run.noise ? run.noise.words : null],
    ['seed', run.seed],
  ];
  for (const [name, value] of rows) {
    if (value === null) continue;
    element(list, 'dt', name);
    element(list, 'dd', value);
  }
}

// ---- Paths in the image -------------------------------------------------------------------------

/** The drawing over the image, and the size of its marks. */
let over = null;
function showImage() {
  const view = byId('image-view'), width = run.camera.width, height = run.camera.height;
  const size = Math.max(width, height) / 640;  // marks keep their size on the page
  const svg = drawn(view, 'svg', {viewBox: `-0.5 -0.5 ${width} ${height}`, role: 'img',
    'aria-label': 'paths of the points in the image'});
  over = {svg, size};
  const line = (path, colour, dashed) => {
    if (!path) return;
    const common = {d: path, fill: 'none', 'stroke-linejoin': 'round'};
    if (!dashed) drawn(svg, 'path', {...common, stroke: '#fff', 'stroke-width': 4 * size, 'stroke-opacity': 0.7});
    drawn(svg, 'path', {...common, stroke: colour, 'stroke-width': 1.8 * size,
      'stroke-dasharray': dashed ? `${2 * size} ${3.5 * size}` : 'none'});
  };
  if (areMany) showCorners(svg, size);
  else for (const point of points) {
    for (const measured of [0, 1]) {
      for (const [first, last] of ranges(time.length, i => point.measured[i] === measured)) {
        // A hidden stretch joins its neighbours.
        const from = measured ? first : Math.max(first - 1, 0);
        const to = measured ? last : Math.min(last + 1, time.length - 1);
        line(pathOf(point.u, point.v, from, to, 0.5), point.colour, !measured);
      }
    }
  }
  for (const [u, v] of run.goals) {
    const arm = 7 * size, cross = `M${u - arm} ${v}H${u + arm}M${u} ${v - arm}V${v + arm}`;
    drawn(svg, 'path', {d: cross, stroke: '#fff', 'stroke-width': 4.5 * size});
    drawn(svg, 'path', {d: cross, stroke: '#000', 'stroke-width': 1.8 * size});
  }
  for (const point of areMany ? [] : points) {
    const first = point.u.findIndex(isKnown);
    let last = point.u.length - 1;
    while (last > first && !isKnown(point.u[last])) --last;
    if (first < 0) continue;
    const ring = {r: 5 * size, stroke: point.colour, 'stroke-width': 2 * size};
    drawn(svg, 'circle', {...ring, cx: point.u[first], cy: point.v[first], fill: '#fff'});
    drawn(svg, 'circle', {...ring, cx: point.u[last], cy: point.v[last], r: 3.5 * size, fill: point.colour});
    drawn(svg, 'text', {x: point.u[first] + 8 * size, y: point.v[first] - 6 * size,
      style: `font-size: ${13 * size}px; paint-order: stroke; stroke: #fff; stroke-width: ${3 * size}px`}, point.id);
  }
  if (!areMany) {
    byId('image-key').innerHTML = '○ start &nbsp; ● end &nbsp; ' +
      (run.goals.length ? '<span class="cross">+</span> goal &nbsp; ' : '') + '┄ hidden';
  }

  const images = ['first', 'last'].filter(stem => byId('image-' + stem));
  const buttons = images.map(stem => element(byId('image-choice'), 'button', stem + ' image'));
  const choose = chosen => images.forEach((stem, i) => {
    byId('image-' + stem).hidden = i !== chosen;
    buttons[i].setAttribute('aria-pressed', i === chosen);
  });
  buttons.forEach((button, i) => { button.type = 'button'; button.onclick = () => choose(i); });
  choose(images.length - 1);
}

/** Near to far, light and colour-blind safe on gray images (viridis). */
const RAMP = ['#fde725', '#a0da39', '#4ac16d', '#1fa187', '#277f8e', '#365c8d', '#46327e', '#440154'];

/** The points of the last image by depth; a ring: not known to 20 %. */
function showCorners(svg, size) {
  byId('image').querySelector('.title').textContent = 'Points of the last image by depth';
  const last = data.last, known = last.Z.map((Z, i) => 2 * last.sigma_Z[i] < 0.2 * Z && !isHeld(Z) && last.measured[i] === 1);
  const depths = last.Z.filter((Z, i) => known[i]);
  const low = depths.length ? quantile(depths, 0.05) : 1, high = depths.length ? quantile(depths, 0.95) : 1;
  const colourOf = Z => {
    const place = high > low ? Math.log(Z / low) / Math.log(high / low) : 0.5;
    return RAMP[Math.max(0, Math.min(RAMP.length - 1, Math.floor(place * RAMP.length)))];
  };
  last.u.forEach((u, i) => {
    if (!isKnown(u) || !isKnown(last.v[i]) || last.measured[i] !== 1) return;
    const mark = drawn(svg, 'circle', {cx: u, cy: last.v[i], r: (known[i] ? 4 : 2.5) * size,
      fill: known[i] ? colourOf(last.Z[i]) : 'none', stroke: known[i] ? '#000' : '#666', 'stroke-width': 0.8 * size});
    drawn(mark, 'title', {}, `${figure(last.Z[i], 3)} m, 2 sigma ${figure(2 * last.sigma_Z[i], 2)} m`);
  });
  const key = byId('image-key');
  if (depths.length) {
    key.append(`${figure(low, 3)} m `);
    for (const colour of RAMP) element(key, 'span', '', 'ramp').style.background = colour;
    key.append(` ${figure(high, 3)} m   `);
  }
  key.append(`● ${depths.length} known to 20 %   ○ not yet`);
  key.style.whiteSpace = 'pre-wrap';
}

/** Error in sigmas of the depths of the last image or, without truth, how well they are known. */
function showHistogram() {
  if (!areMany) return;
  const last = data.last, claims = ['valid', 'converging'];
  const used = last.Z.map((Z, i) => i).filter(i => claims.includes(data.statuses[last.status[i]]));
  const errors = used.filter(i => isKnown(last.Z_true[i]))
    .map(i => (1 / last.Z[i] - 1 / last.Z_true[i]) / (last.sigma_Z[i] / (last.Z[i] * last.Z[i])));
  const isError = errors.length > 0;
  const values = isError ? errors : used.map(i => 100 * last.sigma_Z[i] / last.Z[i]);
  if (values.length === 0) return;
  const bins = 16, low = isError ? -4 : 0, high = isError ? 4 : 40;
  const counts = new Array(bins).fill(0);
  for (const value of values) ++counts[Math.max(0, Math.min(bins - 1, Math.floor((value - low) / (high - low) * bins)))];
  const width = 560, height = 170, bottom = 34, left = 34, top = 8;
  byId('histogram').hidden = false;
  byId('histogram').querySelector('.title').textContent = isError
    ? `Error of 1/Z in sigmas, ${values.length} points (line: an honest sigma)` : `sigma of Z, ${values.length} points [% of Z]`;
  const svg = drawn(byId('histogram'), 'svg', {viewBox: `0 0 ${width} ${height}`, role: 'img', 'aria-label': 'histogram'});
  const toX = value => left + (value - low) / (high - low) * (width - left - 8);
  const honest = x => values.length * (high - low) / bins * Math.exp(-x * x / 2) / Math.sqrt(2 * Math.PI);
  const most = Math.max(...counts, isError ? honest(0) : 0);
  const toY = count => height - bottom - count / most * (height - bottom - top);
  counts.forEach((count, i) => drawn(svg, 'rect', {x: toX(low + i * (high - low) / bins) + 1, y: toY(count),
    width: (width - left - 8) / bins - 2, height: height - bottom - toY(count), fill: ESTIMATE, 'fill-opacity': 0.75}));
  if (isError) {
    let path = '';
    for (let x = low; x <= high; x += 0.1) path += `${path ? 'L' : 'M'}${toX(x)} ${toY(honest(x))}`;
    drawn(svg, 'path', {d: path, fill: 'none', stroke: TRUTH, 'stroke-width': 1.5});
  }
  for (let k = 0; k <= 4; ++k) {
    const value = low + k * (high - low) / 4, end = k === 4 ? ' and more' : k === 0 && isError ? ' and less' : '';
    drawn(svg, 'text', {x: toX(value), y: height - 12, 'text-anchor': k === 4 ? 'end' : k === 0 ? 'start' : 'middle'},
      figure(value) + end);
  }
  drawn(svg, 'text', {x: left - 4, y: top + 10, 'text-anchor': 'end'}, Math.round(most));
}

// ---- Robot path from above ----------------------------------------------------------------------

/** Outline of the target on the floor and the direction it faces, from the configuration; or nothing. */
function plateFromAbove() {
  const target = run.configuration && run.configuration.target;
  if (!target || !target.pose || !Array.isArray(target.points) || target.points.length === 0) return null;
  const [r, p, y] = target.pose.rpy || [0, 0, 0], [X, Y] = target.pose.xyz || [0, 0];
  const cr = Math.cos(r), sr = Math.sin(r), cp = Math.cos(p), sp = Math.sin(p), cy = Math.cos(y), sy = Math.sin(y);
  // First two rows of Rz(yaw) Ry(pitch) Rx(roll).
  const rotate = q => [
    cy * cp * q[0] + (cy * sp * sr - sy * cr) * q[1] + (cy * sp * cr + sy * sr) * q[2],
    sy * cp * q[0] + (sy * sp * sr + cy * cr) * q[1] + (sy * sp * cr - cy * sr) * q[2]];
  const corners = target.points.map(q => rotate(q)).map(q => [q[0] + X, q[1] + Y]);
  const facing = rotate([0, 0, -1]);  // object z points away from whoever sees the front
  if (!corners.flat().concat(facing).every(Number.isFinite)) return null;
  return {corners, facing, centre: [0, 1].map(k => corners.reduce((sum, q) => sum + q[k], 0) / corners.length)};
}

/** Called with the row that is shown. */
const places = [];
function showRobot() {
  const x = frames.robot_x, y = frames.robot_y, theta = frames.robot_theta;
  const known = ranges(time.length, i => isKnown(x[i]) && isKnown(y[i]));
  if (known.length === 0) return;
  byId('robot').hidden = false;
  const plate = plateFromAbove();
  let goal = run.configuration && run.configuration.robot && run.configuration.robot.goal;
  if (run.configuration && (run.configuration.robot || {}).type === 'free') goal = null;
  const all = x.map((value, i) => [value, y[i]]).filter(q => isKnown(q[0]) && isKnown(q[1]));
  if (plate) all.push(...plate.corners);
  if (goal) all.push([goal.x, goal.y]);
  const low = [0, 1].map(k => all.reduce((m, q) => Math.min(m, q[k]), Infinity));
  const high = [0, 1].map(k => all.reduce((m, q) => Math.max(m, q[k]), -Infinity));

  // Equal scales; world x to the right, y up.
  const width = 560, margin = {left: 44, right: 26, top: 22, bottom: 34};
  const extent = Math.max(high[0] - low[0], (high[1] - low[1]) * 1.2, 0.2);
  const scale = (width - margin.left - margin.right) / extent;
  const inner = Math.max((high[1] - low[1]) * scale, 90), height = inner + margin.top + margin.bottom;
  const middle = (low[1] + high[1]) / 2, centre = (low[0] + high[0]) / 2;
  const toX = value => margin.left + (width - margin.left - margin.right) / 2 + (value - centre) * scale;
  const toY = value => margin.top + inner / 2 - (value - middle) * scale;
  const svg = drawn(byId('robot'), 'svg', {viewBox: `0 0 ${width} ${height}`, role: 'img',
    'aria-label': 'robot path from above'});

  const steps = [0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50];
  const tickOf = space => steps.find(step => step * scale >= space) || 100;
  const tick = tickOf(55), tickY = Math.min(tick, tickOf(22));
  const grid = {stroke: '#e2e2e2', 'stroke-width': 1};
  const left = centre - extent / 2, bottom = middle - inner / 2 / scale;
  for (let k = Math.ceil(left / tick); k * tick <= left + extent + 1e-9; ++k) {
    drawn(svg, 'path', {...grid, d: `M${toX(k * tick)} ${margin.top - 8}V${height - margin.bottom + 8}`});
    drawn(svg, 'text', {x: toX(k * tick), y: height - 8, 'text-anchor': 'middle'}, figure(k * tick, 3));
  }
  for (let k = Math.ceil(bottom / tickY); k * tickY <= bottom + inner / scale + 1e-9; ++k) {
    drawn(svg, 'path', {...grid, d: `M${margin.left - 8} ${toY(k * tickY)}H${width - margin.right + 8}`});
    drawn(svg, 'text', {x: margin.left - 12, y: toY(k * tickY) + 4, 'text-anchor': 'end'}, figure(k * tickY, 3));
  }
  if (plate) {
    const line = plate.corners.map(q => `${toX(q[0])} ${toY(q[1])}`).join('L');
    drawn(svg, 'path', {d: 'M' + line + 'Z', stroke: '#000', 'stroke-width': 4, fill: 'none', 'stroke-linejoin': 'round'});
    const [cx, cy] = [toX(plate.centre[0]), toY(plate.centre[1])];
    drawn(svg, 'path', {d: `M${cx} ${cy}l${24 * plate.facing[0]} ${-24 * plate.facing[1]}`, stroke: '#000', 'stroke-width': 1.5});
    drawn(svg, 'text', {x: cx, y: margin.top - 10, 'text-anchor': cx > width - 60 ? 'end' : 'middle'}, 'target');
  }
  for (const [first, last] of known) {
    drawn(svg, 'path', {d: pathOf(x.map(v => isKnown(v) ? toX(v) : null), y.map(v => isKnown(v) ? toY(v) : null), first, last, 0.5),
      fill: 'none', stroke: ESTIMATE, 'stroke-width': 2});
  }
  const robotAt = (px, py, heading, style) => drawn(svg, 'path', {...style, d: 'M10 0L-6 6L-3 0L-6 -6Z',
    transform: `translate(${toX(px)} ${toY(py)}) rotate(${-(heading || 0) * 180 / Math.PI})`});
  const begin = known[0][0], end = known[known.length - 1][1];
  if (goal) robotAt(goal.x, goal.y, goal.theta, {fill: 'none', stroke: '#000', 'stroke-width': 1.2});
  robotAt(x[begin], y[begin], theta[begin], {fill: '#fff', stroke: ESTIMATE, 'stroke-width': 1.5});
  robotAt(x[end], y[end], theta[end], {fill: ESTIMATE, 'fill-opacity': 0.85});
  let now = null;
  places.push(row => {
    if (now) now.remove();
    now = isKnown(x[row]) ? robotAt(x[row], y[row], theta[row], {fill: ASKED, stroke: '#000', 'stroke-width': 0.8}) : null;
  });
  element(byId('robot'), 'p', '▷ start   ▶ end' + (goal ? '   black outline: goal' : ''), 'key').style.whiteSpace = 'pre';
}

// ---- Charts -------------------------------------------------------------------------------------

const charts = [], waiting = [];

/**
 * A time chart. lines: [{name, values, colour, low, high}]; low and high make a band.
 * options: {log, steps, limit: upper end of the plot, range: both ends, hidden: periods to shade, value: (line, row) => legend text}
 */
function chart(title, lines, options) {
  lines = lines.filter(line => anyKnown(line.values));
  if (lines.length === 0) return;
  const figureElement = element(byId('charts'), 'figure');
  const caption = element(figureElement, 'figcaption');
  element(caption, 'span', title + (options.log ? ', log scale' : ''), 'title');
  const legend = element(caption, 'div', undefined, 'legend');
  const body = element(figureElement, 'div', undefined, 'chart-body');
  const hasBand = lines.some(line => line.low);
  const usable = value => isKnown(value) && (!options.log || value > 0) ? value : null;
  const cell = (line, row) => {
    const value = usable(line.values[row]);
    if (!hasBand) return value;
    if (value === null) return [null, null, null];
    if (!line.low) return [value, value, value];
    const high = line.high[row];
    const far = 3 * options.limit;  // beyond the plot
    return [line.low[row], Math.min(value, far), Math.min(isKnown(high) ? high : far, far)];
  };
  const rows = time.map((t, row) => [t, ...lines.map(line => cell(line, row))]);
  const names = lines.map(line => line.name);
  const settings = {
    labels: ['time'].concat(names.map(escaped)),
    colors: lines.map(line => line.colour),
    customBars: hasBand, fillAlpha: 0.22, strokeWidth: 1.6,
    logscale: Boolean(options.log), stepPlot: Boolean(options.steps),
    includeZero: !options.log && !hasBand,
    legend: 'always', labelsDiv: legend, labelsKMB: false,
    axisLabelFontSize: 12, gridLineColor: '#e6e6e6', axisLineColor: '#909090',
    valueRange: options.limit ? [0, options.limit] : options.range || null,
    xRangePad: 0, yRangePad: 8, animatedZooms: false, highlightCircleSize: 3.5,
    legendFormatter: shown => {
      const row = shown.x === undefined ? -1 : shown.dygraph.getSelection();
      const parts = lines.map(line => `<i style="border-color:${line.colour}"></i>${escaped(line.name)}` +
        (row >= 0 ? ` <b>${escaped(options.value ? options.value(line, row) : figure(line.values[row], 3))}</b>` : ''));
      return (row >= 0 ? `${time[row].toFixed(2)} s` : '').padEnd(8, '\u2007') + parts.join('');
    },
    axes: {x: {axisLabelFormatter: value => figure(value, 6) + ' s', pixelsPerLabel: 70},
           y: {axisLabelFormatter: value => figure(value, 6), axisLabelWidth: 48, pixelsPerLabel: 26,
               ...(options.log ? {ticker: logTicks} : {})}},
    underlayCallback: (context, area, graph) => {
      context.save();
      context.fillStyle = '#e4e4e4';
      for (const [begin, end] of options.hidden) {
        const x = graph.toDomXCoord(begin);
        context.fillRect(x, area.y, Math.max(graph.toDomXCoord(end) - x, 1), area.h);
      }
      context.strokeStyle = '#808080';
      context.lineWidth = 0.7;
      context.beginPath();
      const marks = [];
      events.forEach((event, i) => {
        const x = Math.round(graph.toDomXCoord(event.time)) + 0.5;
        if (x < area.x || x > area.x + area.w) return;
        context.moveTo(x, area.y);
        context.lineTo(x, area.y + area.h);
        const near = marks[marks.length - 1];
        if (near && x - near.x < 18) near.last = i + 1;
        else marks.push({x, first: i + 1, last: i + 1});
      });
      context.stroke();
      context.fillStyle = '#404040';
      context.font = '11px system-ui, "DejaVu Sans", sans-serif';
      for (const {x, first, last} of marks) {  // their numbers in the list of events
        const words = first === last ? `${first}` : `${first}–${last}`, width = context.measureText(words).width;
        context.fillText(words, Math.min(x + 3, area.x + area.w - width), area.y + 10);
      }
      context.restore();
    },
  };
  waiting.push(() => {
    const graph = new Dygraph(body, rows, settings);
    charts.push(graph);
    new ResizeObserver(() => graph.resize()).observe(body);
  });
}

function showDepth(point) {
  const value = (line, row) => {
    if (line.name === 'truth') return figure(point.Z_true[row]) + ' m';
    return `${figure(point.Z[row])} ± ${figure(2 * point.sigma_Z[row], 2)} m, ${data.statuses[point.status[row]] || ''}`;
  };
  chart(`Depth of point ${point.id} [m], ± 2 sigma`, [
    {name: 'truth', values: point.Z_true, colour: TRUTH},
    {name: 'estimate', values: point.Z, low: point.Z_low, high: point.Z_high, colour: ESTIMATE},
  ], {limit: point.limit, hidden: hiddenPeriods([point]), value});
}

/** When the depths that are shown are known to 5 %, thrice: where their story is; nothing when that is most of the run. */
function storyEnd() {
  const times = run.points.map(point => point.time_to_5pct_s).filter(isKnown);
  const end = times.length ? 3 * quantile(times, 0.75) : 0;
  return end > time[Math.min(10, time.length - 1)] && end < 0.4 * time[time.length - 1] ? Number(end.toPrecision(2)) : null;
}

function showCharts() {
  const hidden = hiddenPeriods(points);
  const shown = points.slice(0, SHOWN_POINTS);
  shown.forEach(showDepth);
  const perPoint = values => shown.map(point => ({name: `${point.id}`, colour: point.colour, values: values(point)}));
  chart('Depth error |Z − truth| / truth by point [%]',
    perPoint(point => point.error.map(error => isKnown(error) ? 100 * error : null)), {log: true, hidden});
  if (shown.some(point => point.excitation.some(value => value > 0))) {
    chart('Excitation by point: speed across the line of sight [m/s]', perPoint(point => point.excitation), {hidden});
  }
  chart('Image error [px rms]', [{name: 'distance to the goal', values: frames.error_px, colour: ESTIMATE}], {log: true, hidden});
  const names = run.command_names, columns = Object.keys(frames);
  const asked = columns.filter(name => name.startsWith('command_'));
  names.forEach((name, i) => {
    const applied = frames[asked[i].replace('command_', 'applied_')];
    chart(`Command ${name}`, [
      {name: 'asked', values: frames[asked[i]], colour: ASKED},
      {name: 'applied', values: applied, colour: ESTIMATE},
    ], {steps: true, hidden, range: rangeOfApplied(applied, frames[asked[i]])});
  });
  if (names.length === 0) {
    const axes = prefix => ['x', 'y', 'z'].map((axis, i) => ({name: prefix + axis, colour: COLOURS[i], values: frames[prefix + axis]}));
    chart('Camera velocity by odometry [m/s]', axes('v'), {hidden});
    chart('Camera rotation by odometry [rad/s]', axes('w'), {hidden});
  }
  if (data.all_points > shown.length) {
    element(byId('charts'), 'p', `Charts show the first ${shown.length} points of the table; features.csv has all ` +
      `${data.all_points}.`, 'hint');
  }
  for (const draw of waiting) draw();  // now that the layout is final
  if (charts.length > 1) Dygraph.synchronize(charts, {zoom: true, selection: true, range: false});
}

function zoomTo(begin, end) {
  if (charts.length) charts[0].updateOptions({dateWindow: [begin, end]});
}

function showEvents() {
  if (events.length === 0) return;
  byId('events').hidden = false;
  const total = time[time.length - 1];
  events.forEach((event, i) => {
    const item = element(byId('event-list'), 'li');
    element(item, 'span', `${i + 1}`, 'number');
    const button = element(item, 'button', event.time.toFixed(2) + ' s');
    button.type = 'button';
    button.title = 'Show this moment in the charts';
    button.onclick = () => {
      zoomTo(Math.max(event.time - 1.5, 0), Math.min(event.time + 1.5, total));
      byId('charts').scrollIntoView();
    };
    item.append(event.count > 1 ? `${event.count} × ${event.what} (until ${event.last.toFixed(2)} s)` : event.what);
  });
}

showPoints();
showFigures();
showImage();
showHistogram();
showRobot();
showCharts();
showEvents();
const view = {time, points, run, frames, charts, places, start: data.start, ...over};
places.push(startScene(view));
startPlayer(view);
const story = storyEnd();
if (story !== null) {
  byId('story').hidden = false;
  byId('story').lastElementChild.textContent = `the first ${story} s`;
  byId('story').lastElementChild.onclick = () => zoomTo(time[0], story);
}
byId('whole').onclick = () => zoomTo(time[0], time[time.length - 1]);
if (data.bucket > 1) {
  byId('thinned').textContent = ` · thinned: every two points of a curve are the extremes of ${data.bucket} images`;
}
byId('configuration').textContent =
  JSON.stringify({...run.configuration, ...(run.robot_errors && {robot_errors: run.robot_errors})}, null, 2);
byId('origin').textContent = (data.start !== 0 ? `Time 0 is ${data.start} s. ` : '') +
  Object.entries(run.versions).map(([name, version]) => `${name} ${version}`).join(', ') + '.';
})();
