// The run in space: what odometry says of the camera's way, and the points along their rays.

/** Poses of the camera in the frame of its first image: the twists of odometry, one after the other. */
function posesOf(time, frames) {
  const poses = [{R: [[1, 0, 0], [0, 1, 0], [0, 0, 1]], t: [0, 0, 0]}];
  for (let i = 1; i < time.length; ++i) {
    const {R, t} = poses[i - 1], dt = time[i] - time[i - 1];
    const part = names => names.map(name => isKnown(frames[name][i]) ? frames[name][i] * dt : 0);
    const v = part(['vx', 'vy', 'vz']), w = part(['wx', 'wy', 'wz']);
    const angle = Math.hypot(...w), a = angle > 1e-9 ? Math.sin(angle) / angle : 1,
      b = angle > 1e-9 ? (1 - Math.cos(angle)) / (angle * angle) : 0.5;
    const W = [[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]];
    const turn = W.map((line, r) => line.map((value, c) =>
      (r === c ? 1 : 0) + a * value + b * [0, 1, 2].reduce((sum, k) => sum + W[r][k] * W[k][c], 0)));
    poses.push({
      R: R.map(line => [0, 1, 2].map(c => line[0] * turn[0][c] + line[1] * turn[1][c] + line[2] * turn[2][c])),
      t: [0, 1, 2].map(k => t[k] + R[k][0] * v[0] + R[k][1] * v[1] + R[k][2] * v[2]),
    });
  }
  return poses;
}

const inWorld = ({R, t}, p) => [0, 1, 2].map(k => t[k] + R[k][0] * p[0] + R[k][1] * p[1] + R[k][2] * p[2]);

const isTargetMoving = configuration => Boolean(configuration && configuration.target && (configuration.target.twist || [])
  .some(part => [...(part.v || []), ...(part.amplitude || [])].some(Boolean)));
const meanOf = places => places.length ? [0, 1, 2].map(k => places.reduce((sum, p) => sum + p[k], 0) / places.length) : null;

/** Outline of a base on wheels in the frame of its camera, as far as the configuration says; or nothing. */
function baseOutline(robot) {
  if (!robot || !Array.isArray(robot.camera_offset) || !['unicycle', 'omni'].includes(robot.type)) return null;
  const [ox, oy, oz] = robot.camera_offset, yaw = robot.camera_yaw || 0;
  return [[0.14, 0], [-0.1, 0.09], [-0.05, 0], [-0.1, -0.09]].map(([x, y]) => {
    const dx = x - ox, dy = y - oy;  // robot: x forward, y left, z up; camera: x right, y down, z forward
    const forward = dx * Math.cos(yaw) + dy * Math.sin(yaw), left = dy * Math.cos(yaw) - dx * Math.sin(yaw);
    return [-left, oz, forward];
  });
}

