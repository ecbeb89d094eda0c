// One moment of the run, shown everywhere at once: charts, camera image, robot from above, scene.

/**
 * view: {time, points, run, frames, charts, svg, size, limit, places: functions of a row to be called}
 */
function startPlayer(view) {
  const {time, charts} = view, last = time.length - 1;
  const film = JSON.parse(byId('film').textContent).map(([t, source]) => ({t: t - view.start, source}));
  const slider = byId('moment'), clock = byId('clock'), button = byId('play');
  if (last < 1) return;
  byId('player').hidden = false;
  slider.max = last;

  const cursors = charts.map(chart => element(chart.graphDiv, 'i', undefined, 'cursor'));
  function showInCharts(row) {
    charts.forEach((chart, i) => {
      chart.setSelection(row);
      const x = chart.toDomXCoord(time[row]), area = chart.getArea();
      cursors[i].style.display = x >= area.x && x <= area.x + area.w ? 'block' : 'none';
      cursors[i].style.left = x + 'px';
    });
  }

  const picture = film.length ? element(byId('image-view'), 'img') : null;
  const choices = [...byId('image-choice').querySelectorAll('button')];
  if (picture) {
    picture.alt = 'camera image of this moment';
    byId('image-view').insertBefore(picture, view.svg);
    picture.hidden = true;
  }
  /** The last picture that is not later. */
  function showPicture(row) {
    if (!picture) return;
    let k = film.findIndex(p => p.t > time[row] + 1e-6) - 1;
    if (k === -2) k = film.length - 1;
    if (k < 0) return;
    if (picture.src !== film[k].source) picture.src = film[k].source;
    if (!picture.hidden) return;
    picture.hidden = false;
    for (const other of byId('image-view').querySelectorAll('img')) other.hidden = other !== picture;
    for (const choice of choices) choice.setAttribute('aria-pressed', false);
  }

  const marks = drawn(view.svg, 'g', {});
  /** Where the points are, or are expected; around it two sigma of that. */
  function showMarks(row) {
    marks.replaceChildren();
    for (const point of view.points) {
      const u = point.u[row], v = point.v[row], sigma = point.sigma_uv && point.sigma_uv[row];
      if (!isKnown(u) || !isKnown(v)) continue;
      const isMeasured = point.measured[row] === 1;
      if (isKnown(sigma)) {
        drawn(marks, 'circle', {cx: u, cy: v, r: Math.min(2 * sigma, 4000), fill: point.colour, 'fill-opacity': 0.2, stroke: 'none'});
      }
      const ring = {cx: u, cy: v, r: 6 * view.size, fill: 'none', 'stroke-dasharray': isMeasured ? 'none' : `${3 * view.size}`};
      drawn(marks, 'circle', {...ring, stroke: '#fff', 'stroke-width': 4 * view.size});
      drawn(marks, 'circle', {...ring, stroke: point.colour, 'stroke-width': 2.2 * view.size});
    }
  }

  let row = last;
  function show(wanted) {
    row = Math.max(0, Math.min(last, wanted));
    slider.value = row;
    clock.textContent = `${time[row].toFixed(2)} s`;
    slider.setAttribute('aria-valuetext', clock.textContent);
    showInCharts(row);
    showPicture(row);
    showMarks(row);
    for (const place of view.places) place(row);
  }
  const rowAt = t => Math.max(0, time.findIndex((value, i) => i === last || time[i + 1] > t));
  function showTime(t) {
    const wanted = rowAt(t);
    if (wanted !== row) show(wanted);
  }
  const {toggle, stop, onKey} = playback(button, time[last], () => time[row], showTime);

  button.onclick = toggle;
  slider.oninput = () => { stop(); show(Number(slider.value)); };
  for (const chart of charts) {
    chart.updateOptions({clickCallback: (event, x) => {
      stop();
      show(time.reduce((best, t, i) => Math.abs(t - x) < Math.abs(time[best] - x) ? i : best, 0));
    }}, true);  // nothing is drawn anew
  }
  document.addEventListener('keydown', event => onKey(event, steps => show(row + steps)));
  for (const choice of choices) {
    choice.addEventListener('click', () => { stop(); if (picture) picture.hidden = true; marks.replaceChildren(); });
  }
  clock.textContent = `${time[last].toFixed(2)} s`;
  slider.value = last;
  // For a page that lays two runs side by side, and for tests.
  window.depthservo = {show, row: () => row, duration: time[last], showTime: t => { stop(); showTime(t); }};
}