/** Returns a function of the row that is to be shown. view: as of startPlayer. */
function startScene(view) {
  const {time, points, run, frames} = view, camera = run.camera;
  const poses = posesOf(time, frames), canvas = byId('scene-view');
  const atRow = (row, Z, point) => isKnown(Z) && isKnown(point.u[row]) ? inWorld(poses[row],
    [Z * (point.u[row] - camera.cx) / camera.fx, Z * (point.v[row] - camera.cy) / camera.fy, Z]) : null;
  const end = time.length - 1;
  const places = points.map(point => atRow(end, point.Z[end], point)).filter(isKnown);
  const wayOfTarget = isTargetMoving(run.configuration) ? time.map((t, i) => meanOf(points.map(point => atRow(i,
    isKnown(point.Z_true[i]) ? point.Z_true[i] : point.Z[i], point)).filter(isKnown))).filter(isKnown) : [];
  const all = poses.map(pose => pose.t).concat(places.filter(p => p[2] < 50), wayOfTarget.filter(p => p[2] < 50));
  if (all.length < 2) return () => {};
  byId('scene').hidden = false;
  const low = [0, 1, 2].map(k => all.reduce((m, p) => Math.min(m, p[k]), Infinity));
  const high = [0, 1, 2].map(k => all.reduce((m, p) => Math.max(m, p[k]), -Infinity));
  const centre = low.map((value, k) => (value + high[k]) / 2);
  const extent = Math.max(0.3, Math.hypot(...high.map((value, k) => value - low[k])));
  const base = baseOutline(run.configuration && run.configuration.robot);
  let yaw = 0.6, pitch = 0.45, zoom = 1, row = end;

  function project(p) {
    const q = p.map((value, k) => value - centre[k]);
    const x = q[0] * Math.cos(yaw) - q[2] * Math.sin(yaw), z = q[0] * Math.sin(yaw) + q[2] * Math.cos(yaw);
    const scale = 0.92 * zoom * Math.min(canvas.width, canvas.height * 1.5) / extent;
    return [canvas.width / 2 + scale * x, canvas.height / 2 + scale * (q[1] * Math.cos(pitch) - z * Math.sin(pitch))];
  }

  function draw() {
    const ratio = window.devicePixelRatio || 1, box = canvas.getBoundingClientRect();
    canvas.width = box.width * ratio;
    canvas.height = box.height * ratio;
    const pen = canvas.getContext('2d');
    pen.lineJoin = 'round';
    const line = (corners, colour, width, fill) => {
      pen.beginPath();
      corners.map(project).forEach(([x, y], i) => i ? pen.lineTo(x, y) : pen.moveTo(x, y));
      pen.strokeStyle = colour;
      pen.lineWidth = width * ratio;
      if (fill) { pen.closePath(); pen.fillStyle = fill; pen.fill(); }
      pen.stroke();
    };
    const path = poses.map(pose => pose.t);
    if (wayOfTarget.length > 1) line(wayOfTarget, '#E69F00', 1.4);
    line(path, '#c8c8c8', 1.2);
    line(path.slice(0, row + 1), '#0072B2', 2);
    for (const point of points) {
      const here = atRow(row, point.Z[row], point);
      if (!here) continue;
      const near = atRow(row, point.Z_low[row], point);
      const far = atRow(row, Math.min(isKnown(point.Z_high[row]) ? point.Z_high[row] : Infinity, 2 * extent), point);
      if (near && far) line([near, far], point.colour, 1.6);
      const truth = atRow(row, point.Z_true[row], point), [x, y] = project(here);
      pen.beginPath();
      pen.arc(x, y, 4 * ratio, 0, 2 * Math.PI);
      pen.fillStyle = point.measured[row] === 1 ? point.colour : '#fff';
      pen.strokeStyle = point.colour;
      pen.lineWidth = 1.6 * ratio;
      pen.fill();
      pen.stroke();
      if (!truth) continue;
      const [tx, ty] = project(truth), arm = 5 * ratio;
      pen.beginPath();
      pen.moveTo(tx - arm, ty);
      pen.lineTo(tx + arm, ty);
      pen.moveTo(tx, ty - arm);
      pen.lineTo(tx, ty + arm);
      pen.strokeStyle = '#000';
      pen.lineWidth = 1.2 * ratio;
      pen.stroke();
    }
    const pose = poses[row], depth = 0.09 * extent;
    const corners = [[0, 0], [camera.width, 0], [camera.width, camera.height], [0, camera.height]].map(([u, v]) =>
      inWorld(pose, [depth * (u - camera.cx) / camera.fx, depth * (v - camera.cy) / camera.fy, depth]));
    if (base) line(base.map(p => inWorld(pose, p)), '#555', 1.4, 'rgba(0, 0, 0, 0.12)');
    line(corners, '#000', 1.4, 'rgba(0, 114, 178, 0.12)');
    for (const corner of corners) line([pose.t, corner], '#000', 1);
  }

  let grip = null;
  canvas.addEventListener('pointerdown', event => { grip = [event.clientX, event.clientY]; canvas.setPointerCapture(event.pointerId); });
  canvas.addEventListener('pointerup', () => { grip = null; });
  canvas.addEventListener('pointermove', event => {
    if (grip) turn((event.clientX - grip[0]) / 150, (event.clientY - grip[1]) / 150);
    if (grip) grip = [event.clientX, event.clientY];
  });
  canvas.addEventListener('wheel', event => {
    if (document.activeElement !== canvas) return;  // the page scrolls
    zoomBy(event.deltaY < 0 ? 1.15 : 1 / 1.15);
    event.preventDefault();
  }, {passive: false});
  canvas.addEventListener('keydown', event => {
    const turns = {ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, -0.1], ArrowDown: [0, 0.1]}[event.key];
    if (turns) turn(...turns);
    else if (event.key === '+') zoomBy(1.15);
    else if (event.key === '-') zoomBy(1 / 1.15);
    else return;
    event.preventDefault();
    event.stopPropagation();
  });
  function turn(right, down) {
    yaw += right;
    pitch = Math.max(-1.5, Math.min(1.5, pitch + down));
    draw();
  }
  function zoomBy(factor) {
    zoom = Math.max(0.1, Math.min(50, zoom * factor));
    draw();
  }
  new ResizeObserver(draw).observe(canvas);
  window.addEventListener('beforeprint', draw);
  byId('scene-key').textContent = '● estimate, with 2 sigma along the ray   ○ hidden' +
    (points.some(point => anyKnown(point.Z_true)) ? '   + truth' : '') + '   blue: way of the camera by odometry' +
    (wayOfTarget.length > 1 ? '   orange: way of the target' : '');
  byId('scene-key').style.whiteSpace = 'pre-wrap';
  return wanted => { row = wanted; draw(); };
}
